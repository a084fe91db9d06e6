"""Initial values of the deviations: the solution of their equations, which are linear at a constant motion."""

import warnings

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.statement.stability_bound import LEAST_RADIUS
from gaitopt.ocp.transcription.deviation_constraints import DEVIATION_GROUPS
from gaitopt.ocp.transcription.deviations import DEVIATIONS, section_names
from gaitopt.ocp.transcription.transcription import Transcription

STEPS = 3
"""Newton steps; the shifts of events multiply rates of change that are unknowns, too."""


def solve_deviations(transcription: Transcription, x: Array, data: Array) -> Array:
    """Return a decision vector whose deviations satisfy their equations for its motion and gains.

    Parameters
    ----------
    transcription : Transcription
        With deviations.
    x : (n_variables,) array
    data : (n_z,) array
    """
    from scipy.sparse.linalg import MatrixRankWarning, spsolve  # whose import takes longer than a solve

    variables, rows = transcription.variables, transcription.constraints
    columns = np.concatenate([table.ravel() for key, table in variables.tables.items() if _base(key) in DEVIATIONS])
    places = np.concatenate([table.ravel() for key, table in rows.tables.items() if _base(key) in DEVIATION_GROUPS])
    point = x.copy()
    for _ in range(STEPS):
        values, jacobian = transcription.nlp.derivatives["jac_g"](point, data)
        matrix = jacobian.sparse().tocsr()[places][:, columns]
        with warnings.catch_warnings():  # a singular matrix gives nan, which is checked below
            warnings.simplefilter("ignore", MatrixRankWarning)
            change = spsolve(matrix.tocsc(), -np.asarray(values).ravel()[places])
        if not np.all(np.isfinite(change)):
            return x
        point[columns] += change
    point[variables[Unknown.RADIUS]] = max(spectral_radius(transcription, point), LEAST_RADIUS)
    return point


def spectral_radius(transcription: Transcription, x: Array) -> float:
    """Return the largest modulus of the multipliers in a decision vector."""
    section = section_names(transcription.structure.robot, transcription.structure.sequence)
    after = x[transcription.variables[Unknown.RETURN][:, 0]].reshape(len(section.names), -1).T
    return float(np.max(np.abs(np.linalg.eigvals(after[section.kept]))))


def _base(key: object) -> object:
    return key[0] if isinstance(key, tuple) else key
