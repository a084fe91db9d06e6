"""A robot, an arc foot, a spring and an objective, each added by one script and used by the commands."""

import json

import pytest

WALKER = '''
"""A compass biped of uniform rods, with {what}."""
from dataclasses import dataclass

import casadi as ca

from gaitopt import (
    ArcContact, Collocation, Coordinates, Drawing, GaitProblem, Limits, Objective, Parameter, PointMass, RigidLink,
    Spring, StepEnd, assemble,
)

RADIUS, STIFFNESS = {radius}, {stiffness}


def walker():
    c = Coordinates(("a", "b"), [Parameter("gravity", 9.81, "m/s^2", "gravity")])
    a, b, r = c.angle("a"), c.angle("b"), RADIUS
    foot = ArcContact.on(c.foot, r, a)
    hip = foot.centre + (1 - r) * ca.vertcat(ca.sin(a), ca.cos(a))
    down = ca.vertcat(ca.sin(b), -ca.cos(b))
    swing = ArcContact(hip + (1 - r) * down, r, -b)
    return assemble(
        "rod_biped", c,
        bodies=[
            RigidLink(5, foot.centre + (0.5 - r) * ca.vertcat(ca.sin(a), ca.cos(a)), 5 / 12, a),
            PointMass(10, hip),
            RigidLink(5, hip + 0.5 * down, 5 / 12, -b),
        ],
        step=StepEnd(landing=swing, touchdown=b - a, armed=a, exchange=[-b, -a], upright=ca.cos(a)),
        actuators={{"ankle": a, "hip": a + b}},
        drawing=Drawing(
            {{"stance foot": foot.point, "hip": hip, "swing foot": swing.point}},
            [("stance foot", "hip"), ("hip", "swing foot")],
            stance=foot,
        ),
        forces=[Spring(a + b, STIFFNESS)] if STIFFNESS else [],
    )


@dataclass(frozen=True)
class Effort(Objective):
    """Integral of the squared torques, the hip's weighted twice."""

    name = "effort"
    unit = "N^2 m^2 s"
    smooth = True

    def integrand(self, point):
        return point.torque[0] ** 2 + 2 * point.torque[1] ** 2


ROBOT = walker()


def problem(friction=0.5, intervals=20):
    return GaitProblem(
        robot=ROBOT, sequence="stick | stick", friction=friction, speed=0.7, step_length=0.4, limits=Limits(torque=60),
        objective={objective}, transcription=Collocation(intervals=intervals),
    )
'''
SCRIPTS = {
    "robot": {"what": "point feet", "radius": 0, "stiffness": 0, "objective": '"torque_squared"'},
    "arc foot": {"what": "round feet", "radius": 0.2, "stiffness": 0, "objective": '"torque_squared"'},
    "spring": {"what": "a hip spring", "radius": 0, "stiffness": 15, "objective": '"torque_squared"'},
    "objective": {"what": "an objective", "radius": 0, "stiffness": 0, "objective": "Effort()"},
}


@pytest.fixture
def solve(folder, command):
    """Return a function that solves the script of an extension and returns the summary."""

    def run(extension):
        (folder / "walker.py").write_text(WALKER.format(**SCRIPTS[extension]))
        done = command("solve", "walker.py", "--json", "--quiet")
        assert done.status == 0, done.err
        return done.json

    return run


@pytest.mark.slow
@pytest.mark.parametrize("extension", SCRIPTS)
def test_one_script_adds_it(folder, command, solve, extension):
    gait = solve(extension)
    assert gait["status"] == "solved"
    assert gait["verification"]["passed"]
    shown = command("show", "walker.h5", "--json")
    assert shown.status == 0
    assert json.loads(shown.out)["problem"]["robot"] == "rod_biped"
    for verb in ("verify", "stability"):
        done = command(verb, "walker.h5")
        assert done.status == 0, done.err
    assert command("plot", "walker.h5", "-o", "walker.png").status == 0
    assert command("report", "walker.h5", "-o", "walker.html").status == 0


def test_round_feet_and_a_hip_spring_cost_less(solve):
    """Round feet shorten the inverted pendulum's fall (McGeer 1990); a hip spring swings the leg (Kuo 2002)."""
    objective = {extension: solve(extension)["solver"]["objective"] for extension in ("robot", "arc foot", "spring")}
    assert objective["arc foot"] < 0.9 * objective["robot"]
    assert objective["spring"] < objective["robot"]
