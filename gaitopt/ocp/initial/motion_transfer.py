"""Transfer of the motion of a collocation solution to another grid, by the polynomials of its accelerations.

Between the nodes of a solution the accelerations are polynomials, and rates and angles are their integrals.  The motion
on the other grid is therefore the same, where interpolation between the nodes would leave residuals in every equation.
"""

import functools

import numpy as np
from numpy.polynomial import Polynomial

from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array
from gaitopt.motion.nlp_solution import Solution
from gaitopt.ocp.nlp.keys import Unknown, table_name
from gaitopt.ocp.transcription.collocation import Lobatto, lobatto_points
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.transcription import Transcription


def transfer_motion(solution: Solution, transcription: Transcription, x: Array) -> None:
    """Set angles, rates, slides and accelerations in a decision vector to those of a solution at the same fractions.

    Phases whose accelerations are not unknowns, or of other coordinates in the solution, are not changed.

    Parameters
    ----------
    solution : Solution
    transcription : Transcription
        A transcription with the phases of the solution.
    x : (n_variables,) array
        Decision vector, changed in place.
    """
    layout, scheme = transcription.variables, transcription.structure.scheme
    if not isinstance(scheme, Lobatto):
        return
    inner = lobatto_points(scheme.points)[1:-1]
    for phase in transcription.phases:
        motion = _read_phase(solution, transcription, phase)
        if motion is None:
            continue
        at, nodes = phase.fractions, list(phase.nodes)
        position, speed, acceleration = motion.evaluate(at)
        n = len(layout[Unknown.ANGLES])
        x[layout[Unknown.ANGLES][:, nodes]], x[layout[Unknown.RATES][:, nodes]] = position[:n], speed[:n]
        if phase.mode.slips:
            x[layout[Unknown.SLIDE, phase.number]] = np.vstack([position[n:], speed[n:]])
        x[layout[Unknown.ACCELERATION, phase.number]] = acceleration
        between = [motion.evaluate(at[:-1] + fraction * np.diff(at))[2] for fraction in inner]
        x[layout[Unknown.INNER_ACCELERATION, phase.number]] = np.vstack(between)


@dataclass(frozen=True, eq=False)
class _PhaseMotion:
    """Motion in a phase.

    Attributes
    ----------
    nodes : (N + 1,) array
        Fractions of the phase at which its nodes are.
    duration : float [s]
    position, speed : (n, N + 1) arrays
        Coordinates and their rates at the nodes.
    acceleration : (s, n, N) array
        Accelerations at the s collocation points of each interval.
    """

    nodes: Array
    duration: float
    position: Array
    speed: Array
    acceleration: Array

    def evaluate(self, at: Array) -> tuple[Array, Array, Array]:
        """Return positions, speeds and accelerations at fractions of the phase, shape (n, K) each."""
        interval = np.clip(np.searchsorted(self.nodes, at, side="right") - 1, 0, self.nodes.size - 2)
        shares = np.diff(self.nodes)[interval]
        fraction, length = (at - self.nodes[interval]) / shares, self.duration * shares
        known = self.acceleration[:, :, interval]
        acceleration, once, twice = (
            np.einsum("sk,snk->nk", [basis(fraction) for basis in bases], known)
            for bases in _polynomials(known.shape[0])
        )
        start = self.speed[:, interval]
        position = self.position[:, interval] + length * (fraction * start + length * twice)
        return position, start + length * once, acceleration


@functools.cache
def _polynomials(count: int) -> tuple[list[Polynomial], list[Polynomial], list[Polynomial]]:
    """Return the Lagrange polynomials of Lobatto's points, and their first and second integrals from 0."""
    at = lobatto_points(count)
    others = [np.delete(at, j) for j in range(count)]
    bases = [Polynomial.fromroots(roots) / np.prod(at[j] - roots) for j, roots in enumerate(others)]
    return bases, [basis.integ(1) for basis in bases], [basis.integ(2) for basis in bases]


def _read_phase(solution: Solution, transcription: Transcription, phase: Phase) -> _PhaseMotion | None:
    """Return the motion of a solution in a phase; None if the solution lacks some of its coordinates."""
    tables, layout = solution.unknowns, transcription.variables
    names = Unknown.ACCELERATION, Unknown.INNER_ACCELERATION, Unknown.SLIDE
    nodal, inner, slide = (tables.get(table_name((name, phase.number))) for name in names)
    key = Unknown.ACCELERATION, phase.number
    if nodal is None or inner is None or key not in layout or nodal.keys != layout.identifiers[key]:
        return None
    count, before = solution.intervals[phase.number], sum(solution.intervals[: phase.number])
    columns = slice(before, before + count + 1)
    position, speed = (tables[table_name(name)].values[:, columns] for name in (Unknown.ANGLES, Unknown.RATES))
    if phase.mode.slips:
        if slide is None:
            return None
        position, speed = np.vstack([position, slide.values[:1]]), np.vstack([speed, slide.values[1:]])
    between = inner.values.reshape(-1, len(nodal.rows), count)
    acceleration = np.concatenate([nodal.values[None, :, :-1], between, nodal.values[None, :, 1:]])
    fractions = None if solution.fractions is None else solution.fractions[phase.number]
    nodes = np.linspace(0.0, 1.0, count + 1) if fractions is None else np.array(fractions)
    duration = float(tables[table_name(Unknown.DURATION)].values[0, phase.number])
    return _PhaseMotion(nodes, duration, position, speed, acceleration)
