"""Nodes at any fractions of the phases: the same NLP, exact absolute work, and placement at the jumps of torques."""

import dataclasses

import numpy as np
import pytest

from gaitopt import Collocation, CostOfTransport, InputError, Limits, MultipleShooting, TorqueSquared, solve, verify
from gaitopt.ocp.bounds import bounds, nlp_data, transcribe_problem
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.initial.solution_transfer import transfer_solution
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.solution.node_placement import LEAST_INTERVALS, allot_intervals, distribute_nodes, find_ramps
from gaitopt.ocp.statement.initial_guess import LinearGuess
from gaitopt.ocp.transcription.grid import divide_into_phases, place_nodes
from gaitopt.ocp.transcription.guard_constraints import GuardSchedule, transfer_schedule

SLIP = "slip+ stick | slip+"
UNEVEN = ((0.0, 0.05, 0.3, 0.5, 0.9, 1.0), (0.0, *np.cumsum(np.linspace(1, 3, 20) / 40).tolist()[:-1], 1.0))


def values(transcription, problem, x):
    return [np.asarray(part).ravel() for part in transcription.nlp.values(x, nlp_data(transcription, problem, x))]


@pytest.mark.parametrize("objective", ["cost_of_transport", "torque_squared"])
@pytest.mark.parametrize("method", [Collocation, MultipleShooting])
def test_equal_fractions_are_equal_intervals(reference_problem, method, objective):
    """The NLP whose nodes are data has the values of the NLP of equal intervals, row by row."""
    limits = Limits(torque=6, torque_rate=100, clearance=0.01)
    equal = method(intervals=(5, 8))
    placed = method(intervals=(5, 8), fractions=tuple(tuple(np.linspace(0, 1, n + 1).tolist()) for n in (5, 8)))
    problem = reference_problem(sequence=SLIP, objective=objective, limits=limits)
    one, other = (transcribe_problem(problem, grid) for grid in (equal, placed))
    assert other.structure.placed
    assert not one.structure.placed
    x = np.random.default_rng(2).uniform(0.2, 0.6, one.variables.size)
    for a, b in zip(values(one, problem, x), values(other, problem, x), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12)
    jacobians = [np.asarray(t.nlp.derivatives["jac_g"](x, nlp_data(t, problem, x))[1]) for t in (one, other)]
    np.testing.assert_allclose(*jacobians, rtol=1e-11, atol=1e-11)
    for a, b in zip(vars(bounds(one, problem)).values(), vars(bounds(other, problem)).values(), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-15)


class LateTorque(TorqueSquared):
    """Squared torques that cost more at the end of the step: an objective that depends on the time."""

    name = "late_torque"

    def integrand(self, point):
        return (1 + point.time) * super().integrand(point)


def test_the_time_of_an_uneven_node(reference_problem):
    """With equal torques everywhere the integral of the time is exact on any grid."""
    problem = reference_problem(sequence=SLIP, objective=LateTorque(), transcription=Collocation(intervals=(5, 20)))
    costs = []
    for fractions in (None, UNEVEN):
        transcription = transcribe_problem(problem, Collocation(intervals=(5, 20), fractions=fractions))
        x = initial_point(transcription, problem, LinearGuess())
        x[transcription.variables[Unknown.TORQUE]] = 1.0
        costs.append(float(transcription.nlp.objective(x, nlp_data(transcription, problem))))
    assert costs[1] == pytest.approx(costs[0], rel=1e-12)


def test_a_gait_on_uneven_nodes(reference_problem):
    """Minimised value, plan and replay agree: absolute work stays exact on uneven nodes."""
    method = Collocation(intervals=(5, 20), fractions=UNEVEN)
    problem = reference_problem(sequence=SLIP, transcription=method)
    gait = verify(solve(problem))
    assert gait.status.ok
    assert gait.verification.passed
    assert gait.problem["intervals"] == [5, 20]
    assert gait.solution.fractions == UNEVEN
    for segment, nodes in zip(gait.motion.segments, UNEVEN, strict=True):
        np.testing.assert_allclose((segment.time[::2] - segment.time[0]) / segment.duration, nodes, atol=1e-12)
    objective = CostOfTransport().evaluate(gait.motion)
    assert gait.solver.objective == pytest.approx(objective, rel=1e-5)
    assert gait.verification.cost_of_transport == pytest.approx(objective, rel=1e-4)


def test_a_solution_returns_to_its_own_nodes(reference_problem):
    """Unknowns and multipliers are copied, not interpolated; on other nodes they are interpolated."""
    problem = reference_problem(sequence=SLIP, objective="torque_squared")
    problem = problem.replace(transcription=Collocation(intervals=(5, 20), fractions=UNEVEN))
    gait = solve(problem)
    transcription = transcribe_problem(problem, problem.transcription)
    x, multipliers = transfer_solution(gait.solution, transcription, np.zeros(transcription.variables.size))
    torque, table = transcription.variables[Unknown.TORQUE], gait.solution.unknowns["torque"]
    np.testing.assert_array_equal(x[torque], table.values)
    np.testing.assert_array_equal(multipliers[0][torque], table.multipliers)
    equal = transcribe_problem(problem, Collocation(intervals=(5, 20)))
    moved = transfer_solution(gait.solution, equal, np.zeros(equal.variables.size))[0]
    stick = equal.phases[1].nodes
    np.testing.assert_allclose(
        moved[torque][:, list(stick)],
        [np.interp(np.linspace(0, 1, 21), UNEVEN[1], row[list(stick)]) for row in table.values],
    )


FRACTIONS = [
    (((0.0, 0.5, 1.0),), "fractions has 1 entry, but the sequence 'slip\\+ stick \\| slip\\+' has 2 phases"),
    (((0.0, 0.5, 1.0), (0.0, 1.0)), "must increase from 0 to 1 at the 3 nodes of 2 intervals"),
    (((0.0, 0.5, 1.0), (0.0, 1.2, 1.0)), "must increase from 0 to 1"),
    (((0.1, 0.5, 1.0), (0.0, 0.2, 1.0)), "must increase from 0 to 1"),
    (((0.0, float("nan"), 1.0), (0.0, 0.2, 1.0)), "must increase from 0 to 1"),
]


@pytest.mark.parametrize(("fractions", "message"), FRACTIONS)
def test_fractions_that_cannot_be(reference_problem, fractions, message):
    with pytest.raises(InputError, match=message):
        reference_problem(sequence=SLIP, transcription=Collocation(intervals=(2, 2), fractions=fractions))


def test_halved_intervals_keep_their_nodes(reference_problem):
    method = Collocation(intervals=(2, 2), fractions=((0.0, 0.2, 1.0), (0.0, 0.5, 1.0)))
    finer = method.double_intervals(reference_problem(sequence=SLIP).sequence)
    assert finer.intervals == (4, 4)
    np.testing.assert_allclose(finer.fractions, ((0, 0.1, 0.2, 0.6, 1), (0, 0.25, 0.5, 0.75, 1)), atol=1e-15)


def test_nodes_go_to_the_jumps_and_not_to_slopes(reference_problem):
    """A torque that jumps across one interval, then falls along a straight line."""
    gait = solve(reference_problem(objective="torque_squared", intervals=20))
    torque = np.zeros((2, 21))
    torque[1, 6:] = np.linspace(3.0, 1.0, 15)
    table = dataclasses.replace(gait.solution.unknowns["torque"], values=torque)
    solution = dataclasses.replace(gait.solution, unknowns={**gait.solution.unknowns, "torque": table})
    ramps = find_ramps(solution)
    jumps = ramps.jumps()
    assert np.argmax(jumps) == 5
    assert jumps[5] == pytest.approx(3.0, abs=0.15)
    assert np.max(np.delete(jumps, 5)) < 0.15
    (nodes,) = distribute_nodes(ramps, (20,))
    inside = np.sum((np.array(nodes) > 5 / 20) & (np.array(nodes) < 6 / 20))
    assert inside >= 8
    assert np.max(np.diff(nodes)) < 2.2 / 20
    assert allot_intervals(ramps, 40) == (40,)


def test_a_short_phase_with_jumps_receives_intervals(reference_problem):
    gait = solve(reference_problem(sequence=SLIP, objective="torque_squared", intervals=20))
    torque = np.zeros((2, 26))
    torque[0, ::2] = 5.0 * (np.arange(13) < 3)  # three peaks in the first phase, of five intervals
    table = dataclasses.replace(gait.solution.unknowns["torque"], values=torque)
    ramps = find_ramps(dataclasses.replace(gait.solution, unknowns={**gait.solution.unknowns, "torque": table}))
    slip, stick = allot_intervals(ramps, 50)
    assert slip >= 20
    assert stick >= LEAST_INTERVALS


def test_the_guard_schedule_follows_its_instants(reference_problem):
    """Instants of a schedule are nodes; on other nodes they are those nearest in time."""
    equal = divide_into_phases(reference_problem().sequence, (10,))
    uneven = place_nodes(equal, [(0.0, 0.02, 0.04, 0.06, 0.08, 0.1, 0.32, 0.5, 0.7, 0.9, 1.0)])
    moved = transfer_schedule(GuardSchedule(unarmed=0.3, below=0.5, above=0.9), equal, uneven)
    assert (moved.unarmed, moved.below, moved.above) == (0.6, 0.7, 0.9)
    assert transfer_schedule(None, equal, uneven) is None


def mean_lengths(fractions):
    """Return the mean length of the intervals beside each node, as a fraction of a step of two phases."""
    nodes = np.concatenate([np.array(fractions[0]), 1 + np.array(fractions[1][1:])]) / 2
    lengths = np.diff(nodes)
    return (np.append(lengths[0], lengths) + np.append(lengths, lengths[-1])) / 2


def test_multipliers_are_densities_in_time(reference_problem):
    """Multipliers of a constant density stay in proportion to the lengths of the intervals."""
    problem = reference_problem(sequence=SLIP, objective="torque_squared", transcription=Collocation(intervals=(5, 20)))
    solution = solve(problem).solution
    equal = mean_lengths([np.linspace(0, 1, count + 1) for count in (5, 20)])
    table = dataclasses.replace(solution.unknowns["torque"], multipliers=np.tile(3 * equal, (2, 1)))
    solution = dataclasses.replace(solution, unknowns={**solution.unknowns, "torque": table})
    uneven = transcribe_problem(problem, Collocation(intervals=(5, 20), fractions=UNEVEN))
    moved = transfer_solution(solution, uneven, np.zeros(uneven.variables.size))[1][0]
    torque = uneven.variables[Unknown.TORQUE]
    np.testing.assert_allclose(moved[torque], np.tile(3 * mean_lengths(UNEVEN), (2, 1)), rtol=1e-12)


def test_the_least_slip_speed_depends_on_the_time(reference_problem):
    """It decreases linearly to zero over the second half of a slip that ends at rest."""
    problem = reference_problem(sequence=SLIP, transcription=Collocation(intervals=(5, 20), fractions=UNEVEN))
    transcription = transcribe_problem(problem, problem.transcription)
    least = bounds(transcription, problem).x_lower[transcription.variables[Unknown.SLIDE, 0][1]]
    expected = problem.margins.slip_speed * np.minimum(1, 2 * (1 - np.array(UNEVEN[0])))
    np.testing.assert_allclose(least, expected, atol=1e-15)
