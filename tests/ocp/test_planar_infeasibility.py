"""Infeasible problems of robots with several contacts: their conflicting limits, and plans that are not gaits."""

import math
from dataclasses import replace
from pathlib import Path

import attrs
import casadi as ca
import numpy as np
import pytest

from gaitopt import Damper, InputError, Margins, Parameter, PointContact, PointMass, Status
from gaitopt.cli.script import load_script
from gaitopt.model.planar.planar_assembly import assemble_planar
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.ocp import Collocation, PlanarLimits, PlanarProblem, solve_planar
from gaitopt.ocp.multicontact.momentum_balance import explain_imbalance
from gaitopt.ocp.multicontact.planar_bounds import planar_bounds, planar_structure
from gaitopt.ocp.multicontact.planar_infeasibility import PlanarElastic, conclude_planar_failure
from gaitopt.ocp.multicontact.planar_remarks import (
    find_least_forces,
    report_inaccuracy,
    report_magnification,
    report_overhead_angles,
)
from gaitopt.ocp.multicontact.planar_solver import _Start
from gaitopt.ocp.multicontact.planar_start import planar_start
from gaitopt.ocp.multicontact.planar_transcription import transcribe_planar
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.keys import Kind, Unknown
from gaitopt.progress import silent
from tests.ocp.multicontact_examples import hop, knee_strike, walk

WEAK = {"ankle A": 1.0, "hip": 1.0, "ankle B": 0.0}
"""Torque limits [N m] with which the walker does not reach its speed."""


@pytest.fixture(scope="module")
def refused():
    return solve_planar(weak_walk())


def weak_walk(**limits):
    limits = PlanarLimits(torque=WEAK | limits)
    return walk("foot A stick |", limits=limits, transcription=Collocation(intervals=10))


def test_an_infeasible_problem_names_the_conflicting_limits(refused):
    assert refused.status is Status.INFEASIBLE
    assert refused.solver.message.startswith("no feasible motion found near the initial guess: ")
    names = {conflict.name: conflict for conflict in refused.solver.conflicts}
    assert {*names} == {"torque limit of ankle A", "torque limit of hip"}
    for conflict in names.values():
        assert conflict.separable
        assert conflict.sufficient > conflict.limit == 1
        assert "N m alone would suffice" in str(conflict)


@pytest.mark.slow
@pytest.mark.parametrize("actuator", ["ankle A", "hip"])
def test_relaxing_one_of_them_suffices_and_less_does_not(refused, actuator):
    (conflict,) = (each for each in refused.solver.conflicts if each.name.endswith(actuator))
    assert solve_planar(weak_walk(**{actuator: conflict.sufficient})).status.ok
    missing = 0.9 * (conflict.sufficient - conflict.limit)
    assert not solve_planar(weak_walk(**{actuator: conflict.limit + missing})).status.ok


def test_an_interrupt_of_the_search_for_conflicts_is_reported(refused):
    def stop(iteration):
        raise KeyboardInterrupt

    failure = refused.replace_fields(solver=refused.solver.replace_fields(conflicts=()))
    gait = conclude_planar_failure(weak_walk(), failure, Ipopt(), stop, solve_planar)
    assert gait.status is Status.INTERRUPTED


def test_a_plan_that_is_not_accurate_between_its_nodes_is_not_solved(monkeypatch):
    """If a finer grid has no solution, the plan keeps its error between nodes, and its status states this."""

    def solve_coarse_grid_only(start, problem, *arguments, is_near=False, **options):
        result = solve_grid(start, problem, *arguments, is_near=is_near, **options)
        status = Status.FAILED if is_near else result.outcome.status
        return replace(result, outcome=replace(result.outcome, status=status))

    solve_grid = _Start.solve
    monkeypatch.setattr(_Start, "solve", solve_coarse_grid_only)
    problem = walk("foot A stick |", transcription=Collocation(intervals=4, tolerance=1e-12))
    gait = solve_planar(problem)
    assert gait.status is Status.PLAN_INACCURATE
    (warning,) = gait.solver.warnings
    assert "phase 1 (foot A stick) is" in warning
    assert "on 4 intervals, but the tolerance is 1.0e-12, and a finer grid has no solution (failed on" in warning
    with pytest.raises(InputError, match=r"is not a solution \(plan_inaccurate\).*the error between nodes of phase 1"):
        gait.require()


def test_an_inaccurate_plan_names_the_contact_whose_normal_force_is_at_its_lower_bound():
    """Torques change within one interval of any grid there, so more intervals are no remedy; larger margins are."""
    problem = walk("foot A stick |", margins=Margins(), transcription=Collocation(intervals=4))
    transcription = transcribe_planar(planar_structure(problem))
    bounds, (phase,) = planar_bounds(transcription, problem), transcription.phases
    forces = transcription.variables[Unknown.ACCELERATION, 0][problem.robot.n_q]
    x = np.maximum(planar_start(transcription, problem, None), np.nan_to_num(bounds.x_lower, neginf=-1e3) + 1)
    assert find_least_forces(transcription, phase, bounds, x) == []
    x[forces[2]] = bounds.x_lower[forces[2]]
    contacts = find_least_forces(transcription, phase, bounds, x)
    assert contacts == ["foot A"]
    sentence = report_inaccuracy(transcription, problem, np.array([2e-7]), "", contacts)
    assert "the normal force of foot A is at its lower bound" in sentence
    assert "use Collocation(tolerance=1e-6) if the plan then passes its replay, or larger margins" in sentence
    assert "Margins(normal_force=0.02, separation=0.01)" in sentence
    assert "more intervals" not in sentence


@pytest.mark.parametrize(
    ("margins", "tolerance", "advised", "absent"),
    [
        (Margins(), 1e-7, ("Collocation(tolerance", "Margins(normal_force=0.02, separation=0.01)"), ("sequence",)),
        (Margins(separation=0.01), 1e-7, ("Margins(normal_force=0.02)",), ("separation", "sequence")),
        (Margins(normal_force=0.02), 1e-7, ("Margins(separation=0.01)", "in which foot A opens"), ("normal_force=",)),
        (Margins(normal_force=0.02, separation=0.01), 1e-6, ("in which foot A opens",), ("Margins", "Collocation(")),
    ],
)
def test_a_remedy_that_the_problem_has_is_not_advised_again(margins, tolerance, advised, absent):
    method = Collocation(intervals=4, tolerance=tolerance)
    problem = walk("foot A stick |", margins=margins, transcription=method)
    transcription = transcribe_planar(planar_structure(problem))
    sentence = report_inaccuracy(transcription, problem, np.array([2 * tolerance]), "", ["foot A"])
    assert all(text in sentence for text in advised)
    assert not any(text in sentence for text in absent)
    assert sentence.endswith("guess near a plausible motion.")


def test_ranges_are_advised_for_the_angles_without_any():
    limits = PlanarLimits(coordinate={"a": (-1, 1)})
    texts = []
    for problem in (
        walk("foot A stick |", limits=limits),
        walk("foot A stick |", limits=attrs.evolve(limits, coordinate={"a": (-1, 1), "b": (-1, 1)})),
    ):
        transcription = transcribe_planar(planar_structure(problem))
        texts.append(report_inaccuracy(transcription, problem, np.array([2e-6]), ""))
    assert "PlanarLimits.coordinate of b, which" in texts[0]
    assert "PlanarLimits" not in texts[1]


def test_points_that_the_grid_has_are_not_advised_again():
    texts = [
        report_magnification(walk("foot A stick |", transcription=Collocation(points=points)), 1e-8, 1e-5)
        for points in (4, 8)
    ]
    assert "Collocation(points=8)" in texts[0]
    assert "Collocation" not in texts[1]


@pytest.mark.parametrize(
    ("coarser", "ending", "stated", "advised"),
    [
        (4e-5, "", "although this decreased the error from 4.0e-05", True),
        (3e-6, "", "does not decrease it sufficiently (from 3.0e-06), so that more intervals do not help", False),
        (4e-5, "failed on 8 intervals", "a finer grid has no solution (failed on 8 intervals)", False),
        (None, "", "the grid is not refined further", False),
    ],
)
def test_more_intervals_are_advised_only_if_they_decrease_the_error(coarser, ending, stated, advised):
    problem = walk("foot A stick |", transcription=Collocation(intervals=4))
    transcription = transcribe_planar(planar_structure(problem))
    errors = None if coarser is None else np.array([coarser])
    sentence = report_inaccuracy(transcription, problem, np.array([2e-6]), ending, (), errors)
    assert stated in sentence
    assert ("use more intervals" in sentence) is advised
    assert "PlanarLimits.coordinate" in sentence


def test_the_last_refinement_states_the_error_of_the_coarser_grid():
    problem = walk("foot A stick |", transcription=Collocation(intervals=4, tolerance=1e-30))
    gait = solve_planar(problem)
    assert gait.status is Status.PLAN_INACCURATE
    assert "(from " in gait.solver.warnings[0] or "decreased the error from" in gait.solver.warnings[0]


def test_a_repair_that_was_solved_is_not_solved_again(monkeypatch):
    problem = walk("foot A stick |", transcription=Collocation(intervals=4, tolerance=math.inf))
    start = _Start(Ipopt(permute=True), silent)
    result = start.solve(problem)
    row = next(i for i, (_, key) in enumerate(result.transcription.constraints.entries) if key.kind is Kind.GAP)
    repaired = start._solve_with_bounds(result, {row: -1.0})
    iterations = start.iterations
    assert start._solve_with_bounds(result, {row: -1.0}) is repaired
    assert start.iterations == iterations
    assert start._solve_with_bounds(result, {row: -2.0}) is not repaired


def test_the_force_of_a_joint_stop_has_no_margin_that_is_advised():
    sequence = "foot A stick, knee A closed | foot A stick, knee A closed, knee B latched |"
    problem = knee_strike().replace(sequence=sequence, transcription=Collocation(intervals=(3, 3)))
    transcription = transcribe_planar(planar_structure(problem))
    bounds, phase = planar_bounds(transcription, problem), transcription.phases[0]
    foot, stop = transcription.variables[Unknown.ACCELERATION, 0][problem.robot.n_q :][:2]
    x = np.maximum(planar_start(transcription, problem, None), np.nan_to_num(bounds.x_lower, neginf=-1e3) + 1)
    x[[foot[1], stop[1]]] = bounds.x_lower[[foot[1], stop[1]]]
    assert find_least_forces(transcription, phase, bounds, x) == ["foot A"]


def test_a_contact_that_closes_before_its_touchdown_makes_a_plan_inaccurate(monkeypatch):
    """If no repair raises the foot, the plan is not called solved, and its warning names the contact and the phase."""

    def find_row(plan, clearance):
        gap = (key.kind is Kind.GAP and key.of == "foot B" for _, key in plan.transcription.constraints.entries)
        return {next(row for row, is_gap in enumerate(gap) if is_gap): -1.0}

    monkeypatch.setattr("gaitopt.ocp.multicontact.grid_result.find_early_touchdowns", find_row)
    gait = solve_planar(walk("foot A stick |", transcription=Collocation(intervals=10)))
    assert gait.status is Status.PLAN_INACCURATE
    (warning,) = gait.solver.warnings
    assert warning.startswith(
        "contact 'foot B' touches the ground in phase 1 (foot A stick), at 0 s, before its planned touchdown, with a "
        "least gap of "
    )


def test_a_phase_of_minimum_duration_is_a_warning():
    period = 0.4713 / 0.633
    limits = PlanarLimits(torque={"ankle B": 0}, shortest_phase=period * (1 - 1e-9))
    gait = solve_planar(walk("foot A stick |", limits=limits, transcription=Collocation(intervals=10)))
    assert gait.status is Status.SOLVED
    (warning,) = gait.solver.warnings
    assert warning.startswith(f"phase 1 (foot A stick) lasts {period:g} s, the minimum (PlanarLimits.shortest_phase)")


@pytest.mark.parametrize(
    ("sequence", "sign"), [("foot slip+ > flight |", "forward"), ("foot slip- > flight |", "backward")]
)
def test_a_hop_whose_foot_slips_in_one_direction_only_is_refused_with_its_reason(sequence, sign):
    gait = solve_planar(hop(sequence, friction=0.3))
    assert gait.status is Status.INFEASIBLE
    assert f"all contacts slip {sign} all the time" in gait.solver.message
    assert gait.solver.iterations <= 1


def test_slip_in_one_direction_is_possible_if_gravity_balances_friction():
    downhill = hop("foot slip+ > flight |", friction=math.tan(0.1)).replace(slope=0.1)
    both = downhill.replace(friction=0.2, transcription=Collocation())
    assert explain_imbalance(downhill) is None
    assert "tan(slope) = 0.1003" in explain_imbalance(downhill.replace(friction=0.2))
    assert "-tan(slope) = -0.1003" in explain_imbalance(downhill.replace(sequence="foot slip- > flight |"))
    assert explain_imbalance(downhill.replace(friction=0.2, sequence="foot stick > flight |")) is None
    assert explain_imbalance(both.replace(sequence="foot slip+ > foot stick > flight |")) is None


def test_an_angle_of_half_a_revolution_is_remarked_unless_its_range_is_stated():
    problem = weak_walk()
    transcription = transcribe_planar(planar_structure(problem))
    x = planar_start(transcription, problem)
    assert report_overhead_angles(transcription, problem, x) == ()
    name = problem.robot.coordinates[-1]
    x[transcription.variables[Unknown.COORDINATES][-1, 1]] = -3.5
    (remark,) = report_overhead_angles(transcription, problem, x)
    assert remark.startswith(f"angle {name} reaches -201 deg: if this is not intended, state its range")
    stated = problem.replace(limits=attrs.evolve(problem.limits, coordinate={name: (-4, 4)}))
    assert report_overhead_angles(transcription, stated, x) == ()


def test_a_slope_steeper_than_friction_is_refused():
    steep = hop("foot stick > flight |", friction=0.1).replace(slope=-0.2)
    gait = solve_planar(steep)
    assert gait.status is Status.INFEASIBLE
    assert gait.solver.iterations <= 1
    assert gait.solver.message.startswith("-tan(slope) = 0.2027 exceeds friction 0.1 on the slope of -0.2 rad")
    assert explain_imbalance(steep.replace(friction=0.21)) is None
    assert explain_imbalance(steep.replace(free={"slope": (-0.3, 0.0)})) is None


@pytest.mark.parametrize("pulled", [False, True])
def test_an_actuator_along_the_travel_may_balance_friction(pulled):
    c = PlanarCoordinates(("x", "y"), [Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration")])
    place = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    actuators = {"jump": place[1], **({"rope": place[0]} if pulled else {})}
    sledge = assemble_planar(
        "sledge", c, bodies=[PointMass(1.0, place)], contacts={"foot": PointContact(place)}, actuators=actuators
    )
    problem = PlanarProblem(robot=sledge, sequence="foot slip+ > flight |", friction=0.3, speed=1.0)
    assert (explain_imbalance(problem) is None) is pulled


def test_slip_in_one_direction_is_possible_if_drag_balances_friction():
    c = PlanarCoordinates(("x", "y"), [Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration")])
    place = ca.vertcat(c.coordinate("x"), c.coordinate("y"))

    def block(*forces):
        parts = {"bodies": [PointMass(1.0, place)], "contacts": {"foot": PointContact(place)}}
        return assemble_planar("block", c, actuators={"lift": place[1]}, forces=forces, **parts)

    problem = PlanarProblem(robot=block(), sequence="foot slip- > flight |", friction=0.1, speed=1.0)
    assert "-tan(slope) = 0" in explain_imbalance(problem)
    assert explain_imbalance(problem.replace(robot=block(Damper(place[0], 5.0)))) is None
    assert explain_imbalance(problem.replace(robot=block(Damper(place[1], 5.0)))) is not None


@pytest.mark.slow
def test_the_friction_that_suffices_is_near_the_smallest():
    """The motion of least excess needs 4.95, the ratio of two small forces; a gait exists at 0.05."""
    problem = load_script(Path(__file__).parents[2] / "problems" / "telescoping_biped.py")
    elastic = PlanarElastic(problem(friction=0.01), Ipopt(permute=False, tolerance=1e-6), silent)
    nearest = elastic.minimise_excess()
    sufficient = elastic.find_sufficient_friction(nearest.x)
    assert 0.01 < sufficient < 0.25
    assert solve_planar(problem(friction=sufficient)).status.ok
