"""Relaxations: forms in which complementarity pairs are passed to a solver for smooth NLPs.

A pair is the condition  0 <= x, 0 <= y, x y = 0.  Every relaxation has one parameter t > 0 that is data of the NLP, so
a homotopy in which t decreases uses one compiled NLP; for t -> 0 the pairs hold.
"""

import math
from abc import ABC, abstractmethod
from typing import Any

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.ocp.nlp.keys import Key, Kind, Row

NamedBounds = tuple[str, float, float]
"""Name of a constraint, for the diagnosis, and its lower and upper bound."""


@dataclass(frozen=True)
class Slack:
    """An unknown that a relaxation adds to each pair.

    Attributes
    ----------
    name : str
    lower, upper : float
        Bounds.
    start : float
        Initial value in the first solve.

    Examples
    --------
    >>> Slack("excess", lower=0.0).start
    0.0
    """

    name: str
    lower: float = -math.inf
    upper: float = math.inf
    start: float = 0.0


@dataclass(frozen=True, eq=False)
class Pair:
    """Two nonnegative quantities whose product must vanish.

    Attributes
    ----------
    name : str
    left : SX, shape (1, 1)
        An unknown with the lower bound 0.
    right : SX, shape (1, 1)
        Any expression.
    slacks : SX, shape (n_slacks, 1)
        Unknowns that the relaxation adds, see :attr:`Relaxation.slacks`.
    """

    name: str
    left: ca.SX
    right: ca.SX
    slacks: Any = ()


class Relaxation(ABC):
    """Base of the relaxations of complementarity pairs.

    A custom relaxation is a frozen dataclass derived from this class and passed as ``Homotopy(relaxation=...)``;
    it needs no registration.  The parameter t is finite and positive in every expression.

    Attributes
    ----------
    name : str
    slacks : tuple of Slack
        Unknowns added to each pair, passed to the methods as ``pair.slacks``; none by default.
    """

    name: str
    slacks: tuple[Slack, ...] = ()

    @abstractmethod
    def rows(self, pair: Pair, t: ca.SX) -> tuple[list[NamedBounds], ca.SX]:
        """Return the constraints that replace x y = 0, in addition to x >= 0 and y >= 0, and their values."""

    def penalty(self, pair: Pair, t: ca.SX) -> Any:
        """Return the penalty of a pair, in units of a typical objective; 0 by default.

        The reported objective of a relaxed solution does not include penalties.
        """
        return 0.0


def relax(relaxation: Relaxation, pairs: list[Pair], t: ca.SX, typical: float) -> tuple[list[Row], ca.SX, ca.SX]:
    """Return rows, values and penalty of relaxed complementarity pairs.

    Parameters
    ----------
    relaxation : Relaxation
    pairs : list of Pair
        Pairs with their slacks, if the relaxation has any.
    t : SX
        Relaxation parameter.
    typical : float
        Size of a typical objective.
    """
    table: list[Row] = []
    values, penalty = [], ca.SX(1, 1)
    for pair in pairs:
        rows, value = relaxation.rows(pair, t)
        table.append(Row(Key(Kind.PAIR, pair.name), 0.0, np.inf))
        table += [Row(Key(Kind.RELAXATION, f"{pair.name}, {name}"), lower, upper) for name, lower, upper in rows]
        values += [pair.right, value]
        penalty += typical * relaxation.penalty(pair, t)
    return table, ca.vertcat(*values), penalty


@check_arguments
@dataclass(frozen=True)
class Scholtes(Relaxation):
    """x y <= t: the feasible set is widened, so that it has an interior.

    S. Scholtes, Convergence properties of a regularization scheme for mathematical programs with complementarity
    constraints, SIAM Journal on Optimization 11 (2001).

    Examples
    --------
    >>> Scholtes().name
    'scholtes'
    """

    name = "scholtes"

    def rows(self, pair: Pair, t: ca.SX) -> tuple[list[NamedBounds], ca.SX]:
        """Return x y - t <= 0."""
        return [("product", -np.inf, 0.0)], pair.left * pair.right - t


@check_arguments
@dataclass(frozen=True)
class FischerBurmeister(Relaxation):
    """x + y = sqrt(x^2 + y^2 + 2 t), which is x y = t with x, y > 0, in a well-scaled form.

    C. Kanzow, Some noninterior continuation methods for linear complementarity problems, SIAM Journal on Matrix
    Analysis and Applications 17 (1996).

    Examples
    --------
    >>> FischerBurmeister().name
    'fischer_burmeister'
    """

    name = "fischer_burmeister"

    def rows(self, pair: Pair, t: ca.SX) -> tuple[list[NamedBounds], ca.SX]:
        """Return the smoothed function, which must vanish."""
        x, y = pair.left, pair.right
        return [("Fischer-Burmeister function", 0.0, 0.0)], x + y - ca.sqrt(x**2 + y**2 + 2 * t)


@check_arguments
@dataclass(frozen=True)
class ExactPenalty(Relaxation):
    """x y / t added to the objective: an l1 penalty, exact once its weight 1 / t exceeds the multipliers.

    D. Ralph & S. Wright, Some properties of regularization and penalization schemes for MPECs, Optimization Methods and
    Software 19 (2004).

    Examples
    --------
    >>> ExactPenalty().name
    'l1_penalty'
    """

    name = "l1_penalty"

    def rows(self, pair: Pair, t: ca.SX) -> tuple[list[NamedBounds], ca.SX]:
        """Return no constraint rows; the product is only penalised in the objective."""
        return [], ca.SX(0, 1)

    def penalty(self, pair: Pair, t: ca.SX) -> ca.SX:
        """Return x y / t."""
        return pair.left * pair.right / t
