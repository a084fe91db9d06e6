"""Joint positions of a robot: sums that several positions of bodies and contacts share.

A user writes ``knee = hip + length * direction`` and places bodies and contacts relative to the knee.  The coordinates
of the knee are identified in the expressions, so that a robot needs no further description as a tree of links.
"""

from collections import Counter

import casadi as ca

from gaitopt.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class JointSums:
    """Expressions written with joint positions, each of which depends on few coordinates.

    Attributes
    ----------
    symbols : SX, shape (n_j, 1)
        Joint positions s.
    definitions : SX, shape (n_j, 1)
        Their values as functions of q and of the symbols before them, linear in the symbols.
    outputs : SX, shape (n_o, 1)
        The expressions as functions of q and s, linear in s.

    Examples
    --------
    >>> a, b, c = (ca.SX.sym(name) for name in "abc")
    >>> knee = a + ca.sin(b)
    >>> sums = find_joints(ca.vertcat(knee + ca.sin(c), knee - ca.cos(c)))
    >>> sums.definitions, sums.outputs
    (SX((a+sin(b))), SX([(joint_0+sin(c)), (joint_0-cos(c))]))
    """

    symbols: ca.SX
    definitions: ca.SX
    outputs: ca.SX


def find_joints(expressions: ca.SX) -> JointSums:
    """Return expressions with symbols for the sums that occur more than once in them.

    Parameters
    ----------
    expressions : SX, shape (n_o, 1)
        Positions and angles as functions of q.
    """
    (merged,) = ca.cse([ca.densify(expressions)])
    outputs = ca.vertsplit(merged)
    uses: Counter[int] = Counter()
    order: list[ca.SX] = []
    for output in outputs:
        _count_sums(output, uses, order)
    shared = [part for part in order if uses[part.element_hash()] > 1]
    symbols = {part.element_hash(): ca.SX.sym(f"joint_{k}") for k, part in enumerate(shared)}
    definitions = [_write_sum(part, symbols, is_top=True) for part in shared]
    return JointSums(
        ca.vertcat(ca.SX(0, 1), *symbols.values()),
        ca.vertcat(ca.SX(0, 1), *definitions),
        ca.vertcat(ca.SX(0, 1), *[_write_sum(output, symbols) for output in outputs]),
    )


def _terms(expression: ca.SX) -> list[ca.SX]:
    """Return the two parts of a sum or a difference, and none of another expression."""
    is_sum = expression.is_op(ca.OP_ADD) or expression.is_op(ca.OP_SUB)
    return [expression.dep(0), expression.dep(1)] if is_sum else []


def _count_sums(expression: ca.SX, uses: Counter[int], order: list[ca.SX]) -> None:
    """Count the uses of every sum within nested sums, and append the sums to `order`, inner ones first."""
    terms = _terms(expression)
    if not terms:
        return
    name = expression.element_hash()
    uses[name] += 1
    if uses[name] == 1:
        for term in terms:
            _count_sums(term, uses, order)
        order.append(expression)


def _write_sum(expression: ca.SX, symbols: dict[int, ca.SX], *, is_top: bool = False) -> ca.SX:
    """Return a sum in which symbols replace inner sums, and unless it is at the top, the sum itself."""
    if not is_top and expression.element_hash() in symbols:
        return symbols[expression.element_hash()]
    terms = _terms(expression)
    if not terms:
        return expression
    left, right = (_write_sum(term, symbols) for term in terms)
    return left + right if expression.is_op(ca.OP_ADD) else left - right
