"""Blocks of an NLP: small functions of few variables, and their derivatives.

A block may contain intermediate quantities s = d(w), such as the states at the inner points of an interval, which are
simple functions of many of its variables w.  Its functions c(w, s) are differentiated with respect to w and s, in which
they are sparse, and the chain rule

    J = c_w + c_s S,    H = [I S'] (m c)'' [I; S] + (m c_s) d''    with S = d'

combines the results.  For collocation with many points this takes a third of the operations of a direct derivative.
"""

import functools
from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.layout import Index


@dataclass(frozen=True, eq=False, kw_only=True)
class Block:
    """A small function and the indices of its instances.

    Attributes
    ----------
    name : str
    variables : SX, shape (n, 1)
        Local variables.
    cost : SX or None
        Scalar added to the objective.
    penalty : SX or None
        Scalar that the solver minimises in addition, not part of the objective.
    constraints : SX, shape (m, 1)
        Added to the constraint rows; several blocks may add to the same row.
    columns : (n, instances) int array
        Indices of the local variables in the decision vector.
    rows : (m, instances) int array
        Indices of the constraint rows.
    symbols : SX, shape (k, 1)
        Symbols whose known values differ between the instances.
    constants : (k, instances) array
        Values of the symbols.
    numbers : SX, shape (l, 1)
        Symbols for data that differ between the instances.
    places : (l, instances) int array
        Indices of these data in the data vector.
    intermediates, definitions : SX, shape (i, 1)
        Symbols in cost, penalty and constraints that stand for functions of the local variables, and these functions.
    """

    name: str
    variables: ca.SX
    cost: ca.SX | None = None
    penalty: ca.SX | None = None
    constraints: ca.SX
    columns: Index
    rows: Index
    symbols: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    constants: Array = field(default_factory=lambda: np.empty((0, 0)))
    numbers: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    places: Index = field(default_factory=lambda: np.empty((0, 0), dtype=np.intp))
    intermediates: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    definitions: ca.SX = field(default_factory=lambda: ca.SX(0, 1))

    @property
    def minimised(self) -> ca.SX | None:
        """Cost and penalty."""
        return self.cost if self.penalty is None else self.penalty if self.cost is None else self.cost + self.penalty

    @property
    def inputs(self) -> list[ca.SX]:
        """Local variables, followed by the symbols of constants and of data that differ, if there are any."""
        return [self.variables, *(part for part in (self.symbols, self.numbers) if part.numel())]

    def merge_subexpressions(self) -> "Block":
        """Return the block with common subexpressions merged, before its derivatives are built."""
        names = ("constraints", "cost", "penalty", "definitions")
        parts = {name: part for name in names if (part := getattr(self, name)) is not None}
        return replace(self, **dict(zip(parts, ca.cse(list(parts.values())), strict=True)))

    def eliminate(self, expressions: list[ca.SX]) -> list[ca.SX]:
        """Return expressions as functions of the variables alone."""
        if not self.intermediates.numel():
            return expressions
        return ca.substitute(expressions, [self.intermediates], [self.definitions])

    @functools.cached_property
    def _all(self) -> ca.SX:
        return ca.vertcat(self.variables, self.intermediates)

    @functools.cached_property
    def _chain(self) -> ca.SX:
        """Derivative of variables and intermediates with respect to the variables."""
        identity = ca.SX.eye(self.variables.numel())
        return ca.vertcat(identity, ca.jacobian(self.definitions, self.variables))

    def jacobian(self) -> ca.SX:
        """Return the Jacobian of the constraints, shape (m, n), an expression with intermediates."""
        jacobian = ca.jacobian(self.constraints, self._all)
        return jacobian @ self._chain if self.intermediates.numel() else jacobian

    def gradient(self) -> ca.SX:
        """Return the gradient of what is minimised, shape (n, 1), an expression with intermediates."""
        gradient = ca.gradient(self.minimised, self._all)
        return self._chain.T @ gradient if self.intermediates.numel() else gradient

    def hessian(self, multipliers: ca.SX, weight: ca.SX) -> ca.SX:
        """Return the upper triangle of the Hessian of the Lagrangian, shape (n, n), an expression with intermediates.

        Parameters
        ----------
        multipliers : SX, shape (m, 1)
        weight : SX
            Factor of what is minimised.
        """
        lagrangian = ca.dot(multipliers, self.constraints)
        if self.minimised is not None:
            lagrangian += weight * self.minimised
        hessian, gradient = ca.hessian(lagrangian, self._all)
        if self.intermediates.numel():
            slopes = ca.SX.sym("slopes", self.intermediates.numel())
            curvature = ca.hessian(ca.dot(slopes, self.definitions), self.variables)[0]
            hessian = self._chain.T @ (hessian @ self._chain)
            hessian += ca.substitute(curvature, slopes, ca.densify(gradient[self.variables.numel() :]))
        return ca.triu(hessian)
