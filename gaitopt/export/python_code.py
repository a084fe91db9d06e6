"""CasADi Functions as Python functions of the standard library, operation by operation."""

import re

import casadi as ca
import numpy as np

from gaitopt.errors import InputError
from gaitopt.motion.motion import Array
from gaitopt.motion.printable import comment_line

_TEXTS = {
    "ADD": "{0} + {1}",
    "SUB": "{0} - {1}",
    "MUL": "{0} * {1}",
    "DIV": "{0} / {1}",
    "POW": "{0} ** {1}",
    "CONSTPOW": "{0} ** {1}",
    "NEG": "-{0}",
    "SQ": "{0} * {0}",
    "TWICE": "2.0 * {0}",
    "INV": "1.0 / {0}",
    "ASSIGN": "{0}",
    "LT": "float({0} < {1})",
    "LE": "float({0} <= {1})",
    "EQ": "float({0} == {1})",
    "NE": "float({0} != {1})",
    "NOT": "float(not {0})",
    "AND": "float(bool({0}) and bool({1}))",
    "OR": "float(bool({0}) or bool({1}))",
    "FABS": "abs({0})",
    "SIGN": "float(int({0} > 0) - int({0} < 0))",
    "FMIN": "min({0}, {1})",
    "FMAX": "max({0}, {1})",
    "IF_ELSE_ZERO": "{1} if {0} else 0.0",
}
_SAME_NAME = (
    *("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh"),
    *("exp", "log", "expm1", "log1p", "sqrt", "erf", "floor", "ceil", "copysign", "fmod", "hypot"),
)
_OPERATIONS = {getattr(ca, f"OP_{name}"): text for name, text in _TEXTS.items()} | {
    getattr(ca, f"OP_{name.upper()}"): f"math.{name}({', '.join('{' + str(i) + '}' for i in range(count))})"
    for name in _SAME_NAME
    for count in [2 if name in ("atan2", "copysign", "fmod", "hypot") else 1]
}
"""Python expression of each CasADi operation."""


def write_function(function: ca.Function, name: str) -> str:
    """Return the text of a Python function with the inputs of a Function, which returns a list for each output.

    Parameters
    ----------
    function : Function
        Of SX type.  Its inputs become sequences of numbers, scalars too; outputs are listed column by column.
    name : str

    Raises
    ------
    InputError
        If the Function contains an operation without an equivalent.

    Examples
    --------
    >>> x = ca.SX.sym("x", 2)
    >>> text = write_function(ca.Function("f", [x], [x[0] * ca.sin(x[1])], ["x"], ["y"]), "product")
    >>> print(text)
    def product(x):
        y = [0.0] * 1
        a0 = x[0]
        a1 = x[1]
        a1 = math.sin(a1)
        a0 = a0 * a1
        y[0] = a0
        return (y,)
    """
    names = [str(text) for text in function.name_in()]
    lines: list[str] = []
    results = [f"{text}_out" if text in names else str(text) for text in function.name_out()]
    symbols = function.sx_in()
    dense = ca.Function(function.name(), symbols, [ca.densify(output) for output in function.call(symbols)])
    for k in range(dense.n_instructions()):
        operation, sources = dense.instruction_id(k), dense.instruction_input(k)
        targets = dense.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            lines.append(f"    {results[targets[0]]}[{targets[1]}] = a{sources[0]}")
        elif operation == ca.OP_INPUT:
            lines.append(f"    a{targets[0]} = {names[sources[0]]}[{sources[1]}]")
        elif operation == ca.OP_CONST:
            lines.append(f"    a{targets[0]} = {_number(dense.instruction_constant(k))}")
        elif operation in _OPERATIONS:
            lines.append(f"    a{targets[0]} = {_OPERATIONS[operation].format(*(f'a{i}' for i in sources))}")
        else:
            raise InputError(
                f"The CasADi operation {operation} in {function.name()!r} cannot be written in Python; "
                "write C code instead."
            )
    sizes = [f"    {text} = [0.0] * {dense.numel_out(i)}" for i, text in enumerate(results)]
    head = f"def {name}({', '.join(names)}):"
    return "\n".join([head, *sizes, *lines, f"    return ({', '.join(results)},)"])


def _number(value: float) -> str:
    """Return a number with all digits as a Python expression."""
    text = repr(float(value))
    return f'float("{text}")' if text in ("inf", "-inf", "nan") else text


def write_literal(text: str) -> str:
    """Return a text that cannot end the docstring of a module."""
    return re.sub(r'["\\]', "'", comment_line(text))


def write_array(values: Array) -> str:
    """Return numbers as a NumPy array with all digits."""
    numbers = np.asarray(values, dtype=float).ravel().tolist()
    texts = [repr(number) if np.isfinite(number) else f'float("{number}")' for number in numbers]
    return f"np.array([{', '.join(texts)}], dtype=float)"
