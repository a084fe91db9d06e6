"""The largest perturbation of the Hessian in solves that start near a solution."""

from types import SimpleNamespace

import casadi as ca
import pytest

from gaitopt import Ipopt, Status
from gaitopt.ocp import solve_planar
from gaitopt.ocp.multicontact.planar_solver import PERTURBATION_NEARBY
from gaitopt.ocp.nlp.ipopt import LARGEST_PERTURBATION
from tests.ocp.multicontact_examples import hop


@pytest.mark.parametrize("largest", [None, 1e4])
def test_the_perturbation_of_the_hessian_is_limited(largest):
    """The Hessian of this objective is -2e6."""
    x = ca.MX.sym("x")
    solver = Ipopt() if largest is None else Ipopt().limit_perturbation(largest)
    options = solver._options(SimpleNamespace(typical=1.0, dissect=False, independent=False, n_variables=1), None)
    minimise = ca.nlpsol("minimise", "ipopt", {"x": x, "f": -1e6 * x**2}, {**options, "print_time": False})
    minimise(x0=1e-6, lbx=-1, ubx=1)
    perturbations = minimise.stats()["iterations"]["regularization_size"]
    assert max(perturbations) > 1e6 if largest is None else max(perturbations) <= largest


def test_solves_near_a_solution_limit_the_perturbation(monkeypatch):
    limits, minimise = [], Ipopt.minimise

    def record(solver, *arguments):
        limits.append((arguments[5] is not None, solver._perturbation))
        return minimise(solver, *arguments)

    monkeypatch.setattr(Ipopt, "minimise", record)
    assert solve_planar(hop()).status is Status.SOLVED
    assert limits[0] == (False, LARGEST_PERTURBATION)
    assert set(limits[1:]) == {(True, PERTURBATION_NEARBY)}
