"""Objectives of feedback tuning."""

from typing import Protocol

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

from gaitopt.arguments import check_record
from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array
from gaitopt.reductions import worst


class TuningObjective(Protocol):
    """A measure of a gait's stability, computed from the derivative of its return map and minimised."""

    @property
    def name(self) -> str:
        """Name in tables."""
        ...

    def __call__(self, derivative: Array, scale: Array) -> float:
        """Return the value of the objective.

        Parameters
        ----------
        derivative : (n_z, n_z) array
            Derivative of the return map.
        scale : (n_z,) array
            Sizes of deviations of the coordinates that have equal weight.
        """
        ...


@check_record
@dataclass(frozen=True)
class SpectralRadius:
    """The largest modulus of the multipliers, the asymptotic factor by which small deviations change per step.

    Examples
    --------
    >>> SpectralRadius()(np.diag([0.5, -0.7]), np.ones(2))
    0.7
    """

    name: str = "spectral radius"

    def __call__(self, derivative: Array, scale: Array) -> float:
        """See :class:`TuningObjective`."""
        return _radius(derivative)


@check_record
@dataclass(frozen=True)
class SensitivityNorm:
    """The gait sensitivity norm: the size of deviations after a push, summed over all steps.

    The norm is the root of the sum over steps k >= 1 of the squared Frobenius norms of the derivative's k-th power,
    with coordinates scaled by their sizes (Hobbelen & Wisse 2007, with pushes and deviations of the state after
    touchdown).  It is inf for an unstable gait.

    Examples
    --------
    >>> round(SensitivityNorm()(np.diag([0.5]), np.ones(1)) ** 2, 6)  # 1/4 + 1/16 + ...
    0.333333
    """

    name: str = "gait sensitivity norm"

    def __call__(self, derivative: Array, scale: Array) -> float:
        """See :class:`TuningObjective`."""
        matrix = derivative * scale / scale[:, None]
        if not _radius(matrix) < 1:
            return float("inf")
        return worst(np.sqrt(np.maximum(np.trace(solve_discrete_lyapunov(matrix, matrix @ matrix.T)), 0.0)))


def _radius(matrix: Array) -> float:
    """Return the spectral radius of a matrix; infinite if an entry is not finite."""
    return worst(0.0, np.abs(np.linalg.eigvals(matrix))) if np.all(np.isfinite(matrix)) else float("inf")
