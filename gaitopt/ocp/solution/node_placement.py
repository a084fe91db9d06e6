"""Placement of the nodes of a grid where the torques of a solution change fast."""

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.transcription.method import Fractions
from gaitopt.ocp.transcription.transcription import Transcription

VARIATION = 0.5
"""Share of the intervals of a phase that is distributed in proportion to the variation of the torques."""

LEAST_SHARE = 1e-4
"""Least share of an interval in the duration of its phase."""


def place_nodes_by_torque(transcription: Transcription, x: Array, counts: tuple[int, ...]) -> Fractions:
    """Return instants of nodes at which intervals have equal shares of the time and of the variation of the torques.

    Parameters
    ----------
    transcription : Transcription
    x : (n_variables,) array
        Decision vector of a solution.
    counts : tuple of int
        Number of new intervals of each phase.

    Returns
    -------
    tuple of tuple of float
        Fractions of the phases at which their nodes are.
    """
    torque = x[transcription.variables[Unknown.TORQUE]]
    scale = np.maximum(np.abs(torque).max(axis=1), 1e-9)
    grids = []
    for phase, count in zip(transcription.phases, counts, strict=True):
        changes = np.abs(np.diff(torque[:, list(phase.nodes)])) / scale[:, None]
        grids.append(_distribute(phase.fractions, changes.sum(axis=0), count))
    return tuple(grids)


def _distribute(fractions: Array, variation: Array, count: int) -> tuple[float, ...]:
    """Return the nodes of `count` intervals with equal shares of time and variation."""
    total = variation.sum()
    density = np.diff(fractions) if total <= 0 else (1 - VARIATION) * np.diff(fractions) + VARIATION * variation / total
    amount = np.concatenate([[0.0], np.cumsum(density)])
    nodes = np.interp(np.linspace(0, 1, count + 1), amount / amount[-1], fractions)
    shares = np.maximum(np.diff(nodes), LEAST_SHARE)
    nodes = np.concatenate([[0.0], np.cumsum(shares) / shares.sum()])
    nodes[-1] = 1.0
    return tuple(nodes.tolist())
