"""Leg exchange and touchdown guard: robots that walk pass, and a fault is named together with what to write."""

import casadi as ca
import numpy as np
import pytest

from gaitopt import (
    Coordinates,
    Drawing,
    InputError,
    Parameter,
    PointMass,
    RigidLink,
    StepEnd,
    assemble,
    check_robot,
    rimless_wheel,
)
from gaitopt.model.step_check import check_step, require_valid_step
from tests.walkers import kneed_biped, round_compass, torso_biped

WRONG = {
    "torso mirrored": (torso_biped(relabel=lambda a, b, t: [-b, -a, -t]), "exchange", "leg exchange changes the"),
    "legs not exchanged": (torso_biped(relabel=lambda a, b, t: [b, a, t]), "exchange", "leg exchange changes the"),
    "torso turned": (torso_biped(relabel=lambda a, b, t: [-b, -a, t + 0.1]), "exchange", "leg exchange changes the"),
    "knee not exchanged": (kneed_biped(lambda a, b, k: [-b, -a, -k]), "exchange", "leg exchange changes the"),
    "guard of the wrong sign": (torso_biped(touchdown=lambda a, b: a - b), "guard", "wrong sign"),
    "guard above the ground": (torso_biped(touchdown=lambda a, b: b - a + 0.1), "guard", "above the ground"),
    "armed too early": (torso_biped(armed=lambda a, b: 1), "guard", "armed where the landing foot is"),
    "armed behind": (torso_biped(armed=lambda a, b: -a), "guard", "armed where the landing foot is -"),
    "height armed in mid-step": (
        torso_biped(touchdown=lambda a, b: ca.cos(a) - ca.cos(b)),
        "guard",
        r"when the legs pass each other.*armed = landing_foot\[0\] - c.foot\[0\] - 0.1.*th2 - th1",
    ),
}


@pytest.mark.parametrize(("robot", "what", "sentence"), WRONG.values(), ids=WRONG.keys())
def test_a_wrong_step_fails_and_is_refused_in_a_sentence(robot, what, sentence):
    check = check_robot(robot, states=8)
    assert not check.passed
    assert not getattr(check, what) <= 1e-9
    with pytest.raises(InputError, match=f"Robot '{robot.name}': .*{sentence}"):
        require_valid_step(robot)


RIGHT = {
    "absolute angles": torso_biped(),
    "swing leg measured from the upward vertical": torso_biped(
        relabel=lambda a, b, t: [-b, np.pi - a, t], offset=np.pi
    ),
    "guard is the foot's height": torso_biped(
        touchdown=lambda a, b: ca.cos(a) - ca.cos(b), armed=lambda a, b: ca.sin(a) + ca.sin(b) - 0.1
    ),
    "round feet": round_compass(0.3),
    "point feet": round_compass(0.0),
    "wheel": rimless_wheel(),
}


@pytest.mark.parametrize("robot", RIGHT.values(), ids=RIGHT.keys())
def test_a_robot_that_walks_passes(robot):
    check = check_robot(robot)
    assert check.passed, check
    assert check.faults == ()
    require_valid_step(robot)


@pytest.mark.parametrize("spokes", [3, 4, 6, 17])
def test_a_wheel_with_any_number_of_spokes_passes(spokes):
    """Its exchange turns back by one spoke and never restores the angle: another foot is the next to land."""
    assert check_robot(rimless_wheel(), {"spokes": spokes}, states=5).passed


def wheel(turned_back, inertia=0.1):
    """Return a wheel whose next spoke stands 0.6 rad ahead, turned back by some other angle at touchdown."""
    c = Coordinates(["th"], [Parameter("gravity", 9.8, "m/s^2", "gravity")])
    th, hub = c.angle("th"), c.foot + ca.vertcat(ca.sin(c.angle("th")), ca.cos(c.angle("th")))
    return assemble(
        "wheel",
        c,
        bodies=[RigidLink(2.0, hub, inertia, th)],
        step=StepEnd(
            landing=hub - ca.vertcat(ca.sin(th - 0.6), ca.cos(th - 0.6)),
            touchdown=0.3 - th,
            armed=th,
            exchange=[th - turned_back],
            upright=ca.cos(th),
        ),
        actuators={},
        drawing=Drawing({"foot": c.foot, "hub": hub}, [("foot", "hub")]),
    )


def test_a_wheel_turned_back_by_another_angle_fails():
    assert check_robot(wheel(0.6), states=5).passed
    assert not check_robot(wheel(0.5), states=5).passed
    assert not check_robot(wheel(0.6 + 2 * np.pi / 3), states=5).passed


def test_a_balanced_torso_must_not_be_mirrored_either():
    """Its mirror image has the same energy, but turns the other way."""
    robot = torso_biped(relabel=lambda a, b, t: [-b, -a, -t], balanced=True)
    with pytest.raises(InputError, match="angular momentum"):
        require_valid_step(robot)


def test_a_leg_that_is_not_drawn_after_the_exchange_fails():
    check = check_robot(torso_biped(drawn=("stance foot", "hip", "head")), states=5)
    assert not check.passed
    assert check.figure > 0.01
    assert "changes the figure" in check.faults[0]


def test_a_robot_whose_steps_never_end_fails():
    check = check_robot(torso_biped(armed=lambda a, b: -1), states=3)
    assert not check.passed
    assert "armed > 0" in check.faults[0]


def test_a_pendulum_with_a_mirrored_foot_that_never_rises_fails():
    c = Coordinates(["th"], [Parameter("gravity", 9.8, "m/s^2", "gravity")])
    th, end = c.angle("th"), c.foot + ca.vertcat(ca.sin(c.angle("th")), ca.cos(c.angle("th")))
    robot = assemble(
        "rod",
        c,
        bodies=[PointMass(2.0, end)],
        step=StepEnd(
            landing=c.foot + 2 * ca.vertcat(ca.sin(th), 0),
            touchdown=0.3 - th,
            armed=th,
            exchange=[-th],
            upright=ca.cos(th),
        ),
        actuators={},
        drawing=Drawing({"foot": c.foot, "end": end}, [("foot", "end")]),
    )
    assert not check_robot(robot, states=3).passed


def test_nan_is_a_fault(compass):
    p = compass.vector(compass.resolve({"slope": 0.1, "leg_mass": 1.0}))
    p[[parameter.name for parameter in compass.parameters].index("hip_mass")] = np.nan
    check = check_step(compass, p, 3, np.random.default_rng(0))
    assert check.faults
    assert np.isnan(check.exchange)
