"""The section of a planar robot's periodic gait: the states right after an event, modulo travel."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.fast_call import FastCall
from gaitopt.model.planar.impact_system import contact_slopes
from gaitopt.model.planar.mirror import Mirror
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_motion import PlanarEvent
from gaitopt.motion.stated_changes import find_closing
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_simulator import PlanarRollout
from gaitopt.simulation.planar_simulation.planar_state import PlanarArc, PlanarState
from gaitopt.simulation.planar_simulation.planar_walker import exchange_legs

CORRECTIONS = 8
"""Largest number of Newton iterations with which a state returns to the section."""


class SectionRows(NamedTuple):
    """Contacts whose gap, normal velocity and slip velocity are zero on the section.

    Attributes
    ----------
    gaps, normal, tangential : tuple of int
    """

    gaps: tuple[int, ...]
    normal: tuple[int, ...]
    tangential: tuple[int, ...]


class PlanarSection:
    """The states right after an event, after the exchange of the legs.

    Parameters
    ----------
    automaton : PlanarAutomaton
    arc : PlanarArc
        Phase before the event.
    event : PlanarEvent
    mirror : Mirror or None
    """

    def __init__(self, automaton: PlanarAutomaton, arc: PlanarArc, event: PlanarEvent, mirror: Mirror | None) -> None:
        robot = automaton.robot
        self.robot, self._mirror = robot, mirror
        p = automaton.p(arc.start.extended)
        self._slopes, self._gaps, self._rows = (
            FastCall(function, p) for function in (contact_slopes(robot), robot.gaps, robot.rows)
        )
        touching = {robot.contact_names.index(name) for name in find_closing(event.names)}
        outcome = next(
            (stage.outcome for stage in event.actuator_impulses if stage.moment == "after"),
            event.outcome or event.after,
        )
        modes = [mode for _, mode in outcome.modes]
        place = range(len(modes)) if mirror is None else [mirror.contacts.index(i) for i in range(len(modes))]
        self.rows = SectionRows(
            tuple(sorted(place[i] for i in touching | set(arc.start.closed))),
            tuple(sorted(place[i] for i, mode in enumerate(modes) if mode is not Mode.FREE)),
            tuple(sorted(place[i] for i, mode in enumerate(modes) if mode is Mode.STICK)),
        )
        self.travel = None if robot.travel is None else robot.coordinates.index(robot.travel)

    def exchange(self, state: PlanarState) -> PlanarState:
        """Return a state after the event with exchanged legs, at time 0."""
        return exchange_legs(state, self.robot, self._mirror)

    def matrix(self) -> Array:
        """Return the matrix of the leg exchange on the state (q, v), shape (2 n_q, 2 n_q)."""
        n = self.robot.n_q
        coordinates = np.eye(n) if self._mirror is None else self._mirror.coordinates
        return np.asarray(np.kron(np.eye(2), coordinates), dtype=float)

    def tangent(self, y: Array) -> Array:
        """Return an orthonormal basis of the deviations on the section, travel excluded, shape (2 n_q, n_z)."""
        rows = self._constraint_rows(y)
        if self.travel is not None:
            rows = np.vstack([rows, np.eye(1, rows.shape[1], self.travel)])
        _, sizes, basis = np.linalg.svd(rows)
        rank = int(np.sum(sizes > 1e-9 * sizes[0])) if sizes.size else 0
        return np.asarray(basis[rank:].T, dtype=float)

    def project(self, deviation: Array) -> Array:
        """Return a deviation without its travel."""
        deviation = deviation.copy()
        if self.travel is not None:
            deviation[self.travel] = 0.0
        return deviation

    def place(self, y: Array, fixed: Sequence[int]) -> Array:
        """Return a state on the section near another one: coordinates are corrected for gaps, only rates for speeds.

        Parameters
        ----------
        y : (2 n_q,) array
        fixed : sequence of int
            Entries of the state that do not change.
        """
        y, n, count = np.array(y, dtype=float), self.robot.n_q, len(self.rows.gaps)
        positions, rates = ([k for k in span if k not in fixed] for span in (range(n), range(n, 2 * n)))
        for part, places in [(slice(count), positions)] * CORRECTIONS + [(slice(count, None), rates)]:
            matrix = self._constraint_rows(y)[part][:, places]
            y[places] -= np.asarray(np.linalg.lstsq(matrix, self.violation(y)[part], rcond=1e-12)[0], dtype=float)
        return y

    def correct(self, y: Array) -> Array:
        """Return the nearest state on the section."""
        y = np.array(y, dtype=float)
        for _ in range(CORRECTIONS):
            violation = self.violation(y)
            if np.max(np.abs(violation), initial=0.0) < 1e-15:
                break
            correction: Array = np.linalg.lstsq(self._constraint_rows(y), violation, rcond=1e-12)[0].astype(float)
            y -= correction
        return y

    def violation(self, y: Array) -> Array:
        """Return the residuals of the gaps and speeds that are zero on the section, shape (m,)."""
        n, rows = self.robot.n_q, self.rows
        gap = self._gaps(y[:n])[0][list(rows.gaps)].copy()
        normal, tangent = (part.reshape(n, -1).T @ y[n:] for part in self._rows(y[:n], y[n:])[:2])
        return np.concatenate([gap, normal[list(rows.normal)], tangent[list(rows.tangential)]])

    def _constraint_rows(self, y: Array) -> Array:
        """Return the derivatives of the quantities that are zero on the section, shape (m, 2 n_q)."""
        n = self.robot.n_q
        gaps, normal, tangential = (part.reshape(2 * n, -1).T for part in self._slopes(y[:n], y[n:]))
        rows = self.rows
        return np.vstack([gaps[list(rows.gaps)], normal[list(rows.normal)], tangential[list(rows.tangential)]])


def section_of(automaton: PlanarAutomaton, rollout: PlanarRollout) -> PlanarSection:
    """Return the section at the end of a period."""
    return PlanarSection(automaton, rollout.arcs[-1], rollout.motion.events[-1], automaton.robot.mirror)
