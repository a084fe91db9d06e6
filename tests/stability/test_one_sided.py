"""Derivatives on both sides of an impact exactly on the boundary of its friction cone."""

import math

import numpy as np
import pytest

from gaitopt import rimless_wheel
from gaitopt.control.law import passive
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.scipy_engine import ScipyEngine
from gaitopt.stability.cycle_search import find_cycle
from gaitopt.stability.one_sided import one_sided_derivatives
from gaitopt.stability.section import Section

from .conftest import WHEEL


def wheel_at(friction):
    robot = rimless_wheel()
    return Walker(robot, passive(robot), robot.vector(robot.resolve({**WHEEL, "friction": friction})), ScipyEngine())


@pytest.fixture(scope="module")
def edge():
    """Friction at which Type B's impact begins to slip (0.2450 in Gamus & Or 2015), by bisection on the sequence."""
    stick, slip = 0.246, 0.244
    while stick - slip > 1e-9:
        middle = (stick + slip) / 2
        gait = find_cycle(wheel_at(middle), np.array([2.39, 0.0]))
        stick, slip = (middle, slip) if gait.sequence.endswith("| stick") else (stick, middle)
    return stick


def test_the_edge_is_where_the_study_says(edge):
    # Printed as 0.2450; ours is 0.245052, which rounds to 0.2451: one unit of the last digit.
    assert edge == pytest.approx(0.2450, abs=1e-4)
    assert edge == pytest.approx(0.2450522, abs=1e-7)


def test_both_sides_agree_with_one_sided_differences(edge):
    walker = wheel_at(edge)
    gait = find_cycle(walker, np.array([2.39, 0.0]))
    assert len(gait.one_sided) == 2
    section = Section(walker.robot, walker.p, sliding=True)
    z = np.append(gait.z, 0.0)

    def image(point):
        return section.project(walker.walk_step(section.embed(point)).following)

    # A faster or a slower start decides whether the impact slips; both are neighbours of the same gait.  Slopes are
    # taken between two points on the same side: the edge itself is only located to about 1e-8.
    step, sides = 1e-6, {}
    for sign in (1, -1):
        near, far = (image(z + np.array([k * sign * step, 0.0])) for k in (1, 2))
        sides["slip" if near[1] > 1e-12 else "stick"] = (far - near) / (sign * step)
    assert set(sides) == {"stick", "slip"}
    stick, slip = gait.one_sided
    assert sides["stick"] == pytest.approx(stick[:, 0], abs=1e-4)
    assert sides["slip"] == pytest.approx(slip[:, 0], abs=1e-4)
    assert not np.allclose(stick, slip, atol=1e-2)


@pytest.mark.parametrize("friction", [0.3, 0.24])
def test_away_from_the_edge_there_is_one_derivative(friction):
    walker = wheel_at(friction)
    gait = find_cycle(walker, np.array([2.38, 0.02]))
    state = gait.section.embed(gait.z)
    assert one_sided_derivatives(walker, state, walker.walk_step(state)) == ()
    assert gait.one_sided == ()
    assert math.isclose(gait.radius, max(abs(gait.multipliers)))
