"""Exact derivative of a step: variational flow between events, saltation matrices at events and at the impact.

If a guard g falls through zero at (t, y) and the flow f changes to f' after a reset R(t, y),

    dy+ = DR (dy + f dt) + R_t dt - f' dt,    dt = -(grad g . dy) / (grad g . f + g_t).

The step ends on the section, where the clock is reset: dy+ = DR (dy + f dt).
"""

import functools
import itertools

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
from gaitopt.simulation.closed_loop import ClosedLoop
from gaitopt.simulation.engine import Arc
from gaitopt.simulation.hybrid_automaton import Walker, WalkStep

JUMP_THRESHOLD = 1e-7
"""A guard further below zero than this (N, m/s, rad) at its event was crossed by a jump of the law's torque."""


class _ModeSlopes:
    """Flow, guards and guard gradients of a contact mode of a closed loop at a clock time in a state."""

    def __init__(self, loop: ClosedLoop, mode: Mode) -> None:
        equations, self._loop = loop.equations(mode), loop
        self._places, count = {event: i for i, event in enumerate(equations.events)}, len(equations.events)
        self._memory = np.zeros(1 + loop.size + loop.law.table.shape[0])
        self._flow = FastCall(_move_parameters_last(equations.flow), loop.p, shared=self._memory)
        self._slopes = FastCall(_slopes_at_event(equations.flow, equations.guards), loop.p, shared=self._memory)
        ends = np.cumsum([loop.size, count, count * loop.size]).tolist()
        self._guards, self._rates = slice(ends[0], ends[1]), slice(ends[2], None)
        self._gradients = slice(ends[1], ends[2])

    def flow(self, clock: float, y: Array) -> Array:
        """Return dy/dt, shape (n_y,)."""
        self._fill(clock, y)
        return self._flow.evaluate()

    def time_shift(self, event: HybridEvent, clock: float, y: Array) -> tuple[Array, Array]:
        """Return the flow before an event that ends the mode, and d (event time) / d y, each of shape (n_y,).

        A guard far below zero was crossed by a jump of the torque at a change of the law's piece.
        """
        self._fill(clock, y)
        values, place, size = self._slopes.evaluate(), self._places[event], self._loop.size
        before = values[:size].copy()
        if values[self._guards][place] < -JUMP_THRESHOLD:
            return before, self._loop.piece_shift(before)
        row = values[self._gradients].reshape(size, -1)[:, place]  # CasADi stores by column
        return before, -row / (row @ before + values[self._rates][place])

    def _fill(self, clock: float, y: Array) -> None:
        memory, size = self._memory, self._loop.size
        memory[0], memory[1 : 1 + size], memory[1 + size :] = clock, y, self._loop.data(clock, y)


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
        self._slopes_in: dict[Mode, _ModeSlopes] = {}
        self._landings: dict[Mode, FastCall] = {}
        self._resets: dict[tuple[Mode, HybridEvent], Array] = {}

    def derivative(self, state: Array, walk_step: WalkStep, *, impact: Mode | None = None) -> Array:
        """Return d (state after the step) / d (state before it), shape (2 n_q, 2 n_q).

        Parameters
        ----------
        state : (2 n_q,) array
            State at the start of the step.
        walk_step : WalkStep
            Step from this state, ended by a touchdown.
        impact : Mode, optional
            Outcome of the impact instead of the simulated one, for one-sided derivatives on the boundary between two.
        """
        return self._propagate(walk_step, self.walker.memory.slope_at_start(state), impact)

    def latched_effect(self, state: Array, walk_step: WalkStep) -> Array:
        """Return d (state after the step) / d (values latched at its start), shape (2 n_q, n_l)."""
        latched = self.walker.loop.size - state.size
        return self._propagate(walk_step, np.eye(state.size + latched, latched, -state.size), None)

    def saltations(self, walk_step: WalkStep, *, impact: Mode | None = None) -> list[Array]:
        """Return the jump of a deviation at each event of a step, (n_y, n_y), and at the touchdown, (2 n_q, n_y).

        Events of the contact and of the law are in the order of ``walk_step.arcs``.
        """
        matrices = []
        for (mode, arc), (following, _) in itertools.pairwise(walk_step.arcs):
            matrices.append(self._event(mode, following, arc))
        outcome = impact or (walk_step.impact.mode if walk_step.impact else None)
        if outcome is None:
            raise InputError("A step has a derivative only if it ends in a touchdown; this one does not.")
        mode, arc = walk_step.arcs[-1]
        return [*matrices, self._touchdown(mode, outcome, arc.time.item(-1), arc.states[:, -1])]

    def _propagate(self, walk_step: WalkStep, matrix: Array, impact: Mode | None) -> Array:
        """Propagate deviations, the columns of a matrix of shape (n_y, k), over a step."""
        walker, clock = self.walker, 0.0
        for (mode, arc), jump in zip(walk_step.arcs, self.saltations(walk_step, impact=impact), strict=True):
            until, start = arc.time.item(-1), arc.states[:, 0]
            if until > clock:
                flow = walker.engine.sensitivity(walker.loop, mode, clock, start, until=until)
                matrix = flow @ matrix
            matrix, clock = jump @ matrix, until
        return matrix

    def _event(self, mode: Mode, following: Mode, arc: Arc) -> Array:
        """Return the jump of a deviation at an event that ends an arc, (n_y, n_y)."""
        event = arc.event
        if event is None:
            raise ValueError("an arc that ended at the time limit has no saltation")
        clock, state = arc.time.item(-1), arc.states[:, -1]
        before, shift = self._slopes(mode).time_shift(event, clock, state)
        if event.kind is EventKind.LAW_EVENT:
            reset, drift = self.walker.memory.slopes(event.number, clock, state)
            next_state = self.walker.memory.apply_event(event.number, clock, state)
            return saltation(reset, before, self._slopes(following).flow(clock, next_state) - drift, shift)
        reset = self._reset(mode, event, state.size)
        return saltation(reset, before, self._slopes(following).flow(clock, reset @ state), shift)

    def _reset(self, mode: Mode, event: HybridEvent, size: int) -> Array:
        """Return the derivative of the reset at a transition of the contact, (n_y, n_y)."""
        if (mode, event) not in self._resets:
            robot = self.walker.robot
            transition = robot.contact_model.at(mode, event)
            self._resets[mode, event] = transition.reset(robot.state_entries.slip_velocity, size)
        return self._resets[mode, event]

    def _touchdown(self, mode: Mode, outcome: Mode, clock: float, state: Array) -> Array:
        size = 2 * self.walker.robot.n_q
        before, shift = self._slopes(mode).time_shift(TOUCHDOWN, clock, state)
        if outcome not in self._landings:
            self._landings[outcome] = FastCall(reset_slope(self.walker.robot, outcome), self.walker.p)
        reset = np.zeros((size, state.size))
        reset[:, :size] = self._landings[outcome].evaluate_packed(state[:size]).reshape(size, size).T
        # The clock is reset at touchdown, so the flow after the touchdown does not enter.
        return saltation(reset, before, np.zeros(size), shift)

    def _slopes(self, mode: Mode) -> _ModeSlopes:
        if mode not in self._slopes_in:
            self._slopes_in[mode] = _ModeSlopes(self.walker.loop, mode)
        return self._slopes_in[mode]


@functools.lru_cache(maxsize=128)
def _move_parameters_last(function: ca.Function) -> ca.Function:
    """Return the first output as a Function of (t, y, data, p), with the constant input last."""
    t, y, p, data = function.sx_in()
    return ca.Function("flow", [t, y, data, p], [function(t, y, p, data)])


@functools.lru_cache(maxsize=128)
def _slopes_at_event(flow: ca.Function, function: ca.Function) -> ca.Function:
    """Return (t, y, data, p) -> flow (n_y), guards (n), their gradients (n, n_y) and their rates at constant y (n)."""
    t, y, p, data = function.sx_in()
    guards = function(t, y, p, data)[0]
    slopes = [ca.densify(ca.jacobian(guards, argument)) for argument in (y, t)]
    return ca.Function("slopes_at_event", [t, y, data, p], ca.cse([flow(t, y, p, data), guards, *slopes]))


@functools.lru_cache(maxsize=64)
def reset_slope(robot: Robot, outcome: Mode) -> ca.Function:
    """Return (q, v, p) -> Jacobian of the touchdown map y -> y+ for a given outcome, shape (2 n_q, 2 n_q)."""
    n = robot.n_q
    y, p = ca.SX.sym("y", 2 * n), ca.SX.sym("p", len(robot.parameters))
    q, v = ca.SX.sym("q", n), ca.SX.sym("v", n)
    following = Touchdown(robot).reset(outcome, y[:n], y[n:], p)
    jacobian = ca.Function("jacobian", [y, p], [ca.densify(ca.jacobian(following, y))])
    return ca.Function("reset_slope", [q, v, p], [jacobian(ca.vertcat(q, v), p)])
