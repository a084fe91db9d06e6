"""Relaxations: how complementarity pairs are put to a solver for smooth programmes.

A pair asks for  0 <= x, 0 <= y, x y = 0.  Every relaxation has one number t > 0 that is data of the programme: the same
compiled programme serves a homotopy in which t falls, and for t -> 0 the pairs hold.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gaitopt.ocp.transcription.phase_dynamics import Row


@dataclass(frozen=True, eq=False)
class Pair:
    """Two quantities of which neither may be negative and one must vanish.

    Attributes
    ----------
    name : str
    left : SX, shape (1, 1)
        An unknown, whose own bound keeps it from being negative.
    right : SX, shape (1, 1)
        Any expression.
    """

    name: str
    left: ca.SX
    right: ca.SX


class Relaxation(ABC):
    """A way to relax complementarity pairs; derive from it to add one.

    Attributes
    ----------
    name : str
    """

    name: str

    @abstractmethod
    def rows(self, pair: Pair, t: ca.SX) -> tuple[list[Row], ca.SX]:
        """Return the constraints, besides x >= 0 and y >= 0, that stand for a pair, and their values."""

    def price(self, t: Any) -> Any:
        """Return what the product of a pair's sides adds to the objective, in units of a typical one; 0 by default."""
        return 0.0


def relax(relaxation: Relaxation, pairs: list[Pair], t: ca.SX, typical: float) -> tuple[list[Row], ca.SX, ca.SX]:
    """Return rows, values and cost that stand for complementarity pairs.

    Parameters
    ----------
    relaxation : Relaxation
    pairs : list of Pair
    t : SX
        The relaxation's parameter.
    typical : float
        Size of a typical objective.
    """
    table: list[Row] = []
    values, cost = [], ca.SX(1, 1)
    for pair in pairs:
        rows, value = relaxation.rows(pair, t)
        table.append((pair.name, 0.0, np.inf))
        table += [(f"{pair.name}, {name}", lower, upper) for name, lower, upper in rows]
        values += [pair.right, value]
        cost += typical * relaxation.price(t) * pair.left * pair.right
    return table, ca.vertcat(*values), cost


@dataclass(frozen=True)
class Scholtes(Relaxation):
    """x y <= t: the feasible set is widened, so that it has an inside.

    S. Scholtes, Convergence properties of a regularization scheme for mathematical programs with complementarity
    constraints, SIAM Journal on Optimization 11 (2001).

    Examples
    --------
    >>> Scholtes().name
    'scholtes'
    """

    name = "scholtes"

    def rows(self, pair: Pair, t: ca.SX) -> tuple[list[Row], ca.SX]:
        """Return x y - t <= 0."""
        return [("product", -np.inf, 0.0)], pair.left * pair.right - t


@dataclass(frozen=True)
class FischerBurmeister(Relaxation):
    """x + y = sqrt(x^2 + y^2 + 2 t), which is x y = t with x, y > 0, in a form that stays well scaled.

    C. Kanzow, Some noninterior continuation methods for linear complementarity problems, SIAM Journal on Matrix
    Analysis and Applications 17 (1996).

    Examples
    --------
    >>> FischerBurmeister().name
    'fischer_burmeister'
    """

    name = "fischer_burmeister"

    def rows(self, pair: Pair, t: ca.SX) -> tuple[list[Row], ca.SX]:
        """Return the smoothed function, which must vanish."""
        x, y = pair.left, pair.right
        return [("Fischer-Burmeister function", 0.0, 0.0)], x + y - ca.sqrt(x**2 + y**2 + 2 * t)


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

    def rows(self, pair: Pair, t: ca.SX) -> tuple[list[Row], ca.SX]:
        """Return nothing: the product is only dear."""
        return [], ca.SX(0, 1)

    def price(self, t: Any) -> Any:
        """Return 1 / t."""
        return 1 / t
