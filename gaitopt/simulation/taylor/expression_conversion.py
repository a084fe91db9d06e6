"""Conversion of CasADi Functions to heyoka expressions."""

import functools
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

import casadi as ca

from gaitopt.errors import InputError
from gaitopt.locks import one_at_a_time

SAME_NAME = (
    *("sin", "cos", "tan", "asin", "acos", "atan", "atan2"),
    *("sinh", "cosh", "tanh", "asinh", "acosh", "atanh"),
    *("exp", "log", "expm1", "log1p", "sqrt", "erf"),
)
"""Operations that have the same name in CasADi and heyoka."""


@functools.cache
@one_at_a_time
def heyoka_module() -> Any:
    """Return heyoka, imported at the first call."""
    try:
        import heyoka
    except ImportError as error:
        if find_spec("heyoka"):
            raise InputError(f"The package heyoka is installed but cannot be imported: {error}.") from None
        raise InputError("The heyoka engine requires the package heyoka: pip install 'gaitopt[fast]'.") from None
    heyoka.set_logger_level_error()  # suppresses warnings of failed steps, which the engine reports itself
    return heyoka


def convert(function: ca.Function, inputs: Sequence[Sequence[Any]]) -> list[list[Any]]:
    """Return the outputs of a Function as heyoka expressions, operation by operation.

    Parameters
    ----------
    function : Function
        Of SX type, inputs and outputs dense.
    inputs : sequence of sequence of heyoka expressions
        Expression of each entry of each input.

    Raises
    ------
    InputError
        If the Function contains an operation that a Taylor integrator does not support, such as ``fabs`` or
        ``if_else``.

    Examples
    --------
    >>> import heyoka
    >>> x = ca.SX.sym("x")
    >>> convert(ca.Function("f", [x], [ca.sin(x) / 2]), [heyoka.make_vars("z", "w")])
    [[(0.50000000000000000 * sin(z))]]
    """
    heyoka = heyoka_module()
    operations = _operations(heyoka)
    values: dict[int, Any] = {}
    outputs: list[list[Any]] = [[None] * function.numel_out(i) for i in range(function.n_out())]
    for k in range(function.n_instructions()):
        operation, sources = function.instruction_id(k), function.instruction_input(k)
        targets = function.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            outputs[targets[0]][targets[1]] = values[sources[0]]
        elif operation == ca.OP_INPUT:
            values[targets[0]] = inputs[sources[0]][sources[1]]
        elif operation == ca.OP_CONST:
            values[targets[0]] = heyoka.expression(function.instruction_constant(k))
        elif operation in operations:
            values[targets[0]] = operations[operation](*[values[i] for i in sources])
        else:
            raise InputError(
                f"The heyoka engine does not support the operation {_name(operation)!r} in {function.name()!r}. "
                "Use the scipy engine, or a smooth expression."
            )
    return outputs


def can_follow(function: ca.Function) -> bool:
    """Return whether :func:`convert` supports all operations of a Function; requires heyoka.

    Examples
    --------
    >>> x = ca.SX.sym("x")
    >>> [can_follow(ca.Function("f", [x], [f(x)])) for f in (ca.sin, ca.fabs)]
    [True, False]
    """
    known = {ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST, *_operations(heyoka_module())}
    return all(function.instruction_id(k) in known for k in range(function.n_instructions()))


def _operations(heyoka: Any) -> dict[int, Any]:
    """Return the heyoka function of each CasADi operation."""
    arithmetic = {
        ca.OP_ADD: lambda a, b: a + b,
        ca.OP_SUB: lambda a, b: a - b,
        ca.OP_MUL: lambda a, b: a * b,
        ca.OP_DIV: lambda a, b: a / b,
        ca.OP_POW: lambda a, b: a**b,
        ca.OP_CONSTPOW: lambda a, b: a**b,
        ca.OP_NEG: lambda a: -a,
        ca.OP_SQ: lambda a: a * a,
        ca.OP_TWICE: lambda a: 2.0 * a,
        ca.OP_INV: lambda a: 1.0 / a,
        ca.OP_HYPOT: lambda a, b: heyoka.sqrt(a * a + b * b),
    }
    named = {getattr(ca, f"OP_{name.upper()}"): getattr(heyoka, name) for name in SAME_NAME}
    return {**named, **arithmetic}


def _name(operation: int) -> str:
    names = {value: name for name, value in vars(ca).items() if name.startswith("OP_")}
    return names[operation].removeprefix("OP_").lower()
