"""Placement of the nodes of a grid where the torques of a solution jump.

Torques are linear between nodes.  Where the best torque jumps, as between its limits, the plan has a ramp of one or two
intervals, which raises the objective in proportion to the height of the jump and the square of its width (first order
in the switching function, which is zero at the jump).  Intervals are divided so that the sum of these terms is small: m
parts of an interval reduce its term by 1 / m^2, so m is proportional to the cubic root of the term.
"""

from collections.abc import Sequence

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.locks import cached_property
from gaitopt.motion.motion import Array
from gaitopt.motion.nlp_solution import Solution
from gaitopt.ocp.nlp.keys import Unknown, table_name
from gaitopt.ocp.transcription.method import Fractions
from gaitopt.ocp.transcription.transcription import Transcription

JUMPS = 0.5
"""Share of the intervals that is distributed according to jumps of the torques; the others have equal lengths."""

LEAST_SHARE = 1e-3
"""Least share of an interval in the duration of its phase."""

LEAST_INTERVALS, MULTIPLE = 10, 5
"""Least number of intervals of a phase, and the number of which it is a multiple, so that NLPs are built once."""


@dataclass(frozen=True, eq=False)
class TorqueRamps:
    """The torques of a solution along the step.

    Attributes
    ----------
    nodes : tuple of (N + 1,) arrays
        Fractions of the phases at which their nodes are.
    lengths : (n,) array
        Lengths of the intervals of the step [s].
    torque : (n_u, n + 1) array
        Torques at the nodes of the step [N m].
    """

    nodes: tuple[Array, ...]
    lengths: Array
    torque: Array

    def jumps(self) -> Array:
        """Return the jumps across the intervals that are ramps, summed over the actuators, shape (n,) [N m].

        A ramp is steeper or flatter than the intervals on both sides; its jump is the smaller difference from the two.
        Beyond the ends of the step the torque is free.
        """
        return self._heights().sum(axis=0)

    def errors(self) -> Array:
        """Return the contributions of the ramps to the error of the objective, up to a factor, shape (n,) [N m s^2].

        They are the jumps times the squares of the lengths, relative to the share of the phase in the step: the shorter
        a phase, such as a slip, the larger the effect of its torques.
        """
        return self.jumps() * self.lengths**2 * self._weights()

    @cached_property
    def variation(self) -> float:
        """Sum of the contributions of all ramps to the error of the objective, up to a factor [N m s^2]."""
        return float(self.errors().sum())

    @cached_property
    def wide_variation(self) -> float:
        """Sum like `variation`, with the jumps that extend over two intervals, up to another factor [N m s^2].

        A jump is here at most the increment of the torque.
        """
        single = np.minimum(self._heights(), np.abs(np.diff(self.torque))) * self.lengths**2
        return float((np.maximum(single, self._double_ramps()).sum(axis=0) * self._weights()).sum())

    def _heights(self) -> Array:
        """Return the jumps of each actuator, shape (n_u, n) [N m]."""
        slope = np.diff(self.torque) / self.lengths
        corners, free = np.abs(np.diff(slope)), np.full((slope.shape[0], 1), np.inf)
        height = self.lengths * np.minimum(np.hstack([free, corners]), np.hstack([corners, free]))
        return np.minimum(height, 2 * np.abs(self.torque).max(initial=0.0))

    def _double_ramps(self) -> Array:
        """Return the contributions of ramps over two intervals to the error, shape (n_u, n) [N m s^2].

        The error of a jump J on a ramp is proportional to  12 J  times the variance of the time along the ramp with the
        increments of the torque as weights: J l^2 for one interval of length l, and for two with the increments i and j
        i l_1^2 + j l_2^2 + 3 (l_1 + l_2)^2 i j / J.  Increments are relative to the slope of a neighbour, as for one.
        """
        rises, first, second = np.diff(self.torque), self.lengths[:-1], self.lengths[1:]
        errors = np.zeros_like(rises)
        if self.lengths.size < 3:
            return errors
        slope, free = rises / self.lengths, np.full((errors.shape[0], 1), np.inf)
        mean = (rises[:, :-1] + rises[:, 1:]) / (first + second)
        before, after = np.hstack([free, slope[:, :-2]]), np.hstack([slope[:, 2:], free])
        outer = np.where(np.abs(mean - before) < np.abs(mean - after), before, after)
        sign = np.sign(mean - outer)
        one = np.clip(sign * (rises[:, :-1] - outer * first), 0, np.abs(rises[:, :-1]))
        other = np.clip(sign * (rises[:, 1:] - outer * second), 0, np.abs(rises[:, 1:]))
        jump = np.maximum(one + other, np.finfo(float).tiny)
        error = one * first**2 + other * second**2 + 3 * (first + second) ** 2 * one * other / jump
        error *= self._are_in_one_phase()
        errors[:, :-1] = one / jump * error
        errors[:, 1:] = np.maximum(errors[:, 1:], other / jump * error)
        return errors

    def _weights(self) -> Array:
        """Return the duration of the step relative to that of the phase of each interval, shape (n,)."""
        durations = np.array([lengths.sum() for lengths in self._split(self.lengths)])
        return np.repeat(durations.sum() / durations, [at.size - 1 for at in self.nodes])

    def _are_in_one_phase(self) -> Array:
        """Return whether two successive intervals are in the same phase, shape (n - 1,)."""
        return np.diff(np.repeat(np.arange(len(self.nodes)), [at.size - 1 for at in self.nodes])) == 0

    def amounts(self) -> list[Array]:
        """Return the amount of intervals that each interval is to be divided into, in total 1, phase by phase."""
        parts, time = np.cbrt(self.errors()), self.lengths / self.lengths.sum()
        shares = parts / parts.sum() if parts.sum() > 0 else time
        return self._split(JUMPS * shares + (1 - JUMPS) * time)

    def _split(self, values: Array) -> list[Array]:
        return np.split(values, np.cumsum([at.size - 1 for at in self.nodes])[:-1])


def find_ramps(solution: Solution) -> TorqueRamps | None:
    """Return the torques of a solution along the step, or None if it has none at its nodes."""
    torque, duration = (solution.unknowns.get(table_name(key)) for key in (Unknown.TORQUE, Unknown.DURATION))
    if torque is None or duration is None:
        return None
    nodes = [np.linspace(0.0, 1.0, count + 1) for count in solution.intervals]
    if solution.fractions is not None:
        nodes = [np.array(at) for at in solution.fractions]
    return make_ramps(nodes, duration.values[0], torque.values)


def make_ramps(nodes: Sequence[Array], durations: Array, torque: Array) -> TorqueRamps | None:
    """Return torques along the step, or None if they are not those of its nodes or not finite.

    Parameters
    ----------
    nodes : sequence of (N + 1,) arrays
        Fractions of the phases at which their nodes are.
    durations : (n_phases,) array
        Durations of the phases [s].
    torque : (n_u, n + 1) array
        Torques at the nodes of the step [N m].
    """
    lengths = np.concatenate([duration * np.diff(at) for duration, at in zip(durations, nodes, strict=True)])
    usable = torque.shape[1] == lengths.size + 1 and np.all(np.isfinite(torque)) and np.all(lengths > 0)
    return TorqueRamps(tuple(nodes), lengths, torque) if usable else None


def read_ramps(transcription: Transcription, x: Array) -> TorqueRamps | None:
    """Return the torques of a decision vector along the step; None if it is not finite."""
    layout, nodes = transcription.variables, [phase.fractions for phase in transcription.phases]
    return make_ramps(nodes, x[layout[Unknown.DURATION][0]], x[layout[Unknown.TORQUE]])


def allot_intervals(ramps: TorqueRamps, total: int) -> tuple[int, ...]:
    """Return the numbers of intervals of the phases of a grid with about `total` intervals."""
    amounts = [amount.sum() * total for amount in ramps.amounts()]
    return tuple(max(LEAST_INTERVALS, MULTIPLE * round(amount / MULTIPLE)) for amount in amounts)


def distribute_nodes(ramps: TorqueRamps, counts: Sequence[int]) -> Fractions:
    """Return the fractions of the phases at which the nodes of a grid are placed, with `counts` intervals.

    Examples
    --------
    >>> torque = np.array([[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]])
    >>> ramps = TorqueRamps((np.linspace(0, 1, 6),), np.full(5, 0.2), torque)
    >>> tuple(tuple(round(at, 3) for at in nodes) for nodes in distribute_nodes(ramps, (4,)))
    ((0.0, 0.417, 0.5, 0.583, 1.0),)
    """
    return tuple(
        _distribute(nodes, amount, count)
        for nodes, amount, count in zip(ramps.nodes, ramps.amounts(), counts, strict=True)
    )


def _distribute(nodes: Array, amount: Array, count: int) -> tuple[float, ...]:
    """Return the nodes of `count` intervals with equal amounts."""
    sums = np.concatenate([[0.0], np.cumsum(amount)])
    shares = np.diff(np.interp(np.linspace(0.0, 1.0, count + 1), sums / sums[-1], nodes))
    shares = np.maximum(shares, LEAST_SHARE)
    ends = np.cumsum(shares) / shares.sum()
    return (0.0, *ends[:-1].tolist(), 1.0)
