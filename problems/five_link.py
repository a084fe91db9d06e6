"""A five-link walker, with knees and a torso, whose touchdown slips: an example of a custom robot.

The walker has two legs with shank and thigh, a torso, point feet, torques at knees and hips, and no ankle torque.  Its
size is about that of the robot RABBIT (Chevallereau et al., IEEE Control Systems Magazine 23(5), 2003); the links are
uniform rods.

Run it with ``gaitopt solve problems/five_link.py``; change any keyword below with ``--set NAME=VALUE``.
"""

import functools

import attrs
import casadi as ca

from gaitopt import (
    Collocation,
    Coordinates,
    Drawing,
    GaitProblem,
    Limits,
    Parameter,
    RigidLink,
    Robot,
    StepEnd,
    assemble,
)
from gaitopt.ocp import transcription_named

PARAMETERS = tuple(
    Parameter(name, default, unit, meaning, lower=0, lower_open=True)
    for name, default, unit, meaning in (
        ("shank_length", 0.4, "m", "length of a shank"),
        ("thigh_length", 0.4, "m", "length of a thigh"),
        ("torso_length", 0.63, "m", "length of the torso"),
        ("shank_mass", 3.2, "kg", "mass of a shank"),
        ("thigh_mass", 6.8, "kg", "mass of a thigh"),
        ("torso_mass", 12.0, "kg", "mass of the torso"),
        ("gravity", 9.81, "m/s^2", "gravitational acceleration"),
    )
)


def rod(mass, start, end, length, angle):
    """Return a uniform rod."""
    return RigidLink(mass, (start + end) / 2, mass * length**2 / 12, angle)


@functools.cache
def five_link() -> Robot:
    """Return the walker; thigh and torso angles are forward from the vertical, knee angles from the straight leg."""
    c = Coordinates(("stance thigh", "stance knee", "torso", "swing thigh", "swing knee"), PARAMETERS)
    thigh1, knee1, torso, thigh2, knee2 = (c.angle(name) for name in c.angles)
    shank, thigh, trunk = (c.parameter(f"{name}_length") for name in ("shank", "thigh", "torso"))
    shank_mass, thigh_mass, torso_mass = (c.parameter(f"{name}_mass") for name in ("shank", "thigh", "torso"))

    def up(length, angle):
        return length * ca.vertcat(ca.sin(angle), ca.cos(angle))

    stance_knee = c.foot + up(shank, thigh1 + knee1)
    hip = stance_knee + up(thigh, thigh1)
    head = hip + up(trunk, torso)
    swing_knee = hip - up(thigh, thigh2)
    swing_foot = swing_knee - up(shank, thigh2 + knee2)
    return assemble(
        "five_link",
        c,
        description="five-link walker with knees, torso and point feet",
        bodies=[
            rod(shank_mass, c.foot, stance_knee, shank, thigh1 + knee1),
            rod(thigh_mass, stance_knee, hip, thigh, thigh1),
            rod(torso_mass, hip, head, trunk, torso),
            rod(thigh_mass, hip, swing_knee, thigh, thigh2),
            rod(shank_mass, swing_knee, swing_foot, shank, thigh2 + knee2),
        ],
        step=StepEnd(
            landing=swing_foot,
            touchdown=swing_foot[1] - c.foot[1],  # the step ends when the foot comes down ...
            armed=swing_foot[0] - c.foot[0] - 0.1,  # ... well ahead of the other
            exchange=[thigh2, knee2, torso, thigh1, knee1],
            upright=ca.cos(thigh1),
        ),
        actuators={
            "stance knee": knee1,
            "stance hip": torso - thigh1,
            "swing hip": torso - thigh2,
            "swing knee": knee2,
        },
        drawing=Drawing(
            {
                "stance foot": c.foot,
                "stance knee": stance_knee,
                "hip": hip,
                "head": head,
                "swing knee": swing_knee,
                "swing foot": swing_foot,
            },
            [
                ("stance foot", "stance knee"),
                ("stance knee", "hip"),
                ("hip", "head"),
                ("hip", "swing knee"),
                ("swing knee", "swing foot"),
            ],
        ),
    )


def problem(
    friction=0.2,  # Coulomb coefficient
    speed=0.6,  # [m/s]
    step_length=0.4,  # travel per step [m]
    torque_limit=30.0,  # of each actuator [N m]
    clearance=0.02,  # minimum height of the swing foot where it passes the stance foot [m]
    objective="torque_squared",
    intervals=80,  # grid intervals of a sticking phase (a slip phase has a quarter)
    points=6,  # collocation points per interval: many, because errors grow by a factor of 50 000 within a step
    sequence="slip+ stick | slip+",  # contact sequence: phases | impact
    transcription="collocation",  # or multiple_shooting, which has no points
):
    """Return the problem: minimise the objective at a given speed and step length."""
    knee = (0.02, 1.5)  # knees do not bend backwards
    method = transcription_named(transcription)(intervals=intervals, tolerance=1e-6)
    if isinstance(method, Collocation):
        method = attrs.evolve(method, points=points)
    return GaitProblem(
        name="five-link walker, slipping impact",
        robot=five_link(),
        sequence=sequence,
        friction=friction,
        speed=speed,
        step_length=step_length,
        limits=Limits(torque=torque_limit, angle={"stance knee": knee, "swing knee": knee}, clearance=clearance),
        objective=objective,
        transcription=method,
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
