"""A relaxation from outside the package, in one file, with an additional unknown for each complementarity pair."""

from dataclasses import dataclass

import numpy as np
import pytest

from gaitopt import Homotopy, Limits, solve, verify
from gaitopt.ocp import Relaxation
from gaitopt.ocp.bounds import bounds, structure
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.nlp.keys import Kind, Unknown
from gaitopt.ocp.statement.initial_guess import LinearGuess
from gaitopt.ocp.transcription.relaxation import Slack
from gaitopt.ocp.transcription.transcription import transcribe


@dataclass(frozen=True)
class Elastic(Relaxation):
    """x y <= s with a slack s >= 0 that is penalised by s / t (elastic mode; M. Anitescu, SIAM J. Optim. 15, 2005)."""

    name = "elastic"
    slacks = (Slack("elastic slack", lower=0.0, start=0.01),)

    def rows(self, pair, t):
        return [("elastic product", -np.inf, 0.0)], pair.left * pair.right - pair.slacks[0]

    def penalty(self, pair, t):
        return pair.slacks[0] / t


@pytest.mark.parametrize(
    ("sequence", "closed", "tables"),
    [
        ("slip+ stick | any", "slip+ stick | slip+", {Unknown.RELAXATION: (3, 1)}),
        ("any | any", "slip+ stick | slip+", {Unknown.RELAXATION: (3, 1), (Unknown.RELAXATION, 0): (3, 15)}),
    ],
)
def test_its_unknowns_are_bounded_and_started(reference_problem, sequence, closed, tables):
    problem = reference_problem(sequence=sequence, intervals=15)
    transcription = transcribe(structure(problem, problem.transcription, Elastic()))
    layout, limits = transcription.variables, bounds(transcription, problem)
    for table, shape in tables.items():
        assert layout[table].shape == shape
    slacks = layout.find(Kind.SLACK)
    assert slacks.size == sum(np.prod(shape) for shape in tables.values())
    assert np.all(limits.x_lower[slacks] == 0.0)
    assert np.all(np.isinf(limits.x_upper[slacks]))
    assert np.all(initial_point(transcription, problem, LinearGuess())[slacks] == 0.01)


@pytest.mark.parametrize(
    ("sequence", "objective"), [("slip+ stick | any", "cost_of_transport"), ("any | any", "torque_squared")]
)
def test_it_closes_open_contact_sequences(reference_problem, sequence, objective):
    problem = reference_problem(sequence=sequence, objective=objective, intervals=15, limits=Limits(torque=6))
    gait = verify(solve(problem, homotopy=Homotopy(relaxation=Elastic())))
    assert gait.status.ok, gait.proposal
    assert gait.verification.passed
    assert gait.proposal.relaxation == "elastic"
    assert gait.proposal.complementarity <= Homotopy().tolerance
    usual = solve(problem)
    assert gait.solver.objective <= usual.solver.objective * (1 + 1e-4)


def test_the_objective_is_reported_without_the_penalty(reference_problem):
    """The relaxed solution costs about what the closed one does, however large 1 / t is."""
    gait = solve(reference_problem(sequence="slip+ stick | any", intervals=15), homotopy=Homotopy(relaxation=Elastic()))
    assert gait.proposal.cost_before == pytest.approx(gait.proposal.cost_after, rel=1e-3)
