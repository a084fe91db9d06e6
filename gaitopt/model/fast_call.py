"""Fast numerical calls of CasADi Functions, without conversions and with preallocated arrays."""

from itertools import accumulate
from typing import Any
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np

from gaitopt.errors import InputError


class FastCall:
    """Numerical calls of a Function through fixed memory, about ten times faster than plain calls.

    Parameters
    ----------
    function : Function
        Sparse inputs and outputs are passed by their nonzeros.
    fixed : arrays
        Values of the last inputs, constant in all calls.
    shared : (k,) array, optional
        Memory with the free inputs one after the other, for :meth:`evaluate`; several Functions may share it.

    Notes
    -----
    The arrays returned (flat, column-major) are overwritten by the next call; copy them to keep them.

    Examples
    --------
    >>> x, p = ca.SX.sym("x", 2), ca.SX.sym("p")
    >>> scale = FastCall(ca.Function("scale", [x, p], [p * x]), 3.0)
    >>> scale([1.0, 2.0])[0]
    array([3., 6.])
    >>> scale.evaluate_packed(np.array([2.0, 3.0]))
    array([6., 9.])
    """

    def __init__(self, function: ca.Function, *fixed: Any, shared: np.ndarray | None = None) -> None:
        self._buffer, self._call = function.buffer()
        # CasADi stores pointers to this memory, which must exist as long as the buffer.
        inputs_of, outputs_of = _memory_layout(function)
        count = len(inputs_of) - len(fixed)
        free_size = inputs_of[count - 1].stop if count else 0
        if shared is not None and (not shared.flags.c_contiguous or shared.shape != (free_size,)):
            raise InputError(
                f"Shared memory must be a contiguous array of {free_size} numbers, got one of shape {shared.shape}."
            )
        self._packed = np.zeros(free_size) if shared is None else shared
        self._result = np.zeros(outputs_of[-1].stop if outputs_of else 0)
        self._free = tuple([self._packed[part] for part in inputs_of[:count]])
        self._fixed = tuple([np.zeros(part.stop - part.start) for part in inputs_of[count:]])
        self._outputs = tuple([self._result[part] for part in outputs_of])
        self.fix(*fixed)
        for i, array in enumerate(self._free + self._fixed):
            if array.size:
                self._buffer.set_arg(i, array.data)
        for i, array in enumerate(self._outputs):
            if array.size:
                self._buffer.set_res(i, array.data)

    def fix(self, *values: Any) -> None:
        """Replace the values of the last inputs, in a tenth of the time that another object takes.

        Examples
        --------
        >>> x, p = ca.SX.sym("x"), ca.SX.sym("p")
        >>> scale = FastCall(ca.Function("scale", [x, p], [p * x]), 3.0)
        >>> scale.fix(5.0)
        >>> scale(2.0)[0]
        array([10.])
        """
        for array, value in zip(self._fixed, values, strict=True):
            array[:] = value

    def __call__(self, *values: Any) -> tuple[np.ndarray, ...]:
        """Return the outputs for the free inputs."""
        for array, value in zip(self._free, values, strict=True):
            array[:] = value
        self._call()
        return self._outputs

    @property
    def succeeded(self) -> bool:
        """Whether the last call of a solver has found a solution."""
        return bool(self._buffer.stats()["success"])

    def evaluate_packed(self, values: np.ndarray) -> np.ndarray:
        """Return the outputs one after the other in one array, for free inputs in the same form; the fastest call."""
        self._packed[:] = values
        self._call()
        return self._result

    def evaluate(self) -> np.ndarray:
        """Return the outputs one after the other in one array, for the free inputs in the shared memory."""
        self._call()
        return self._result

    def evaluate_separately(self) -> tuple[np.ndarray, ...]:
        """Return the outputs, for the free inputs in the shared memory.

        Examples
        --------
        >>> x, y = ca.SX.sym("x", 2), ca.SX.sym("y")
        >>> memory = np.zeros(3)
        >>> products = FastCall(ca.Function("products", [x, y], [y * x, y]), shared=memory)
        >>> memory[:] = 1.0, 2.0, 3.0
        >>> products.evaluate_separately()
        (array([3., 6.]), array([3.]))
        """
        self._call()
        return self._outputs


def _memory_layout(function: ca.Function) -> tuple[list[slice], list[slice]]:
    """Return the slices of the inputs and of the outputs of a Function in two arrays of consecutive numbers."""
    layout = _LAYOUTS.get(function)
    if layout is None:
        layout = _LAYOUTS[function] = (
            _consecutive([function.nnz_in(i) for i in range(function.n_in())]),
            _consecutive([function.nnz_out(i) for i in range(function.n_out())]),
        )
    return layout


_LAYOUTS: WeakKeyDictionary[ca.Function, tuple[list[slice], list[slice]]] = WeakKeyDictionary()


def _consecutive(sizes: list[int]) -> list[slice]:
    """Return the slices of consecutive parts with given sizes."""
    return [slice(end - size, end) for size, end in zip(sizes, accumulate(sizes), strict=True)]
