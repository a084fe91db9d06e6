"""Relaxations of complementarity pairs, on pairs small enough to know the answer of."""

import casadi as ca
import numpy as np
import pytest

from gaitopt import Homotopy, InputError
from gaitopt.ocp import ExactPenalty, FischerBurmeister, Scholtes
from gaitopt.ocp.mode_search.complementarity_residual import complementarity_residual
from gaitopt.ocp.mode_search.homotopy import follow_homotopy
from gaitopt.ocp.nlp.block import Block
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.keys import TOUCHDOWN, Group
from gaitopt.ocp.nlp.layout import Rows
from gaitopt.ocp.nlp.nlp import assemble_nlp
from gaitopt.ocp.transcription.relaxation import Pair, relax

RELAXATIONS = (Scholtes(), FischerBurmeister(), ExactPenalty())


class Small:
    """The NLP  min (x - a)^2 + (y - b)^2  with  0 <= x _|_ y >= 0, as a homotopy solves it."""

    def __init__(self, relaxation, target):
        x, t = ca.SX.sym("x", 2), ca.SX.sym("t")
        table, values, penalty = relax(relaxation, [Pair("y beside x", x[0], x[1])], t, 1.0)
        rows = Rows()
        index = rows.add(Group.TOUCHDOWN, table, [TOUCHDOWN])
        block = Block(
            name="small",
            variables=x,
            cost=ca.sumsqr(x - ca.DM(target)),
            penalty=penalty,
            constraints=values,
            columns=np.array([[0], [1]]),
            rows=index,
        )
        self.nlp = assemble_nlp([block], t, 2, rows.layout.size)
        self.limits = Bounds(np.zeros(2), np.full(2, np.inf), *rows.bounds())


def solved(relaxation, target, **options):
    small = Small(relaxation, target)

    def worst(x):
        return max(abs(x[0] * x[1]), -x[0], -x[1])

    homotopy = Homotopy(relaxation=relaxation, **options)
    return follow_homotopy(
        homotopy, small, np.array([0.7, 0.6]), np.empty(0), small.limits, worst, Ipopt(), lambda step: None
    )


@pytest.mark.parametrize("relaxation", RELAXATIONS)
@pytest.mark.parametrize(("target", "answer"), [((2, 1), (2, 0)), ((1, 2), (0, 2)), ((3, -1), (3, 0))])
def test_the_better_branch_is_found(relaxation, target, answer):
    trail = solved(relaxation, target)
    assert trail.ended
    assert trail.outcome.x == pytest.approx(answer, abs=1e-5)
    # Without what a penalty adds, the objective is the distance to the target.
    assert trail.steps[-1].objective == pytest.approx(np.sum((np.array(answer) - target) ** 2), abs=1e-4)


@pytest.mark.parametrize("relaxation", RELAXATIONS)
def test_a_biactive_pair_is_reached(relaxation):
    """Where both sides vanish at the optimum, no smooth NLP has a regular solution; relaxed ones do."""
    trail = solved(relaxation, (-1, -2))
    assert trail.ended
    assert trail.outcome.x == pytest.approx((0, 0), abs=2e-3)


@pytest.mark.parametrize("relaxation", RELAXATIONS)
def test_the_residual_falls_to_its_tolerance_and_the_parameter_with_it(relaxation):
    trail = solved(relaxation, (2, 1), first=1.0, factor=0.1, tolerance=1e-7, max_steps=20)
    parameters = [step.relaxation for step in trail.steps]
    assert parameters == pytest.approx([0.1**i for i in range(len(parameters))])
    assert trail.steps[-1].complementarity <= 1e-7 < trail.steps[0].complementarity
    assert [step.number for step in trail.steps] == list(range(1, len(parameters) + 1))


def test_a_homotopy_that_runs_out_of_steps_says_so():
    trail = solved(FischerBurmeister(), (2, 1), max_steps=2)
    assert not trail.ended
    assert len(trail.steps) == 2


@pytest.mark.parametrize("relaxation", [Scholtes(), FischerBurmeister()])
@pytest.mark.parametrize("t", [1e-1, 1e-4])
def test_the_relaxed_set(relaxation, t):
    """Fischer and Burmeister's function vanishes exactly where x y = t; Scholtes' row is x y - t."""
    x, y, parameter = ca.SX.sym("x"), ca.SX.sym("y"), ca.SX.sym("t")
    rows, value = relaxation.rows(Pair("", x, y), parameter)
    value = ca.Function("value", [x, y, parameter], [value])
    assert float(value(0.5, t / 0.5, t)) == pytest.approx(0, abs=1e-15)
    assert float(value(0.5, 2 * t / 0.5, t)) > 0 > float(value(0.5, 0.5 * t / 0.5, t))
    assert len(rows) == 1


def test_the_residual_is_physical():
    assert complementarity_residual(-0.1, 1.0, 0.4, 0.1) == 0  # slips forward, impulse on the backward edge of the cone
    assert complementarity_residual(0.05, 1.0, 0.0, 0.1) == 0  # sticks within the cone
    assert complementarity_residual(-0.09, 1.0, 0.4, 0.1) == pytest.approx(0.4 * 0.01)  # slips inside the cone
    assert complementarity_residual(0.1, 1.0, 0.4, 0.1) == pytest.approx(0.1 * 0.8)  # slips along its impulse
    assert complementarity_residual(0.13, 1.0, 0.0, 0.1) == pytest.approx(0.03)  # sticks outside the cone
    assert complementarity_residual(0.0, -0.2, 0.0, 0.1) == pytest.approx(0.2)  # is pulled
    assert np.isnan(complementarity_residual(np.nan, 1.0, 0.0, 0.1))
    many = complementarity_residual(np.array([-0.1, 0.13]), np.array([1.0, 1.0]), np.array([0.4, 0.0]), 0.1)
    assert many == pytest.approx(0.03)


@pytest.mark.parametrize(
    "options",
    [{"relaxation": "scholtes"}, {"first": 0}, {"factor": 1.0}, {"tolerance": -1}, {"max_steps": 0}, {"intervals": 3}],
)
def test_options_that_cannot_be(options):
    with pytest.raises(InputError, match=f"Homotopy.{next(iter(options))}"):
        Homotopy(**options)
