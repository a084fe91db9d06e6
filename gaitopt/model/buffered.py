"""CasADi Functions called often on numbers: without conversions, into arrays kept for the purpose."""

from typing import Any

import casadi as ca
import numpy as np


class Buffered:
    """A Function called through fixed memory, about ten times faster than a plain call.

    Parameters
    ----------
    function : Function
        All inputs and outputs dense.
    fixed : arrays
        Values of its last inputs, the same in every call.

    Notes
    -----
    The arrays returned (flat, column-major) are overwritten by the next call; copy what is kept.

    Examples
    --------
    >>> x, p = ca.SX.sym("x", 2), ca.SX.sym("p")
    >>> scale = Buffered(ca.Function("scale", [x, p], [p * x]), 3.0)
    >>> scale([1.0, 2.0])[0]
    array([3., 6.])
    """

    def __init__(self, function: ca.Function, *fixed: Any) -> None:
        self._buffer, self._evaluate = function.buffer()
        # CasADi keeps bare pointers into these arrays: they must live as long as the buffer.
        self._inputs = [np.zeros(function.numel_in(i)) for i in range(function.n_in())]
        self._outputs = tuple(np.zeros(function.numel_out(i)) for i in range(function.n_out()))
        for i, array in enumerate(self._inputs):
            if array.size:
                self._buffer.set_arg(i, array.data)
        for i, array in enumerate(self._outputs):
            if array.size:
                self._buffer.set_res(i, array.data)
        free = len(self._inputs) - len(fixed)
        for array, value in zip(self._inputs[free:], fixed, strict=True):
            array[:] = value
        self._free = self._inputs[:free]

    def __call__(self, *values: Any) -> tuple[np.ndarray, ...]:
        """Return the outputs for the free inputs."""
        for array, value in zip(self._free, values, strict=True):
            array[:] = value
        self._evaluate()
        return self._outputs
