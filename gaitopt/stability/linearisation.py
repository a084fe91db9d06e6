"""Exact derivative of a step: variational flow between events, saltation matrices at events and at the impact.

If a guard g falls through zero at (t, y) and the flow f changes to f' after a reset R(t, y),

    dy+ = DR (dy + f dt) + R_t dt - f' dt,    dt = -(grad g . dy) / (grad g . f + g_t).

The step ends on the section, where the clock is reset: dy+ = DR (dy + f dt).
"""

import functools
import itertools
from dataclasses import dataclass

import casadi as ca
import numpy as np

from gaitopt.errors import InputError
from gaitopt.model.contacts.event import TOUCHDOWN, EventKind, HybridEvent
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.touchdown import Touchdown
from gaitopt.model.contacts.transition import saltation
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.engine import Arc
from gaitopt.simulation.hybrid_automaton import Stride, Walker

JUMP_THRESHOLD = 1e-7
"""A guard further below zero than this (N, m/s, rad) at its event was crossed by a jump of the law's torque."""


@dataclass(frozen=True, eq=False)
class _Slopes:
    """Flow and guard gradients of a mode as numerical functions."""

    flow: FastCall
    guards: FastCall


class Linearisation:
    """Derivatives of a walker's steps.

    Parameters
    ----------
    walker : Walker

    Raises
    ------
    InputError
        If the walker is not a Walker, for example one with delayed readings.
    """

    def __init__(self, walker: Walker) -> None:
        if not isinstance(walker, Walker):
            raise InputError(
                f"Steps of a {type(walker).__name__} have no derivative: their state contains more than (q, v). "
                "Use a Walker."
            )
        self.walker = walker
        self._cached_slopes: dict[Mode, _Slopes] = {}
        self._resets: dict[Mode, FastCall] = {}

    def derivative(self, state: Array, stride: Stride, *, impact: Mode | None = None) -> Array:
        """Return d (state after the step) / d (state before it), shape (2 n_q, 2 n_q).

        Parameters
        ----------
        state : (2 n_q,) array
            State at the start of the step.
        stride : Stride
            Step from this state, ended by a touchdown.
        impact : Mode, optional
            Outcome of the impact instead of the simulated one, for one-sided derivatives on the boundary between two.
        """
        return self._propagate(stride, self.walker.memory.slope_at_start(state), impact)

    def latched_effect(self, state: Array, stride: Stride) -> Array:
        """Return d (state after the step) / d (values latched at its start), shape (2 n_q, n_l)."""
        latched = self.walker.loop.size - state.size
        return self._propagate(stride, np.eye(state.size + latched, latched, -state.size), None)

    def saltations(self, stride: Stride, *, impact: Mode | None = None) -> list[Array]:
        """Return the jump of a deviation at each event of a step, (n_y, n_y), and at the touchdown, (2 n_q, n_y).

        Events of the contact and of the law are in the order of ``stride.arcs``.
        """
        matrices = []
        for (mode, arc), (following, _) in itertools.pairwise(stride.arcs):
            matrices.append(self._event(mode, following, arc))
        outcome = impact or (stride.impact.mode if stride.impact else None)
        if outcome is None:
            raise InputError("A step has a derivative only if it ends in a touchdown; this one does not.")
        mode, arc = stride.arcs[-1]
        return [*matrices, self._touchdown(mode, outcome, float(arc.time[-1]), arc.states[:, -1])]

    def _propagate(self, stride: Stride, matrix: Array, impact: Mode | None) -> Array:
        """Propagate deviations, the columns of a matrix of shape (n_y, k), over a step."""
        walker, clock = self.walker, 0.0
        for (mode, arc), jump in zip(stride.arcs, self.saltations(stride, impact=impact), strict=True):
            until, start = float(arc.time[-1]), arc.states[:, 0]
            if until > clock:
                flow = walker.engine.sensitivity(walker.loop, mode, clock, start, until=until)
                matrix = flow @ matrix
            matrix, clock = jump @ matrix, until
        return matrix

    def _event(self, mode: Mode, following: Mode, arc: Arc) -> Array:
        """Return the jump of a deviation at an event that ends an arc, (n_y, n_y)."""
        loop, event = self.walker.loop, arc.event
        if event is None:
            raise ValueError("an arc that ended at the time limit has no saltation")
        clock, state = float(arc.time[-1]), arc.states[:, -1]
        if event.kind is EventKind.LAW_EVENT:
            reset, drift = self.walker.memory.slopes(event.number, clock, state)
            next_state = self.walker.memory.apply_event(event.number, clock, state)
        else:
            robot, drift = self.walker.robot, np.zeros(state.size)
            reset = robot.contact_model.at(mode, event).reset(robot.state_entries.slip_velocity, state.size)
            next_state = reset @ state
        before, shift = self._time_shift(mode, event, clock, state)
        after = self._slopes(following).flow(clock, next_state, loop.data(clock, next_state))[0]
        return saltation(reset, before, after - drift, shift)

    def _touchdown(self, mode: Mode, outcome: Mode, clock: float, state: Array) -> Array:
        n = self.walker.robot.n_q
        before, shift = self._time_shift(mode, TOUCHDOWN, clock, state)
        if outcome not in self._resets:
            self._resets[outcome] = FastCall(reset_slope(self.walker.robot, outcome), self.walker.p)
        reset = self._resets[outcome](state[:n], state[n : 2 * n])[0].reshape(2 * n, 2 * n).T
        # The clock is reset at touchdown, so the flow after the touchdown does not enter.
        return reset @ saltation(np.eye(2 * n, state.size), before, np.zeros(2 * n), shift)

    def _time_shift(self, mode: Mode, event: HybridEvent, clock: float, state: Array) -> tuple[Array, Array]:
        """Return the flow before an event, and d (event time) / d y, each of shape (n_y,).

        A guard far below zero was crossed by a jump of the torque at a change of the law's piece.
        """
        loop, slopes = self.walker.loop, self._slopes(mode)
        data = loop.data(clock, state)
        before = slopes.flow(clock, state, data)[0].copy()
        values, gradient, drift = slopes.guards(clock, state, data)
        events = loop.equations(mode).events
        which = events.index(event)
        if values[which] < -JUMP_THRESHOLD:
            return before, loop.piece_shift(before)
        row = gradient.reshape(state.size, len(events))[:, which]
        return before, -row / (row @ before + drift[which])

    def _slopes(self, mode: Mode) -> _Slopes:
        if mode not in self._cached_slopes:
            p, equations = self.walker.p, self.walker.loop.equations(mode)
            flow = _move_parameters_last(equations.flow)
            self._cached_slopes[mode] = _Slopes(FastCall(flow, p), FastCall(_guard_slopes(equations.guards), p))
        return self._cached_slopes[mode]


@functools.lru_cache(maxsize=128)
def _move_parameters_last(function: ca.Function) -> ca.Function:
    """Return the first output as a Function of (t, y, data, p), with the constant input last."""
    t, y, p, data = function.sx_in()
    return ca.Function("flow", [t, y, data, p], [function(t, y, p, data)])


@functools.lru_cache(maxsize=128)
def _guard_slopes(function: ca.Function) -> ca.Function:
    """Return (t, y, data, p) -> guards (n), their gradients (n, n_y) and their rates at constant y (n)."""
    t, y, p, data = function.sx_in()
    guards = function(t, y, p, data)[0]
    outputs = [guards, ca.densify(ca.jacobian(guards, y)), ca.densify(ca.jacobian(guards, t))]
    return ca.Function("guard_slopes", [t, y, data, p], outputs)


@functools.lru_cache(maxsize=64)
def reset_slope(robot: Robot, outcome: Mode) -> ca.Function:
    """Return (q, v, p) -> Jacobian of the touchdown map y -> y+ for a given outcome, shape (2 n_q, 2 n_q)."""
    n = robot.n_q
    y, p = ca.SX.sym("y", 2 * n), ca.SX.sym("p", len(robot.parameters))
    q, v = ca.SX.sym("q", n), ca.SX.sym("v", n)
    following = Touchdown(robot).reset(outcome, y[:n], y[n:], p)
    jacobian = ca.Function("jacobian", [y, p], [ca.densify(ca.jacobian(following, y))])
    return ca.Function("reset_slope", [q, v, p], [jacobian(ca.vertcat(q, v), p)])
