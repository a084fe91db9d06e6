"""Compiled heyoka integrators of one contact state of a planar robot under one torque.

Accelerations and forces solve a linear system K z = r, by elimination in the order of the unknowns without pivoting:
the mass matrix comes first, and the remaining matrix is regular where sliding is well posed.
"""

import functools
from typing import Any, NamedTuple

import casadi as ca

from gaitopt.locks import one_at_a_time
from gaitopt.model.planar.phase_system import PhaseSystem
from gaitopt.simulation.taylor.compiled_programs import Program, VariationalProgram
from gaitopt.simulation.taylor.expression_conversion import can_follow, convert, heyoka_module
from gaitopt.simulation.taylor.partial_evaluation import split_expression


class PhaseFlow(NamedTuple):
    """Explicit equations of a contact state under a torque; y is (q, v, latched values).

    Attributes
    ----------
    rates : (t, y, p, data) -> rates of (q, v, latched) and of the works
    guards : (t, y, p, data) -> guards
    n_q, n_l : int
        Numbers of coordinates and of latched values.
    """

    rates: ca.Function
    guards: ca.Function
    n_q: int
    n_l: int


@functools.lru_cache(maxsize=128)
@one_at_a_time
def phase_flow(system: PhaseSystem, formula: ca.Function) -> PhaseFlow | None:
    """Return the explicit equations of a contact state, or None if heyoka does not support an operation.

    Parameters
    ----------
    system : PhaseSystem
    formula : Function
        (t, q, v, latched, data) -> u.
    """
    n, n_l = formula.size1_in(1), formula.size1_in(3)
    t, y, data = ca.SX.sym("t"), ca.SX.sym("y", 2 * n + n_l), ca.SX.sym("data", formula.size1_in(4))
    p, q, v = ca.SX.sym("p", system.system.size1_in(3)), y[:n], y[n : 2 * n]
    u = formula(t, q, v, y[2 * n :], data)
    z = eliminate(*system.system(q, v, u, p))
    guards, powers, _ = system.outputs(q, v, u, z, p)
    rates = ca.vertcat(v, z[:n], ca.SX.zeros(n_l), powers)
    inputs = [t, y, p, data]
    flow = ca.Function("rates", inputs, ca.cse([ca.densify(rates)]))
    if not can_follow(flow):
        return None
    return PhaseFlow(flow, ca.Function("guards", inputs, ca.cse([ca.densify(guards)])), n, n_l)


def eliminate(matrix: ca.SX, right: ca.SX) -> ca.SX:
    """Return the solution of a linear system by elimination without pivoting; zero entries cost nothing.

    Examples
    --------
    >>> eliminate(ca.SX([[2, 1], [1, 0]]), ca.SX([4, 1]))
    SX([1, 2])
    """
    n = matrix.shape[0]
    rows = [[matrix[i, j] for j in range(n)] + [right[i]] for i in range(n)]
    for k, pivot in enumerate(rows):
        for row in rows[k + 1 :]:
            if not row[k].is_zero():
                factor = row[k] / pivot[k]
                for j in range(k + 1, n + 1):
                    if not pivot[j].is_zero():
                        row[j] = row[j] - factor * pivot[j]
    solution: list[ca.SX] = [ca.SX(0)] * n
    for k in reversed(range(n)):
        known = sum((rows[k][j] * solution[j] for j in range(k + 1, n) if not rows[k][j].is_zero()), ca.SX(0))
        solution[k] = (rows[k][n] - known) / rows[k][k]
    return ca.vertcat(*solution)


@functools.lru_cache(maxsize=128)
@one_at_a_time
def planar_program(flow: PhaseFlow, tolerance: float, thread: int) -> Program:
    """Return the integrator of (q, v) and, as last states, of the works, without events."""
    heyoka, moving = heyoka_module(), range(2 * flow.n_q)
    t, y, p, data = flow.rates.sx_in()
    rates = flow.rates(t, y, p, data)
    rates = ca.vertcat(rates[: 2 * flow.n_q], rates[2 * flow.n_q + flow.n_l :])
    split = split_expression(ca.Function("flow", [t, y, p, data], [rates]), moving)
    states = heyoka.make_vars(*[f"y{i}" for i in range(rates.numel())])
    (expressions,) = convert(split.body, [[heyoka.time], states[: len(moving)], _numbers(split.body)])
    system = list(zip(states, expressions, strict=True))
    return Program(split, moving, heyoka.taylor_adaptive(system, tol=tolerance, compact_mode=True))


@functools.lru_cache(maxsize=128)
@one_at_a_time
def planar_variations(flow: PhaseFlow, tolerance: float, thread: int) -> VariationalProgram:
    """Return the integrator of (q, v, latched) and its derivatives with respect to the initial values, row by row."""
    heyoka, size = heyoka_module(), 2 * flow.n_q + flow.n_l
    t, y, p, data = flow.rates.sx_in()
    rates = ca.Function("flow", [t, y, p, data], [flow.rates(t, y, p, data)[:size]])
    split = split_expression(rates, range(size))
    states = heyoka.make_vars(*[f"y{i}" for i in range(size)])
    (expressions,) = convert(split.body, [[heyoka.time], states, _numbers(split.body)])
    system = heyoka.var_ode_sys(list(zip(states, expressions, strict=True)), states, order=1)
    program = Program(split, range(size), heyoka.taylor_adaptive(system, tol=tolerance, compact_mode=True))
    return VariationalProgram(program, flow.n_q, size)


def _numbers(body: ca.Function) -> list[Any]:
    heyoka = heyoka_module()
    return [heyoka.par[i] for i in range(body.numel_in(2))]
