"""Sequences whose impact is open: found by complementarity, and checked against solving every closed sequence."""

import math
from dataclasses import replace

import pytest

from gaitopt import Homotopy, InputError, Ipopt, Limits, Mode, load, save, solve, verify
from gaitopt.errors import SequenceError
from gaitopt.model import solve_impact
from gaitopt.motion import summarise
from gaitopt.motion.gait_table import tabulate_gait
from gaitopt.ocp import ExactPenalty, FischerBurmeister, Scholtes
from gaitopt.ocp.mode_search.impact_proposal import list_outcomes_near
from gaitopt.ocp.solution.certification import Certification
from gaitopt.progress import HomotopyIteration
from gaitopt.status import Status

OPEN, CLOSED = "slip+ stick | any", ("slip+ stick | stick", "slip+ stick | slip+")


@pytest.fixture(scope="module")
def found(reference_problem):
    """Return the open problem's gait at friction 0.14, replayed, and the steps that its observer received."""
    steps = []
    gait = solve(reference_problem(sequence=OPEN), observer=steps.append)
    return verify(gait), [step for step in steps if isinstance(step, HomotopyIteration)]


@pytest.mark.parametrize(
    ("friction", "relaxation"), [pytest.param(0.1, FischerBurmeister(), marks=pytest.mark.slow), (0.2, Scholtes())]
)
def test_the_best_closed_sequence_is_found_at_its_cost(reference_problem, friction, relaxation):
    gait = solve(reference_problem(sequence=OPEN, friction=friction), homotopy=Homotopy(relaxation=relaxation))
    closed = [solve(reference_problem(sequence=sequence, friction=friction)) for sequence in CLOSED]
    best = min((other for other in closed if other.status.ok), key=lambda other: other.cost_of_transport)
    assert gait.status.ok
    assert gait.sequence == best.sequence
    assert gait.cost_of_transport == pytest.approx(best.cost_of_transport, abs=1e-6)
    assert gait.proposal.relaxation == relaxation.name


def test_the_reference_gait(found, solved):
    gait, _ = found
    assert gait.verification.passed
    assert str(gait.sequence) == "slip+ stick | slip+"
    assert gait.cost_of_transport == pytest.approx(solved(sequence="slip+ stick | slip+").cost_of_transport, abs=1e-6)
    # On equal grids the relaxed problem and the closed contact sequence differ by less still.
    assert gait.proposal.cost_after == pytest.approx(gait.proposal.cost_before, rel=1e-5)


def test_the_record_says_how_it_was_found(found, tmp_path):
    gait, steps = found
    proposal = gait.proposal
    assert tuple(steps) == proposal.steps
    assert proposal.sequence == OPEN
    assert proposal.complementarity == proposal.steps[-1].complementarity <= Homotopy().tolerance
    assert proposal.stationarity.startswith("strong")
    assert proposal.reason == ""
    assert gait.problem["sequence"] == str(gait.sequence)
    assert gait.solver.iterations > sum(step.iterations for step in steps)
    assert load(save(gait, tmp_path / "gait.h5")).proposal == proposal
    lost = replace(proposal, steps=(replace(steps[0], complementarity=math.nan),))
    again = load(save(replace(gait, proposal=lost), tmp_path / "lost.h5")).proposal
    assert math.isnan(again.steps[0].complementarity)
    assert summarise(gait)["proposal"]["sequences"] == ["slip+ stick | slip+"]
    origin = dict(tabulate_gait(gait))["contact sequence found"]
    assert origin.startswith("from 'slip+ stick | any' (exact penalty, ")
    assert "costs on coarse grids: relaxed problem " in origin


def test_the_impact_found_is_the_impact_laws(found, compass):
    """The exact solution of the impact law from the rates before has the same outcome, impulse and rates after."""
    gait, _ = found
    jump, p = gait.motion.jumps[0], compass.vector(gait.motion.parameters)
    exact = solve_impact(compass, jump.q, jump.v_minus, p)
    assert exact.mode is Mode.SLIP_FORWARD
    assert exact.impulse == pytest.approx(jump.impulse, abs=1e-7)
    assert exact.v_plus == pytest.approx(jump.v_plus, abs=1e-7)


@pytest.mark.parametrize(
    ("impulse", "speed", "modes"),
    [
        ((-0.14, 1.0), 0.2, ["slip+"]),
        ((0.14, 1.0), -0.2, ["slip-"]),
        ((-0.1, 1.0), 0.0, ["stick"]),
        ((-0.14, 1.0), 1e-6, ["stick", "slip+"]),
        ((0.14, 1.0), -1e-6, ["stick", "slip-"]),
    ],
)
def test_an_impact_on_the_edge_of_its_cone_proposes_both_that_meet_there(reference_problem, impulse, speed, modes):
    assert [mode.value for mode in list_outcomes_near(*impulse, speed, reference_problem())] == modes


def test_a_sticking_impact_exactly_on_its_cone(reference_problem, solved):
    """The sticking gait of lowest cost at low friction lands with its impulse on the cone, where slipping begins."""
    gait = solve(reference_problem(sequence="stick | any", intervals=20))
    assert gait.status.ok
    assert abs(gait.motion.jumps[0].ratio) == pytest.approx(0.14, rel=2e-3)
    assert gait.cost_of_transport == pytest.approx(solved(intervals=20).cost_of_transport, abs=1e-6)
    assert gait.proposal.complementarity <= Homotopy().tolerance
    assert gait.proposal.stationarity.startswith("B: a pair is biactive")
    assert gait.proposal.sequences == ("stick | stick",)  # slip+ is impossible: the step begins sticking


def test_a_biactive_impact_is_solved_both_ways(reference_problem, monkeypatch):
    monkeypatch.setattr(
        "gaitopt.ocp.mode_search.impact_proposal.list_outcomes_near",
        lambda *impact: [Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD],
    )
    gait = solve(reference_problem(sequence=OPEN, intervals=15))
    assert gait.proposal.sequences == (
        "slip+ stick | slip+",
        "slip+ stick | stick",
    )  # in the order of cost, and only matching ones
    assert str(gait.sequence) == "slip+ stick | slip+"
    assert gait.proposal.stationarity.startswith("B: a pair is biactive")


def test_an_interrupt_ends_it_all(reference_problem):
    """Ctrl-C in a relaxed problem: no other solve begins, and what there is comes back as interrupted."""
    told = []

    def stop(step):
        told.append(step)
        if len(told) == 5:
            raise KeyboardInterrupt

    gait = solve(reference_problem(sequence=OPEN, intervals=10), observer=stop)
    assert gait.status is Status.INTERRUPTED
    assert "(interrupted)" in gait.proposal.reason
    assert [step.status for step in told if isinstance(step, HomotopyIteration)] == ["interrupted"]
    assert len(told) < 10


def test_an_interrupt_of_the_check_of_a_candidate_ends_the_solve(reference_problem, monkeypatch):
    from gaitopt.ocp.mode_search import sequence_proposal

    check, checked = sequence_proposal._check_candidate, []

    def stop(step):
        raise KeyboardInterrupt

    def interrupt(problem, guess, solver, observer):
        checked.append(problem.sequence)
        return check(problem, guess, solver, stop)

    monkeypatch.setattr(sequence_proposal, "_check_candidate", interrupt)
    gait = solve(reference_problem(sequence=OPEN, intervals=10))
    assert gait.status is Status.INTERRUPTED
    assert len(checked) == 1


def test_the_certificate_is_not_evaluated_by_the_solve(reference_problem, monkeypatch):
    calls = []
    monkeypatch.setattr(Certification, "conclude", lambda certification: calls.append(certification))
    gait = solve(reference_problem(sequence=OPEN, intervals=10))
    assert gait.proposal is not None
    assert calls == []
    assert gait.certificate is None
    assert len(calls) == 1


def test_an_infeasible_problem_ends_with_its_status(reference_problem, monkeypatch):
    monkeypatch.setattr("gaitopt.ocp.solver.RETRIES", 1)
    problem = reference_problem(sequence=OPEN, torque=0.3, intervals=10)
    gait = solve(problem, solver=Ipopt(max_iterations=40))
    assert not gait.status.ok
    assert gait.status.key in ("infeasible", "failed", "iteration_limit")
    assert not gait.sequence.is_open
    assert "the homotopy stopped at t = 1e-01 (iteration_limit) with complementarity residual" in gait.proposal.reason
    assert "is not solved" in gait.proposal.reason
    assert gait.proposal.stationarity == "unknown: the homotopy did not reach its end"
    assert gait.solver.violations


@pytest.mark.slow
@pytest.mark.parametrize("change", [{"torque": 0.3}, {"friction": 0.02, "speed": 1.2}])
def test_an_infeasible_open_problem_is_concluded_after_its_first_start(reference_problem, change):
    steps = []
    problem = reference_problem(sequence=OPEN, intervals=10, **change)
    gait = solve(problem, observer=steps.append)
    assert gait.status is Status.INFEASIBLE
    words = f"no feasible motion of any sequence that matches '{OPEN}' found near any of 2 initial guesses: "
    assert gait.solver.message.startswith(words)
    assert len([step for step in steps if isinstance(step, HomotopyIteration)]) == 1
    (conflict,) = gait.solver.conflicts
    limits = Limits(torque={"ankle": 6, "hip": 6} | {conflict.name.removeprefix("torque limit of "): math.inf})
    if "torque" in change:
        assert solve(problem.replace(limits=limits)).status is Status.SOLVED
    for sequence in CLOSED:
        assert solve(problem.replace(sequence=sequence)).status is Status.INFEASIBLE


def test_a_failed_proposal_is_concluded(reference_problem, monkeypatch):
    """The relaxed problem is feasible, since the foot may stick and slip at the same time; its proposal is not."""
    monkeypatch.setattr("gaitopt.ocp.solver.RETRIES", 0)
    failed = solve(reference_problem(sequence=CLOSED[0], torque=0.3, intervals=10))
    assert failed.status is Status.INFEASIBLE
    monkeypatch.setattr(
        "gaitopt.ocp.mode_search.sequence_proposal.solve_open_sequence", lambda *arguments, homotopy: failed
    )
    monkeypatch.setattr(
        "gaitopt.ocp.mode_search.open_infeasibility.conclude_without_pairs", lambda problem, failure, *others: failure
    )
    gait = solve(reference_problem(sequence=OPEN, torque=0.3, intervals=10))
    assert gait.status is Status.INFEASIBLE
    assert gait.solver.message.endswith(f"with the proposed sequence '{CLOSED[0]}'")
    assert gait.solver.conflicts


def test_too_few_steps_are_told(reference_problem):
    gait = solve(
        reference_problem(sequence=OPEN, intervals=10),
        homotopy=Homotopy(relaxation=FischerBurmeister(), max_steps=1),
    )
    assert "the homotopy stopped at t = 1e-01 (solved) with complementarity residual" in gait.proposal.reason


def test_a_wrong_proposal_is_unconfirmed(reference_problem, monkeypatch):
    """A closed contact sequence of higher cost than the relaxed problem, as after a failed homotopy, is no solution."""
    monkeypatch.setattr("gaitopt.ocp.mode_search.impact_proposal.list_outcomes_near", lambda *impact: [Mode.STICK])
    monkeypatch.setattr("gaitopt.ocp.solver.RETRIES", 0)
    gait = solve(reference_problem(sequence=OPEN, intervals=10))
    assert str(gait.sequence) == "slip+ stick | stick"
    assert gait.status is Status.UNCONFIRMED
    assert gait.certificate is None
    assert "has cost" in gait.proposal.reason


def test_an_open_sequence_is_refused_where_a_closed_one_is_needed(reference_problem):
    from gaitopt.ocp.bounds import structure

    problem = reference_problem(sequence=OPEN)
    with pytest.raises(SequenceError, match="A smooth NLP needs a contact sequence without"):
        structure(problem, problem.transcription)


def test_an_open_sequence_needs_a_friction_limit(reference_problem):
    with pytest.raises(InputError, match="contains 'any', which needs a finite friction"):
        reference_problem(sequence=OPEN, friction=math.inf)


def test_other_objectives_and_a_free_slope(reference_problem):
    problem = reference_problem(sequence=OPEN, objective="torque_squared", slope=(0.0, 0.005), intervals=15)
    gait = solve(problem, homotopy=Homotopy(relaxation=ExactPenalty()))
    closed = [solve(problem.replace(sequence=sequence)) for sequence in CLOSED]
    best = min((other for other in closed if other.status.ok), key=lambda other: other.solver.objective)
    assert gait.sequence == best.sequence
    assert gait.solver.objective == pytest.approx(best.solver.objective, rel=1e-6)
