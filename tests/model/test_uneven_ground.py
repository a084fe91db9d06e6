"""Robots on uneven ground: the same mechanics as on a plane of another slope, and steps of stairs."""

from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from gaitopt import Collocation, GaitProblem, InputError, Limits, compass_biped, ledger, solve, verify
from gaitopt.cli.script import load_script
from gaitopt.model import Mode, solve_impact
from gaitopt.model.contacts.mode import PHYSICAL
from gaitopt.model.robots.round_foot_walker import round_foot_walker
from gaitopt.model.uneven_ground import adapt_to_uneven_ground
from gaitopt.motion.energy import absolute_work
from gaitopt.ocp.bounds import nlp_data, transcribe_problem
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.multistep.multistep_gait import join_steps
from gaitopt.ocp.nlp.keys import Kind, Unknown
from gaitopt.ocp.solution.swing_foot_checks import lack_of_height
from gaitopt.ocp.statement.initial_guess import LinearGuess
from gaitopt.ocp.statement.objective import Objective
from gaitopt.simulation.verification import _check_exchange

ROOT = Path(__file__).parents[2]
COMPASS = compass_biped()
UNEVEN = adapt_to_uneven_ground(COMPASS)
INCLINE, SLOPE = 0.12, 0.05
SHIFT = np.array([0, 0, INCLINE, -INCLINE])
"""Angles from the normal of inclined ground instead of that of the plane: forward for the stance leg, backward for the
swing leg."""

PLANE = COMPASS.vector(COMPASS.resolve({"slope": SLOPE - INCLINE, "friction": 0.2}))
GROUND = UNEVEN.vector(UNEVEN.resolve({"slope": SLOPE, "friction": 0.2, "incline": INCLINE, "next_incline": INCLINE}))


def states(count=5):
    random = np.random.default_rng(0)
    return [(np.append([0, 0], random.normal(0, 0.2, 2)), random.normal(0, 1, 4)) for _ in range(count)]


@pytest.mark.parametrize("mode", PHYSICAL, ids=lambda mode: mode.name)
def test_accelerations_on_inclined_ground_are_those_on_a_plane_of_that_slope(mode):
    for q, v in states():
        here = UNEVEN.acceleration[mode](q, v, [1, 2], GROUND)
        there = COMPASS.acceleration[mode](q + SHIFT, v, [1, 2], PLANE)
        for one, other in zip(here, there, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-11)


def test_touchdown_and_impact_on_inclined_ground_are_those_on_a_plane_of_that_slope():
    pose, rates = np.array([0, 0, 0.15, 0.15]), np.array([0, 0, 0.6, -0.1])
    here = solve_impact(UNEVEN, pose - SHIFT, rates, GROUND)
    there = solve_impact(COMPASS, pose, rates, PLANE)
    assert here.mode is there.mode is Mode.SLIP_FORWARD
    np.testing.assert_allclose(here.impulse, there.impulse, atol=1e-12)
    np.testing.assert_allclose(here.v_plus, there.v_plus, atol=1e-12)
    guard, rate, armed = UNEVEN.touchdown(pose - SHIFT, rates, GROUND)
    assert float(guard) == pytest.approx(0, abs=1e-12)
    assert float(rate) < 0 < float(armed)


def test_the_frame_of_the_next_foothold_is_that_of_its_incline():
    p = UNEVEN.vector(UNEVEN.resolve({"next_incline": INCLINE, "rise": 0.03}))
    q, v = np.array([0, 0, 0.1, 0.2]), np.array([0, 0, 0.6, -0.1])
    place, velocity, _ = (
        np.asarray(part).ravel() for part in COMPASS.landing(q, v, COMPASS.vector(COMPASS.resolve({})))
    )
    q_next, v_next = (np.asarray(part).ravel() for part in UNEVEN.swap(q, v, p))
    turn = np.array([[np.cos(INCLINE), np.sin(INCLINE)], [-np.sin(INCLINE), np.cos(INCLINE)]])
    np.testing.assert_allclose(q_next[:2], turn @ place, atol=1e-14)
    np.testing.assert_allclose(v_next[:2], turn @ velocity, atol=1e-14)
    np.testing.assert_allclose(np.asarray(UNEVEN.unswap(q, v_next, p)).ravel(), v, atol=1e-13)
    height = place[1] - 0.03 - np.tan(INCLINE) * place[0]
    assert float(UNEVEN.touchdown(q, v, p)[0]) == pytest.approx(height, abs=1e-14)


def problem(**ground):
    return GaitProblem(
        robot=UNEVEN,
        parameters=ground,
        sequence="stick | stick",
        friction=0.3,
        speed=0.6,
        step_length=0.45,
        limits=Limits(torque=20),
        objective="torque_squared",
    )


@pytest.mark.parametrize("rise", [0.03, -0.03])
def test_a_periodic_gait_climbs_or_descends_stairs(rise):
    gait = verify(solve(problem(rise=rise)))
    assert gait.status.ok, gait.verification
    heights = [jump.q_next[1] for jump in join_steps([gait.motion] * 2).jumps]
    np.testing.assert_allclose(heights, [rise, 2 * rise], atol=1e-10)
    assert gait.motion.jumps[0].q_next[1] == pytest.approx(rise, abs=1e-10)
    book, weight = ledger(gait.motion), 10 * 9.8  # two legs of 4 kg and a hip of 2 kg
    assert book.gravity == pytest.approx(-weight * rise, rel=1e-9)
    assert book.relative_residual < 1e-9


class Length(Objective):
    name, unit = "length", "m"

    def boundary(self, step):
        return step.travel


def test_travel_on_inclined_ground_is_that_along_the_plane():
    gait = verify(solve(problem(incline=-0.1, next_incline=-0.1)))
    assert gait.status.ok, gait.verification
    np.testing.assert_allclose([gait.step_length, gait.speed], [0.45, 0.6], rtol=1e-9)
    assert gait.cost_of_transport == pytest.approx(absolute_work(gait.motion) / (10 * 9.8 * 0.45), rel=1e-9)
    assert Length().evaluate(gait.motion) == pytest.approx(0.45)
    walk = join_steps([gait.motion] * 2)
    assert walk.travel == pytest.approx(0.9)
    np.testing.assert_allclose(walk.jumps[1].q_next[:2], [0.9, -0.9 * np.tan(0.1)], atol=1e-9)
    # relative to the plane the foot descends, relative to the ground it rises
    jump = replace(gait.motion.jumps[0], v_minus=np.array([1, 0.05, 0, 0]))
    faults = _check_exchange(UNEVEN, replace(gait.motion, jumps=(jump,)))
    assert "its normal velocity is 0.05 m/s" in faults[0]


def test_a_slide_does_not_change_the_clearance_on_inclined_ground():
    stated = problem(rise=0.05, incline=0.15, next_incline=0.15).replace(
        sequence="slip+ | slip+",
        limits=Limits(torque=20, clearance=0.01),
        transcription=Collocation(intervals=6),
    )
    transcription = transcribe_problem(stated, stated.transcription)
    layout, functions = transcription.variables, transcription.nlp.functions
    evaluate = ca.Function("constraints", [functions["x"], functions["p"]], [functions["g"]])
    rows = [i for i, (_, key) in enumerate(transcription.constraints.entries) if key.kind is Kind.CLEARANCE]
    values = []
    for slide in (0.0, 0.05):
        x = initial_point(transcription, stated, LinearGuess())
        x[layout[Unknown.ANGLES]] += [[0.05], [-0.05]]  # the foot lacks most height ahead of the stance foot
        x[layout[Unknown.SLIDE, 0][0]] = slide
        x[layout[Unknown.TRAVEL]] = 0.45 + slide * np.cos(0.15)
        constraints = evaluate(x, nlp_data(transcription, stated, x)).full().ravel()
        values.append([*constraints[rows], lack_of_height(transcription, stated, x)])
    np.testing.assert_allclose(*values, atol=1e-14)


def test_only_walkers_with_point_feet_are_accepted():
    assert adapt_to_uneven_ground(UNEVEN) is UNEVEN
    with pytest.raises(InputError, match="robot must be a Robot"):
        adapt_to_uneven_ground(round_foot_walker())
    with pytest.raises(InputError, match="round feet; uneven ground is accepted for point feet only"):
        adapt_to_uneven_ground(load_script(ROOT / "problems" / "round_feet_slip.py")().robot)
