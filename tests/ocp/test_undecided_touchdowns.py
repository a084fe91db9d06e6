"""Touchdowns that rounding errors decide: of contacts that graze the ground, or are armed as they pass through it."""

import numpy as np
import pytest

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.ground_penetration import SampledPart
from gaitopt.motion.undecided_touchdowns import find_undecided_touchdowns_of_parts
from gaitopt.ocp import solve_planar
from gaitopt.simulation import verify_planar
from gaitopt.status import Status
from tests.walkers.heel_toe import heel_toe_step, heel_toe_walker

HEEL = "heel b"
ARMED = 0.3
"""Difference of the angles above which the heel is armed [rad]; that of leg a is -0.1 rad."""


def undecided_of(gap, angle):
    """Return the undecided touchdowns of heel b, whose gap and angle are polynomials of time between 0 and 1."""
    robot = heel_toe_walker(ARMED)
    p, at = robot.vector(robot.resolve({})), np.linspace(0, 1, 9)
    q, v = np.zeros((4, at.size)), np.zeros((4, at.size))
    q[2], q[3], v[3] = -0.1, angle(at), angle.deriv()(at)
    heights = np.array(robot.gaps.map(at.size)(q, p)[0])[robot.contact_index(HEEL)]
    slopes = (
        np.array(
            [
                float(robot.gaps(pose + 1e-6 * rate, p)[0][robot.contact_index(HEEL)])
                - float(robot.gaps(pose - 1e-6 * rate, p)[0][robot.contact_index(HEEL)])
                for pose, rate in zip(q.T, v.T, strict=True)
            ]
        )
        / 2e-6
    )
    q[1], v[1] = gap(at) - heights, gap.deriv()(at) - slopes
    parts = [SampledPart((Mode.FREE,) * 5, at, q, v, frozenset())]
    return [one for one in find_undecided_touchdowns_of_parts(robot, robot.resolve({}), parts) if one.contact == HEEL]


def parabola(least, at=0.43):
    """Return a gap with a least value [m] at a time [s]."""
    return np.polynomial.Polynomial([at**2, -2 * at, 1.0]) * 0.1 + least


@pytest.mark.parametrize(
    ("least", "angle", "count"), [(3e-7, 0.25, 1), (-3e-7, 0.25, 1), (3e-7, 0.15, 0), (1e-4, 0.25, 0)]
)
def test_an_armed_contact_grazes_the_ground_between_two_samples(least, angle, count):
    found = undecided_of(parabola(least), np.polynomial.Polynomial([angle]))
    assert len(found) == count
    for graze in found:
        assert not graze.at_arming
        assert graze.time == pytest.approx(0.43, abs=1e-4)
        assert graze.gap == pytest.approx(least, abs=1e-8)


@pytest.mark.parametrize(("late", "count"), [(0.0, 1), (1e-3, 0), (-1e-3, 0)])
def test_a_contact_is_armed_as_it_passes_through_the_ground(late, count):
    """The gap falls through zero at 0.3 s, and the heel is armed from then, or 1 ms later or earlier."""
    gap = np.polynomial.Polynomial.fromroots([0.3, 0.7]) * 0.1
    found = undecided_of(gap, np.polynomial.Polynomial([ARMED - 0.1 - 0.5 * (0.3 + late), 0.5]))
    assert [one.at_arming for one in found] == [True] * count
    assert [one.time for one in found] == pytest.approx([0.3] * count, abs=1e-6)


@pytest.mark.slow
def test_legs_that_pass_each_other_are_not_armed_there():
    """Feet on straight legs of equal length are at one height as the legs pass, where a threshold of zero arms them."""
    gait = verify_planar(solve_planar(heel_toe_step(0.0, intervals=8)))
    assert gait.status is Status.NOT_VERIFIED
    (reason,) = gait.verification.reasons
    assert "passes through the ground" in reason
    assert "the instant from which it is armed" in reason
    assert reason.endswith("Use a larger threshold in `armed` of the contact")
    assert gait.solver.warnings == (f"{reason}.",)


@pytest.mark.slow
def test_a_foot_that_rises_where_it_is_armed_is_verified():
    assert verify_planar(solve_planar(heel_toe_step(0.0, intervals=5))).verification.passed
