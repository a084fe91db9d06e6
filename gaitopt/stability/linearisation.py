"""The exact derivative of a step: variational flow between events, saltation at every event and at the impact.

Where a guard g falls through zero at (t, y) and the flow f goes over into f' after a reset R,

    dy+ = DR (dy + f dt) - f' dt,    dt = -(grad g . dy) / (grad g . f + g_t)

and the step ends on the section, whose clock starts anew: dy+ = DR (dy + f dt).
"""

import functools
import itertools
from dataclasses import dataclass

import casadi as ca
import numpy as np

from gaitopt.errors import InputError
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.closed_loop import closed_loop, piece_shift
from gaitopt.simulation.hybrid_automaton import Stride, Walker

BEYOND = 1e-7
"""A located event leaves its guard at rounding (N, m/s, rad); further below zero the mode was left by a jump."""


@dataclass(frozen=True, eq=False)
class _Slopes:
    """A mode's flow, and gradients of its guards, ready for numbers."""

    flow: FastCall
    guards: FastCall


class Linearisation:
    """Derivatives of a walker's steps.

    Parameters
    ----------
    walker : Walker
    """

    def __init__(self, walker: Walker) -> None:
        self.walker = walker
        self._known: dict[Mode, _Slopes] = {}
        self._resets: dict[Mode, FastCall] = {}

    def derivative(self, state: Array, stride: Stride, *, impact: Mode | None = None) -> Array:
        """Return d (state after the step) / d (state before it), shape (2 n_q, 2 n_q).

        Parameters
        ----------
        state : (2 n_q,) array
            Where the step began.
        stride : Stride
            The step taken from there, ended by a touchdown.
        impact : Mode, optional
            Another outcome of the impact than the one taken, for one-sided derivatives on the edge between two.
        """
        return self._carried(stride, self._beginning(state), impact)

    def effect_of_held(self, state: Array, stride: Stride) -> Array:
        """Return d (state after the step) / d (values the law holds over it), shape (2 n_q, n_h)."""
        held = self.walker.begin(state).size - state.size
        return self._carried(stride, np.eye(state.size + held, held, -state.size), None)

    def saltations(self, stride: Stride, *, impact: Mode | None = None) -> list[Array]:
        """Return the jump of a deviation at each event of a step, (n_y, n_y), and at the touchdown, (2 n_q, n_y)."""
        matrices = []
        for (mode, arc), (following, _) in itertools.pairwise(stride.arcs):
            end = arc.states[:, -1]
            matrices.append(self._change_of_mode(mode, following, str(arc.event), float(arc.time[-1]), end))
        outcome = impact or (stride.impact.mode if stride.impact else None)
        if outcome is None:
            raise InputError("A step has a derivative only if it ends in a touchdown; this one does not.")
        mode, arc = stride.arcs[-1]
        return [*matrices, self._touchdown(mode, outcome, float(arc.time[-1]), arc.states[:, -1])]

    def _carried(self, stride: Stride, matrix: Array, impact: Mode | None) -> Array:
        """Return what becomes of deviations, the columns of a matrix of shape (n_y, k), over a step."""
        walker, clock = self.walker, 0.0
        for (mode, arc), jump in zip(stride.arcs, self.saltations(stride, impact=impact), strict=True):
            until, start = float(arc.time[-1]), arc.states[:, 0]
            if until > clock:
                flow = walker.engine.sensitivity(walker.robot, walker.law, mode, clock, start, walker.p, until=until)
                matrix = flow @ matrix
            matrix, clock = jump @ matrix, until
        return matrix

    def _change_of_mode(self, mode: Mode, following: Mode, event: str, clock: float, state: Array) -> Array:
        n = self.walker.robot.n_q
        reset = np.eye(state.size)
        if event == "at rest":
            reset[n, n] = 0.0
        before, shift = self._time_shift(mode, event, clock, state)
        after = self._slopes(following).flow(clock, reset @ state, self._data(clock, state))[0]
        return reset + np.outer(reset @ before - after, shift)

    def _touchdown(self, mode: Mode, outcome: Mode, clock: float, state: Array) -> Array:
        n = self.walker.robot.n_q
        before, shift = self._time_shift(mode, "touchdown", clock, state)
        if outcome not in self._resets:
            self._resets[outcome] = FastCall(reset_slope(self.walker.robot, outcome), self.walker.p)
        reset = self._resets[outcome](state[:n], state[n : 2 * n])[0].reshape(2 * n, 2 * n).T
        return reset @ (np.eye(2 * n, state.size) + np.outer(before[: 2 * n], shift))

    def _time_shift(self, mode: Mode, event: str, clock: float, state: Array) -> tuple[Array, Array]:
        """Return the flow before an event, and d (event time) / d y, each of shape (n_y,).

        A guard found well below zero did not fall through it: the law's torque jumped there, with a piece of the law.
        """
        slopes, data = self._slopes(mode), self._data(clock, state)
        before = slopes.flow(clock, state, data)[0].copy()
        values, gradient, drift = slopes.guards(clock, state, data)
        names = closed_loop(self.walker.robot, mode, self.walker.law.torque).guard_names
        which = names.index(event)
        if values[which] < -BEYOND:
            return before, piece_shift(self.walker.law, before)
        row = gradient.reshape(state.size, len(names))[:, which]
        return before, -row / (row @ before + drift[which])

    def _beginning(self, state: Array) -> Array:
        """Return d y / d (q, v) at the start of a step, shape (n_y, 2 n_q): what the law holds depends on the state."""
        n, hold = self.walker.robot.n_q, self.walker.law.hold
        if hold is None:
            return np.eye(2 * n)
        slope = _hold_slope(hold)(state[:n], state[n:], self.walker.law.table[:, 0])
        return np.vstack([np.eye(2 * n), np.asarray(slope)])

    def _data(self, clock: float, state: Array) -> Array:
        law = self.walker.law
        return law.table[:, law.piece(law.measure(clock, state))]

    def _slopes(self, mode: Mode) -> _Slopes:
        if mode not in self._known:
            walker = self.walker
            loop = closed_loop(walker.robot, mode, walker.law.torque)
            flow = _reordered(loop.flow)
            self._known[mode] = _Slopes(FastCall(flow, walker.p), FastCall(_guard_slopes(loop.guards), walker.p))
        return self._known[mode]


@functools.lru_cache(maxsize=128)
def _hold_slope(hold: ca.Function) -> ca.Function:
    """Return (q, v, data) -> d held / d (q, v), shape (n_h, 2 n_q)."""
    q, v, data = hold.sx_in()
    return ca.Function("hold_slope", [q, v, data], [ca.densify(ca.jacobian(hold(q, v, data), ca.vertcat(q, v)))])


@functools.lru_cache(maxsize=128)
def _reordered(function: ca.Function) -> ca.Function:
    """Return (t, y, data, p) -> first output: the parameters, which never change, come last."""
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
    velocity, mobility, spread = robot.collision(y[:n], y[n:], p)
    if outcome is Mode.STICK:
        impulse = -ca.solve(mobility, velocity)
    else:
        friction = p[[parameter.name for parameter in robot.parameters].index("friction")]
        direction = ca.vertcat(-outcome.sign * friction, 1)
        impulse = direction * (-velocity[1] / (mobility[1, :] @ direction))
    following = ca.vertcat(*robot.swap(y[:n], y[n:] + spread @ impulse, p))
    jacobian = ca.Function("jacobian", [y, p], [ca.densify(ca.jacobian(following, y))])
    return ca.Function("reset_slope", [q, v, p], [jacobian(ca.vertcat(q, v), p)])
