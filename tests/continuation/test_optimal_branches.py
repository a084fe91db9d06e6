"""Branches of optimal gaits against cold solves, finite differences and the passive gait."""

import json
import math

import numpy as np
import pytest

from gaitopt import (
    Collocation,
    GaitProblem,
    InputError,
    Limits,
    compass_biped,
    find_cycles,
    solve,
    verify,
)
from gaitopt.continuation import OptimumOptions, load_optima, save_optima, trace_optimum
from gaitopt.continuation.optimal import active_set_search, optimum_tracing
from gaitopt.continuation.optimal.branch_start import start_branch
from gaitopt.continuation.optimal.kkt_correction import Metric, at_value, correct, find_tangent
from gaitopt.continuation.optimal.optimum_replay import make_optimal_gait
from gaitopt.continuation.optimal.sequence_neighbours import list_neighbours
from gaitopt.errors import ArchiveError

LIMITS = Limits(torque=6)


def make_problem(**changes):
    fields = {"sequence": "stick | stick", "friction": 0.25, "speed": 0.6, "step_length": 0.47} | changes
    fields = {"objective": "torque_squared", "transcription": Collocation(intervals=20)} | fields
    return GaitProblem(robot=compass_biped(), limits=LIMITS, **fields)


@pytest.fixture(scope="module")
def problem():
    return make_problem()


@pytest.fixture(scope="module")
def diagram(problem):
    return trace_optimum(problem, {"friction": (0.25, 0.12)}, options=OptimumOptions(points=14))


@pytest.fixture(scope="module")
def branch(diagram):
    return diagram.branches[0]


@pytest.fixture(scope="module")
def low_friction():
    """An optimum at low friction with several active cones."""
    problem = make_problem(friction=0.13)
    return start_branch(problem, "friction", (0.12, 0.2), solve(problem))


def test_costs_agree_with_cold_solves(problem, branch):
    costs = [solve(problem.replace(friction=value), starts=8).solver.objective for value in branch.values[::4]]
    assert branch.costs[::4] == pytest.approx(costs, rel=1e-6)
    assert branch.end == "range_end"
    for value in np.linspace(0.25, 0.12, 14):
        assert np.abs(branch.values - value).min() < 1e-12


def test_every_point_is_replayed_and_certified(branch):
    assert branch.passed.all()
    assert branch.state_errors.max() < 1e-8
    assert branch.minimum.all()
    assert not branch.dependent.any()
    assert branch.strictness.min() > 0


def test_a_point_of_a_branch_is_a_gait_that_verify_accepts(low_friction):
    gait = verify(make_optimal_gait(low_friction))
    assert gait.verification.passed
    assert gait.certificate.strict


@pytest.mark.parametrize("sequence", ["stick | stick", "slip+ stick | slip+"])
@pytest.mark.parametrize("name", ["friction", "slope", "speed", "step_length", "leg_mass", "torque_limit of ankle"])
def test_the_tangent_is_the_derivative_of_the_optimum(sequence, name):
    problem = make_problem(sequence=sequence, friction=0.13, slope=0.002)
    gait = solve(problem)
    value = {"friction": 0.13, "slope": 0.002, "speed": 0.6, "step_length": 0.47, "leg_mass": 4.0}.get(name, 6.0)
    here = start_branch(problem, name, (value - 0.001, value + 0.001), gait)
    packed, last = find_tangent(here, Metric(here.nlp))
    step = 1e-5 * max(value, 0.1)
    ends = [correct(here.nlp, here.point, here.active, at_value(here.point.value + change)) for change in (step, -step)]
    difference = here.pack(ends[0].point.x - ends[1].point.x, ends[0].point.multipliers - ends[1].point.multipliers) / (
        2 * step
    )
    assert packed / last == pytest.approx(difference, rel=1e-4, abs=1e-4 * np.abs(difference).max() + 1e-6)
    assert here.cost_slope == pytest.approx((ends[0].cost - ends[1].cost) / (2 * step), rel=1e-5, abs=1e-6)


def test_special_points_lie_where_cold_solves_gain_an_active_constraint(problem, branch):
    assert [point.kind for point in branch.special[:3]] == ["activation"] * 3
    first = branch.special[0]
    assert first.constraint == "forward friction cone at phase 1 (stick), node 20"
    assert (first.before, first.after) == ("inactive", "active")
    assert first.width < 1e-10
    active = [solve(problem.replace(friction=first.value + side)).certificate.active for side in (1e-5, -1e-5)]
    assert active == [0, 1]


def test_the_margin_is_zero_at_a_special_point(low_friction):
    from gaitopt.continuation.optimal.path_following import PathFollower
    from gaitopt.continuation.optimal.path_items import PathChange, PathOptions

    follower = PathFollower(low_friction.nlp, PathOptions(), [0.12, 0.2])
    changes = [item for item in follower.follow(low_friction, 1) if isinstance(item, PathChange)]
    assert changes
    for change in changes:
        assert abs(change.optimum.margins[change.index]) < 1e-11
        assert np.delete(change.optimum.margins, change.index).min() > -1e-9


def test_a_branch_of_the_other_direction_has_the_same_special_points(problem, diagram):
    other = trace_optimum(problem, {"friction": (0.12, 0.25)}, options=OptimumOptions(points=3, replay=0))
    values = [point.value for point in other.branches[0].special]
    assert values[::-1] == pytest.approx([point.value for point in diagram.branches[0].special], abs=1e-10)
    assert {point.kind for point in other.branches[0].special} == {"deactivation"}
    assert not other.branches[0].replayed.any()


@pytest.mark.slow
def test_the_optimal_cost_over_the_slope_touches_zero_at_the_passive_gait():
    slope = math.radians(1)
    passive = find_cycles(compass_biped(), {"slope": slope, "friction": 0.5}, starts=10)[0]
    problem = make_problem(
        friction=0.5,
        speed=passive.travel / passive.period,
        step_length=None,
        transcription=Collocation(intervals=20),
    )
    options = OptimumOptions(points=8, replay=0)
    branch = trace_optimum(problem, {"slope": (0.6 * slope, 1.43 * slope)}, options=options).branches[0]
    touching = [point for point in branch.special_of("cost_extremum") if point.cost < 1e-9]
    assert min(abs(point.value - slope) for point in touching) < 1e-9
    assert max(point.cost for point in touching) < 1e-20
    # The branch leads to the passive gait around two turning points, between which it is no minimum.
    assert len(branch.special_of("turning_point")) == 2
    assert not branch.minimum.all()


def test_a_diagram_is_saved_and_read(diagram, tmp_path):
    read = load_optima(save_optima(diagram, tmp_path / "optima.nc"))
    assert json.dumps(read.records()) == json.dumps(diagram.records())
    assert read.targets == diagram.targets == {"speed": 0.6, "step_length": 0.47}
    with pytest.raises(ArchiveError, match="There is no file"):
        load_optima(tmp_path / "nowhere.nc")


def test_records_have_the_fields_of_the_schema(diagram):
    record = diagram.records()["branches"][0]
    assert {"kind", "period", "sequence", "points", "special", "end"} <= set(record)
    assert record["kind"] == "optimal"
    assert {"value", "state", "multipliers", "stable", "cost"} <= set(record["points"][0])
    assert {"kind", "value", "width", "state", "before", "after"} <= set(record["special"][0])


def test_an_observer_that_interrupts_ends_the_trace(problem):
    def stop(branch):
        if branch.values.size == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        trace_optimum(problem, {"friction": (0.25, 0.2)}, options=OptimumOptions(replay=0), observer=stop)


def test_an_interrupt_of_a_solve_ends_the_trace(problem, low_friction, monkeypatch):
    """Solvers return the status of an interrupt; before, it was taken for a gait that does not exist."""
    solve_uninterrupted = optimum_tracing.solve

    def stop(iteration):
        raise KeyboardInterrupt

    monkeypatch.setattr(
        optimum_tracing, "solve", lambda problem, starts: solve_uninterrupted(problem, starts=starts, observer=stop)
    )
    with pytest.raises(KeyboardInterrupt):
        trace_optimum(problem, {"friction": (0.25, 0.2)}, options=OptimumOptions(replay=0))
    monkeypatch.setattr(active_set_search, "silent", stop)
    with pytest.raises(KeyboardInterrupt):
        active_set_search.solve_nearby(low_friction, 0.14, 1.0)


@pytest.mark.slow
def test_a_branch_of_least_cost_of_transport_passes_changes_of_several_constraints():
    """Over intervals without torque, the powers at several points fix the same torque."""
    problem = make_problem(objective="cost_of_transport", friction=0.22)
    ends, gait = (0.22, 0.205), solve(problem)
    options = OptimumOptions(points=4, replay=3)
    branch = trace_optimum(problem, {"friction": ends}, start=gait, options=options).branches[0]
    assert branch.end == "range_end"
    assert np.isin(np.linspace(*ends, 4).round(12), branch.values.round(12)).all()
    assert [point.constraint.split(" at ")[0] for point in branch.special] == [
        "backward impact cone",
        "positive power of hip",
    ]
    method = start_branch(problem, "friction", ends, gait).nlp.method  # the branch keeps its grid
    cold = solve(problem.replace(friction=ends[1], transcription=method))
    assert branch.costs[-1] == pytest.approx(cold.solver.objective, rel=1e-6)
    assert np.all(branch.negative == 0)
    assert np.all(branch.dependent > 0)  # the multipliers are not unique, which the certificate states
    assert branch.strictness.min() > 0


@pytest.mark.parametrize(
    ("changes", "over", "sentence"),
    [
        ({}, {"fiction": (0.1, 0.2)}, "no parameter, target or limit 'fiction'"),
        ({}, {"friction": (0.1, 0.1)}, "two different finite ends"),
        ({}, {"friction": (0.1, "a")}, "must be two numbers"),
        ({}, {}, "one parameter of the problem with its range"),
        ({}, {"friction": (0.25, -0.1)}, "friction"),
        ({}, {"torque_limit of ankle": (6.0, 0.0)}, "equations of the problem must be the same"),
        ({}, {"speed": (3.0, 0.6)}, "No optimal gait|leave at most"),
    ],
)
def test_invalid_traces_are_refused_with_a_sentence(changes, over, sentence):
    with pytest.raises(InputError, match=sentence):
        trace_optimum(make_problem(**changes), over, options=OptimumOptions(replay=0))


def test_a_start_outside_the_range_is_refused(problem):
    with pytest.raises(InputError, match="must contain the start"):
        trace_optimum(problem, {"friction": (0.1, 0.2)}, start=solve(problem))


@pytest.fixture(scope="module")
def over_speed(problem):
    """A sticking gait whose impact meets its friction cone at a higher speed."""
    options = OptimumOptions(points=8, replay=0, neighbours=True)
    return trace_optimum(problem.replace(friction=0.14), {"speed": (0.6, 0.7)}, options=options)


@pytest.mark.slow
def test_a_sticking_impact_at_its_cone_starts_the_branch_of_the_slipping_impact(over_speed):
    first, second = over_speed.branches[:2]
    (cone,) = [point for point in first.special if "impact cone" in point.constraint]
    assert (cone.kind, cone.constraint) == ("activation", "backward impact cone at touchdown")
    assert (second.sequence, second.parent) == ("slip+ stick | slip+", 0)
    assert (min(second.values), max(second.values)) == (0.6, 0.7)


def test_the_border_of_lowest_cost_is_where_cold_solves_cost_the_same(problem, over_speed):
    (border,) = over_speed.borders
    assert (border.before, border.after) == ("stick | stick", "slip+ stick | slip+")
    assert border.crossing
    at_border = problem.replace(friction=0.14, speed=border.value)
    costs = [
        solve(at_border.replace(sequence=name), starts=8).solver.objective for name in (border.before, border.after)
    ]
    # Ipopt relaxes bounds by 1e-8, which lowers the cost of a cold solve by 1e-8 to 3e-8.
    assert costs[0] == pytest.approx(costs[1], rel=1e-7)
    assert border.cost == pytest.approx(costs[0], rel=1e-7)


@pytest.mark.slow
def test_a_branch_ends_by_name_where_no_gait_satisfies_the_limits(problem):
    options = OptimumOptions(points=4, replay=0)
    start = problem.replace(friction=0.14)
    branch = trace_optimum(start, {"speed": (0.75, 0.9)}, options=options).branches[0]
    assert branch.end == "feasibility_limit"
    end = max(point.value for point in branch.special)
    assert not solve(start.replace(speed=end + 0.003), starts=8).status.ok
    assert solve(start.replace(speed=end - 0.003), starts=8).status.ok


def test_a_shortest_slip_phase_has_the_sequence_without_it_as_neighbour():
    problem = make_problem(sequence="slip+ stick | slip+", friction=0.2)
    gait = solve(problem)
    here = start_branch(problem, "friction", (0.1, 0.25), gait)
    index = next(k for k in here.active.inequalities if here.nlp.name_constraint(k) == "duration at phase 1 (slip+)")
    assert [str(sequence) for sequence in list_neighbours(here.nlp, int(index))] == ["stick | stick"]
