"""Numerical calls of CasADi Functions that return dense arrays."""

import casadi as ca
import numpy as np

from gaitopt.model.fast_call import FastCall
from gaitopt.motion.motion import Array


class DenseCall:
    """Numerical calls of a Function with a fixed last input.

    Parameters
    ----------
    function : Function
    fixed : (n,) array
        Value of the last input.

    Examples
    --------
    >>> x, p = ca.SX.sym("x", 2), ca.SX.sym("p")
    >>> DenseCall(ca.Function("scale", [x, p], [ca.diag(p * x)]), np.array([3.0]))(np.array([1.0, 2.0]))[0].tolist()
    [[3.0, 0.0], [0.0, 6.0]]
    """

    def __init__(self, function: ca.Function, fixed: Array) -> None:
        self._call = FastCall(function, fixed)
        patterns = [function.sparsity_out(i) for i in range(function.n_out())]
        self._entries = [(pattern.shape, np.array(pattern.row()), np.array(pattern.get_col())) for pattern in patterns]

    def __call__(self, *values: Array) -> list[Array]:
        """Return the outputs for the free inputs; columns of matrices with one column are vectors."""
        dense = []
        for (shape, rows, columns), nonzeros in zip(self._entries, self._call(*values), strict=True):
            matrix = np.zeros(shape)
            if nonzeros.size:
                matrix[rows, columns] = nonzeros
            dense.append(matrix.ravel() if shape[1] == 1 else matrix)
        return dense
