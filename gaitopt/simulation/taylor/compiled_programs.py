"""Compiled heyoka integrators of one contact mode of a robot under one form of law, in three variants.

Parameters and the law's data are inputs of the compiled code, so it is compiled once per process; heyoka caches it on
disk for later processes.  An integrator contains the state it integrates, so each thread has a separate one.
"""

import functools
from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from gaitopt.locks import one_at_a_time
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.closed_loop import ModeEquations, mode_equations
from gaitopt.simulation.taylor.expression_conversion import convert, heyoka_module
from gaitopt.simulation.taylor.partial_evaluation import SplitExpression, split_expression
from gaitopt.simulation.taylor.trigonometric_form import to_trigonometric_form


class Program:
    """A compiled integrator, for one thread.

    Parameters
    ----------
    split : SplitExpression
        Expressions that were compiled.
    entries : sequence of int
        Entries of y that are integrated.
    integrator : heyoka.taylor_adaptive

    Attributes
    ----------
    entries : (n,) array of int
    state, numbers : arrays
        Views of the integrator's state and parameters.
    depends_on_state : bool
        Whether the integrator's parameters depend on constant entries of y.
    """

    def __init__(self, split: SplitExpression, entries: Sequence[int], integrator: Any) -> None:
        self.entries, self.integrator = np.array(entries), integrator
        self.state, self.numbers = integrator.state, integrator.pars
        self.depends_on_state = split.numbers.jac_sparsity(0, 2).nnz() > 0
        self._values = FastCall(split.numbers)

    def parameters(self, p: Array, data: Array, y: Array) -> Array:
        """Return the integrator's parameters for a parameter vector, a law's data and the constant entries of y."""
        parameters = np.zeros(self.numbers.size)
        values = self._values(p, data, y)[0][: parameters.size]
        parameters[: values.size] = values
        return parameters


class VariationalProgram:
    """A compiled integrator of the motion and its derivatives with respect to the initial state, for one thread.

    Parameters
    ----------
    program : Program
        Integrates some entries of y and, row by row, their derivatives with respect to the initial values of the same
        entries.
    n_q, size : int
        Numbers of coordinates and of entries of y.
    """

    def __init__(self, program: Program, n_q: int, size: int) -> None:
        self._program, entries = program, program.entries
        self._moving, self._within = program.state[: entries.size], np.ix_(entries, entries)
        self._slopes, self._identity = program.state[entries.size :].reshape(2 * (entries.size,)), np.eye(entries.size)
        self._frame, self._constant = np.eye(size), np.setdiff1d(np.arange(n_q), entries)
        self._frame[entries] = 0
        self._rates = self._constant + n_q

    def begin(self, y: Array) -> None:
        """Start at a state with the identity as derivative."""
        self._moving[:], self._slopes[:] = y[self._program.entries], self._identity

    def apply(self, jump: Array) -> None:
        """Apply the jump of a deviation, (n_y, n_y)."""
        self._slopes[:] = jump[self._within] @ self._slopes

    def propagate(self, p: Array, data: Array, y: Array, span: tuple[float, float]) -> None:
        """Integrate between two clock times with a parameter vector, a law's data and the constant entries of y."""
        program = self._program
        program.numbers[:] = program.parameters(p, data, y)
        program.integrator.time = span[0]
        program.integrator.propagate_until(span[1])

    def matrix(self, duration: float) -> Array:
        """Return the derivative of y with respect to its initial value, (n_y, n_y), after some time.

        Constant entries drift at their rate, which is zero along the path but not for varied initial states.
        """
        matrix = self._frame.copy()
        matrix[self._constant, self._rates] = duration
        matrix[self._within] = self._slopes
        return matrix


@functools.lru_cache(maxsize=128)
@one_at_a_time
def program_with_events(
    robot: Robot, mode: Mode, control: ca.Function, tolerance: float, compact_mode: bool, thread: int
) -> Program:
    """Return the integrator with guards as terminal events; its last parameters are added to the guards."""
    equations, heyoka = mode_equations(to_trigonometric_form(robot), mode, control), heyoka_module()
    split, states, (rates, guards) = _translate(equations, equations.active, ("guards",))
    count = split.body.numel_in(2)
    events = [
        heyoka.t_event(guard + heyoka.par[count + i], direction=heyoka.event_direction.negative)
        for i, guard in enumerate(guards)
    ]
    options = {"tol": tolerance, "compact_mode": compact_mode, "t_events": events}
    return Program(split, equations.active, heyoka.taylor_adaptive(list(zip(states, rates, strict=True)), **options))


@functools.lru_cache(maxsize=128)
@one_at_a_time
def program_with_outputs(robot: Robot, mode: Mode, control: ca.Function, tolerance: float, thread: int) -> Program:
    """Return the integrator of the motion and, as last states, of its energies, without events."""
    equations, heyoka = mode_equations(to_trigonometric_form(robot), mode, control), heyoka_module()
    split, states, (rates, powers) = _translate(equations, equations.active, ("energy",))
    energies = heyoka.make_vars(*[f"energy{i}" for i in range(len(powers))])
    system = list(zip(states, rates, strict=True)) + list(zip(_list_expressions(energies), powers, strict=True))
    return Program(split, equations.active, heyoka.taylor_adaptive(system, tol=tolerance, compact_mode=True))


@functools.lru_cache(maxsize=128)
@one_at_a_time
def program_with_variations(
    robot: Robot, mode: Mode, control: ca.Function, tolerance: float, thread: int
) -> VariationalProgram:
    """Return the integrator of the motion and its derivatives with respect to the initial state, row by row."""
    equations, heyoka = mode_equations(to_trigonometric_form(robot), mode, control), heyoka_module()
    entries = _list_influential_entries(equations)
    split, states, (rates,) = _translate(equations, entries, ())
    system = heyoka.var_ode_sys(list(zip(states, rates, strict=True)), states, order=1)
    program = Program(split, entries, heyoka.taylor_adaptive(system, tol=tolerance, compact_mode=True))
    return VariationalProgram(program, robot.n_q, equations.size)


def _translate(
    equations: ModeEquations, entries: Sequence[int], others: Sequence[str]
) -> tuple[SplitExpression, list[Any], list[Any]]:
    """Return the split rates of some entries and other Functions of a mode, the heyoka states and the outputs."""
    heyoka, inputs = heyoka_module(), equations.flow.sx_in()
    outputs = [equations.flow(*inputs)[list(entries)], *[getattr(equations, name).call(inputs)[0] for name in others]]
    split = split_expression(ca.Function(equations.mode.name.lower(), inputs, ca.cse(outputs)), entries)
    states = _list_expressions(heyoka.make_vars(*[f"y{i}" for i in entries]))
    numbers = [heyoka.par[i] for i in range(split.body.numel_in(2))]
    return split, states, convert(split.body, [[heyoka.time], states, numbers])


def _list_influential_entries(equations: ModeEquations) -> list[int]:
    """Return the active entries of y and the constant entries on which they depend."""
    dependence = list(zip(*equations.flow.jac_sparsity(0, 1).get_triplet(), strict=True))
    entries = set(equations.active)
    while more := {j for i, j in dependence if i in entries} - entries:
        entries |= more
    return sorted(entries)


def _list_expressions(variables: Any) -> list[Any]:
    """Return the result of ``make_vars`` as a list; for a single name it is a single variable."""
    return variables if isinstance(variables, list) else [variables]
