"""Branches followed over a parameter, and their special points located."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from gaitopt import InputError, compass_biped, find_cycles, passive, rimless_wheel, trace_branch
from gaitopt.simulation import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.cycle_search import find_cycle
from tests.references.storage import reference

SLOPE = math.radians(13)


def cycle_of(robot, parameters, z):
    walker = Walker(robot, passive(robot), robot.vector(robot.resolve(parameters)), default_engine())
    return find_cycle(walker, np.array(z, dtype=float))


@pytest.fixture(scope="module")
def sticking():
    return find_cycles(rimless_wheel(), {"slope": SLOPE, "friction": 1.0}, starts=10)[0]


def test_branch_follows_the_closed_form(sticking):
    slopes = np.radians([13, 10, 7])
    branch = trace_branch(rimless_wheel(), {"friction": math.inf}, sticking, {"slope": slopes})
    assert branch.ended == "all values reached"
    # McGeer's wheel: thd*^2 = beta^2 (thd*^2 + 4 g sin(pi/n) sin(alpha) / (l (1 + kappa))), energy over a step.
    kappa = 1 / 3
    beta = (math.cos(math.pi / 5) + kappa) / (1 + kappa)
    gained = 4 * 9.8 * math.sin(math.pi / 10) * np.sin(slopes) / (1 + kappa)
    expected = np.sqrt(beta**2 * gained / (1 - beta**2))
    wanted = [c.z[0] for v, c in zip(branch.values, branch.cycles, strict=True) if np.any(np.isclose(v, slopes))]
    assert wanted == pytest.approx(list(expected), rel=1e-10)


def test_branch_ends_where_the_gait_does(sticking):
    # Below this slope the wheel no longer rolls over: thd* = 2 sin((pi/n - alpha) / 2) in natural units (1.40 deg in
    # Gamus & Or 2015), with thd* in closed form as above.
    beta = (math.cos(math.pi / 5) + 1 / 3) / (4 / 3)
    least = brentq(
        lambda a: (
            beta * math.sqrt(4 * math.sin(a) * math.sin(math.pi / 10) / (1 - beta**2))
            - 2 * math.sin((math.pi / 10 - a) / 2)
        ),
        0.01,
        0.1,
    )
    assert math.degrees(least) == pytest.approx(1.40, abs=5e-3)
    branch = trace_branch(
        rimless_wheel(), {"friction": math.inf}, sticking, {"slope": np.radians(np.linspace(13, 1, 5))}, tolerance=1e-8
    )
    (end,) = branch.special
    assert (end.kind, end.before, end.after) == ("end", "stick | stick", "fell")
    assert end.width <= 1e-8
    assert abs(end.value - least) <= end.width
    assert branch.values[-1] - least == pytest.approx(0, abs=1e-8)
    assert branch.ended == f"no gait found beyond slope = {end.value:.6g}"


def test_changes_of_sequence_are_located(sticking):
    branch = trace_branch(rimless_wheel(), {"slope": SLOPE}, sticking, {"friction": [1.0, 0.6, 0.25]})
    one, two = branch.changes("sequence")
    assert branch.special == (one, two)
    assert (one.before, one.after) == ("stick | stick", "stick slip+ | stick")
    assert (two.before, two.after) == ("stick slip+ | stick", "slip+ stick slip+ | stick")
    # Where the sticking gait's force meets its cone; and by tests/references/rimless_wheel.py.
    assert abs(one.value - sticking.critical_friction.friction) <= one.width <= 1e-6
    least = reference("rimless_wheel", "ranges")["type_b_least_without_first_slip"]
    assert two.value == pytest.approx(least, abs=two.width)
    # The gaits on both sides are among those of the branch, which stays in order.
    assert np.all(np.diff(branch.values) < 0)
    for point in branch.special:
        above, below = np.flatnonzero(np.abs(branch.values - point.value) <= point.width)
        assert [branch.cycles[k].sequence for k in (above, below)] == [point.before, point.after]


def test_two_changes_between_neighbours_are_both_located(sticking):
    branch = trace_branch(rimless_wheel(), {"slope": SLOPE}, sticking, {"friction": [1.0, 0.26]}, tolerance=1e-3)
    assert [point.before for point in branch.special] == ["stick | stick", "stick slip+ | stick"]
    assert branch.special[-1].after == branch.cycles[-1].sequence == "slip+ stick slip+ | stick"


def test_branch_can_stop_at_a_change_of_sequence(sticking):
    branch = trace_branch(rimless_wheel(), {"slope": SLOPE}, sticking, {"friction": [1.0, 0.8]}, same_sequence=True)
    assert branch.ended == "the contact sequence changes to 'stick slip+ | stick'"
    assert {cycle.sequence for cycle in branch.cycles} == {"stick | stick"}
    assert branch.values[-1] == pytest.approx(branch.special[-1].value, abs=1e-6)


def test_loss_of_stability_is_located():
    robot, given = compass_biped(), {"slope": math.radians(1), "friction": 0.14}
    start = cycle_of(robot, given, [-0.1408, 0.7102, -0.5168, 0])
    branch = trace_branch(robot, given, start, {"friction": [0.14, 0.115, 0.108]})
    (point,) = branch.special
    assert point.kind == "stability"
    assert (point.before, point.after) == (f"{start.sequence}, stable", f"{start.sequence}, unstable")
    # A multiplier passes through the unit circle there, at a finite rate.
    for shift, stable in ((1e-5, True), (-1e-5, False)):
        near = branch.cycles[int(np.argmin(np.abs(branch.values - point.value)))]
        gait = cycle_of(robot, {**given, "friction": point.value + shift}, [*near.z, 0])
        assert (gait.radius < 1) is stable
        assert gait.radius == pytest.approx(1, abs=2e-3)


def test_unknown_parameter_is_named(sticking):
    with pytest.raises(InputError, match="Did you mean 'friction'"):
        trace_branch(rimless_wheel(), {}, sticking, {"fricton": [0.1]})


def test_a_branch_is_shown_in_a_line(sticking):
    branch = trace_branch(rimless_wheel(), {"slope": SLOPE}, sticking, {"friction": [1.0, 0.9]}, tolerance=1e-4)
    assert repr(branch) == ("Branch('friction', gaits: 4 from 1 to 0.9, special points: 1, ended: all values reached)")
