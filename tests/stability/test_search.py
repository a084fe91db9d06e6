"""The search for gaits, and gaits of optimised torques."""

import dataclasses
import math

import numpy as np
import pytest

from gaitopt import (
    InputError,
    SettlingCriterion,
    WalkProblem,
    assess_stability,
    compass_biped,
    find_cycles,
    load,
    passive,
    rimless_wheel,
    trace,
)
from gaitopt.simulation import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.scipy_engine import ScipyEngine
from gaitopt.stability.cycle_search import find_cycle, same_gait
from gaitopt.stability.section import Section
from gaitopt.study.basins.attractor import classify_walk


def test_search_keeps_the_sequence_asked_for():
    downhill = {"slope": math.radians(13), "friction": 0.3}
    found = find_cycles(rimless_wheel(), downhill, sequence="stick slip+ | stick", starts=40)
    assert [gait.sequence for gait in found] == ["stick slip+ | stick"]


def test_no_gait_on_level_ground():
    assert find_cycles(rimless_wheel(), {"slope": 0.0}, starts=20) == ()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"starts": 0}, "starts must be at least 1"),
        ({"steps": 0}, "steps must be at least 1"),
        ({"sequence": "stick | slip+"}, "is not periodic"),
    ],
)
def test_a_search_that_cannot_be_is_refused(options, message):
    with pytest.raises(InputError, match=message):
        find_cycles(rimless_wheel(), {}, **options)


def test_standing_still_is_no_gait():
    # Feet together and at rest, a compass biped is at a fixed point of its return map, to which this start leads.
    robot = compass_biped()
    still = {"leg_length": 1, "leg_com": 0.55, "leg_mass": 1.76, "hip_mass": 13, "slope": 0.026, "friction": 0.25}
    walker = Walker(robot, passive(robot), robot.vector(robot.resolve(still)), default_engine())
    assert find_cycle(walker, np.array([-0.023076, 0.118177, 0.2073, 0.038953])) is None


def test_section_of_compass_puts_both_feet_on_the_ground():
    robot = compass_biped()
    section = Section(robot, robot.vector(robot.resolve({})), sliding=True)
    z = np.array([-0.2, 0.5, -0.4, 0.1])
    y = section.embed(z)
    assert section.names == ("th1", "th1_rate", "th2_rate", "foot_speed")
    assert y == pytest.approx([0, 0, -0.2, -0.2, 0.1, 0, 0.5, -0.4])
    assert section.project(y) == pytest.approx(z)
    step = 1e-6
    for i, unit in enumerate(np.eye(4)):
        slope = (section.embed(z + step * unit) - section.embed(z - step * unit)) / (2 * step)
        assert slope == pytest.approx(section.tangent(z)[:, i], abs=1e-9)


def test_section_rejects_wrong_points():
    robot = compass_biped()
    with pytest.raises(InputError, match="3 finite entries"):
        Section(robot, robot.vector(robot.resolve({})), sliding=False).embed(np.zeros(4))


def test_optimised_slipping_gait_is_open_loop_stable(slip_gait):
    gait = assess_stability(slip_gait, engine=ScipyEngine())
    # Authors' independent gait of the same problem: stable, largest multiplier about 0.66.
    assert gait.sequence == "slip+ stick | slip+"
    assert gait.stable
    assert gait.radius == pytest.approx(0.66, abs=0.06)
    assert gait.period == pytest.approx(slip_gait.period, abs=1e-6)


def test_assessment_of_an_unsolved_gait_is_refused(slip_gait):
    from dataclasses import replace

    from gaitopt import Status

    with pytest.raises(InputError, match="not a solution"):
        assess_stability(replace(slip_gait, status=Status.INFEASIBLE))


def test_walk_problem_checks_its_input():
    with pytest.raises(InputError, match="Did you mean 'spokes'"):
        WalkProblem(robot=rimless_wheel(), parameters={"spoke": 8})
    with pytest.raises(InputError, match="is not periodic"):
        WalkProblem(robot=rimless_wheel(), sequence="stick | slip+")


def test_open_loop_multipliers_agree_with_finite_differences():
    from gaitopt.control.law import feedforward
    from gaitopt.simulation.hybrid_automaton import Walker

    gait = load("docs/examples/compass_slip.h5")
    robot, cycle = compass_biped(), assess_stability(gait, engine=ScipyEngine())
    walker = Walker(robot, feedforward(robot, gait.motion), robot.vector(cycle.parameters), ScipyEngine())

    def image(z):
        return cycle.section.project(walker.walk_step(cycle.section.embed(z)).following)

    step, columns = 2e-7, []
    for unit in np.eye(cycle.z.size):
        one, two = (image(cycle.z + k * step * unit) - image(cycle.z - k * step * unit) for k in (1, 2))
        columns.append((8 * one - two) / (12 * step))
    assert np.max(np.abs(np.array(columns).T - cycle.derivative)) < 1e-5 * np.max(np.abs(cycle.derivative))


def test_period_two_gait_is_found_followed_and_settled_in():
    # Beyond the first period doubling of the compass gait (Goswami et al.: at about 4.4 deg) a stable 2-cycle walks.
    goswami = {"leg_mass": 5, "hip_mass": 10, "leg_length": 1, "leg_com": 0.5, "gravity": 9.81}
    robot, slope = compass_biped(), math.radians(4.6)
    p = robot.vector(robot.resolve({**goswami, "slope": slope}))
    walker = Walker(robot, passive(robot), p, default_engine())
    start = np.array([-0.31, 1.15, -0.2, 0.0])
    ending = classify_walk(walker, start, SettlingCriterion(steps=300, tolerance=1e-8))
    assert ending.label == "stick | stick; stick | stick"
    gait = find_cycle(walker, ending.z, steps=2)
    assert gait.stable
    assert not np.allclose(gait.points[0], gait.points[1], atol=1e-3)
    assert same_gait(gait, find_cycle(walker, np.append(gait.points[1], 0.0), steps=2))
    branch = trace(WalkProblem(robot=robot, parameters=goswami), {"slope": (slope, slope + 1e-3)}, start=gait).branches[
        0
    ]
    assert branch.steps == 2
    assert branch.values[-1] == pytest.approx(slope + 1e-3, rel=1e-12)
    assert not np.allclose(branch.orbits[-1, 0], branch.orbits[-1, 1], atol=1e-3)


def test_a_cycle_is_shown_in_a_line_however_many_steps_it_has():
    gait = find_cycles(rimless_wheel(), {"slope": math.radians(13)}, starts=10)[0]
    assert repr(gait) == (
        "Cycle('rimless_wheel', 'stick | stick', stable, spectral radius 0.734042, period 0.253348 s, "
        "travel 0.618034 m)"
    )
    assert len(repr(dataclasses.replace(gait, sequences=gait.sequences * 50))) < 300
