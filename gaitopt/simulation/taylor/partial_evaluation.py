"""Partial evaluation: Functions split into a constant and a time-varying part.

Products of time-varying quantities dominate the cost of a Taylor integrator, which treats expressions of parameters as
time-varying too.  All expressions that depend only on parameters, data and constant entries of the state are therefore
evaluated once, outside the integrator.
"""

from collections.abc import Sequence

import casadi as ca

from gaitopt.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class SplitExpression:
    """A Function of (t, y, p, data) in two parts.

    Attributes
    ----------
    numbers : (p, data, y) -> (n_c)
        Values of the constant expressions; only constant entries of `y` enter.
    body : (t, y[active], numbers) -> the outputs of the Function
    """

    numbers: ca.Function
    body: ca.Function


@dataclass(eq=False)
class _Result:
    """Result of an instruction; `symbol` replaces a constant result in the body."""

    expression: ca.SX
    constant: bool
    symbol: ca.SX | None = None


def split_expression(function: ca.Function, active: Sequence[int]) -> SplitExpression:
    """Split a Function of (t, y, p, data) in which only time and the entries `active` of y change.

    Parameters
    ----------
    function : Function
        Function of SX type with dense inputs and outputs.
    active : sequence of int

    Examples
    --------
    >>> t, y, p, data = ca.SX.sym("t"), ca.SX.sym("y", 2), ca.SX.sym("p"), ca.SX.sym("data", 0)
    >>> parts = split_expression(ca.Function("f", [t, y, p, data], [ca.sin(p) * y[1] * ca.sqrt(y[0])]), [1])
    >>> parts.numbers.numel_out(0), parts.body(0, 2.0, parts.numbers(0.5, [], [9, 0]))
    (2, DM(2.87655))
    """
    inputs, used = function.sx_in(), list[_Result]()
    varying = {(0, 0), *((1, i) for i in active)}
    computed: dict[int, _Result] = {}
    outputs: list[list[ca.SX]] = [[ca.SX(0)] * function.numel_out(i) for i in range(function.n_out())]

    def in_body(result: _Result) -> ca.SX:
        if not result.constant or result.expression.is_constant():
            return result.expression
        if result.symbol is None:
            result.symbol = ca.SX.sym(f"c{len(used)}")
            used.append(result)
        return result.symbol

    for k in range(function.n_instructions()):
        operation, sources = function.instruction_id(k), function.instruction_input(k)
        targets = function.instruction_output(k)
        if operation == ca.OP_INPUT:
            computed[targets[0]] = _Result(inputs[sources[0]].nz[sources[1]], (sources[0], sources[1]) not in varying)
        elif operation == ca.OP_CONST:
            computed[targets[0]] = _Result(ca.SX(function.instruction_constant(k)), True)
        elif operation == ca.OP_OUTPUT:
            outputs[targets[0]][targets[1]] = in_body(computed[sources[0]])
        else:
            results = [computed[i] for i in sources]
            constant = all(result.constant for result in results)
            arguments = [result.expression if constant else in_body(result) for result in results]
            apply = ca.SX.unary if len(arguments) == 1 else ca.SX.binary
            computed[targets[0]] = _Result(apply(operation, *arguments), constant)
    t, y, p, data = inputs
    symbols, values = ([ca.SX(0, 1), *column] for column in ([r.symbol for r in used], [r.expression for r in used]))
    state = ca.vertcat(ca.SX(0, 1), *[y[i] for i in active])
    body = ca.Function(function.name(), [t, state, ca.vertcat(*symbols)], ca.cse([ca.vertcat(*o) for o in outputs]))
    return SplitExpression(ca.Function("numbers", [p, data, y], ca.cse([ca.vertcat(*values)])), body)
