"""Blocks of an NLP: small functions of few variables, and their derivatives.

A block may contain intermediate quantities s = d(w), such as the states at the inner points of an interval, which are
simple functions of many of its variables w.  Its functions c(w, s) are differentiated with respect to w and s, in which
they are sparse, and the chain rule

    J = c_w + c_s S,    H = [I S'] (m c)'' [I; S] + (m c_s) d''    with S = d'

combines the results.  For collocation with many points this takes a third of the operations of a direct derivative.
"""

import functools
import hashlib
from collections.abc import Sequence
from dataclasses import field, replace
from typing import Any

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.locks import cached_property
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.layout import Index

MANY, FEW = 3, 40
"""Number of variables, as a multiple of the median, beyond which a row is differentiated separately, and number of
variables of a block up to which all rows are differentiated together."""


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
    merged : bool
        Whether there are few common subexpressions, so that the search for them would take longer than they save.
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
    merged: bool = False

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
        if self.merged:
            return self
        names = ("constraints", "cost", "penalty", "definitions")
        parts = {name: part for name in names if (part := getattr(self, name)) is not None}
        return replace(self, **dict(zip(parts, ca.cse(list(parts.values())), strict=True)))


class BlockFunctions:
    """A block and its derivatives as Functions of the inputs of the block, its intermediates and the shared data.

    Parameters
    ----------
    block : Block
    data : SX
        Symbols shared by all blocks.
    """

    def __init__(self, block: Block, data: ca.SX) -> None:
        self._block, self._data = block, data
        self._inputs = [*block.inputs, *([block.intermediates] if self.has_intermediates else []), data]

    @property
    def has_intermediates(self) -> bool:
        """Whether there are intermediates, which are then an input of all Functions except :attr:`definitions`."""
        return self._block.intermediates.numel() > 0

    @cached_property
    def definitions(self) -> ca.Function:
        """Function of the inputs of the block and the shared data that returns the intermediates."""
        return ca.Function("definitions", [*self._block.inputs, self._data], [self._block.definitions])

    @cached_property
    def constraints(self) -> ca.Function:
        """Function that returns the constraints."""
        return ca.Function("constraints", self._inputs, [self._block.constraints])

    @cached_property
    def jacobian(self) -> ca.Function:
        """Function that returns the constraints and the nonzeros of their Jacobian."""
        return ca.Function("jacobian", self._inputs, [self._block.constraints, nonzeros(self._slopes)])

    @cached_property
    def cost(self) -> ca.Function:
        """Function that returns cost, penalty and the gradient of their sum."""
        parts = [ca.SX(0) if part is None else part for part in (self._block.cost, self._block.penalty)]
        gradient, count = ca.gradient(self._block.minimised, self._all), self._block.variables.numel()
        if self.has_intermediates:
            gradient = gradient[:count] if gradient[count:].is_zero() else self._chain.T @ gradient
        return ca.Function("cost", self._inputs, [*parts, densify(gradient)])

    @cached_property
    def hessian(self) -> ca.Function:
        """Function that returns the nonzeros of the upper triangle of the Hessian of the Lagrangian.

        Its further inputs are the multipliers of the constraints and the factor of what is minimised.
        """
        multipliers, weight = self._multipliers
        inputs = [*self._inputs, multipliers, weight]
        return ca.Function("hessian", inputs, [nonzeros(self._curvature)])

    @cached_property
    def jacobian_entries(self) -> tuple[list[int], list[int]]:
        """Rows and columns of the nonzeros of the Jacobian."""
        return _triplets(self._slopes.sparsity())

    @cached_property
    def hessian_entries(self) -> tuple[list[int], list[int]]:
        """Rows and columns of the nonzeros of the upper triangle of the Hessian."""
        return _triplets(self._curvature.sparsity())

    @cached_property
    def _all(self) -> ca.SX:
        return stack([self._block.variables, self._block.intermediates])

    @cached_property
    def _chain(self) -> ca.SX:
        """Derivatives of variables and intermediates with respect to the variables."""
        block = self._block
        return ca.vertcat(ca.SX.eye(block.variables.numel()), ca.jacobian(block.definitions, block.variables))

    @cached_property
    def _slopes(self) -> ca.SX:
        """Jacobian of the constraints, with intermediates."""
        jacobian = _differentiate_rows(self._block.constraints, self._all)
        return jacobian @ self._chain if self.has_intermediates else jacobian

    @cached_property
    def _multipliers(self) -> tuple[ca.SX, ca.SX]:
        return ca.SX.sym("m", self._block.constraints.numel()), ca.SX.sym("s")

    @cached_property
    def _curvature(self) -> ca.SX:
        """Upper triangle of the Hessian of the Lagrangian, with intermediates."""
        block, (multipliers, weight) = self._block, self._multipliers
        lagrangian = ca.dot(multipliers, block.constraints)
        if block.minimised is not None:
            lagrangian += weight * block.minimised
        hessian, gradient = ca.hessian(lagrangian, self._all)
        if self.has_intermediates:
            slopes = ca.SX.sym("slopes", block.intermediates.numel())
            second = ca.hessian(ca.dot(slopes, block.definitions), block.variables)[0]
            hessian = self._chain.T @ (hessian @ self._chain)
            hessian += ca.substitute(second, slopes, densify(gradient[block.variables.numel() :]))
        return ca.triu(hessian)


def _differentiate_rows(rows: ca.SX, variables: ca.SX) -> ca.SX:
    """Return the Jacobian of rows; a few rows that depend on many variables are differentiated separately.

    All rows together would need as many directional derivatives as the row with the most variables.
    """
    if variables.numel() <= FEW:
        return ca.jacobian(rows, variables)
    counts = np.bincount(ca.jacobian_sparsity(rows, variables).row(), minlength=rows.numel())
    many = counts > MANY * np.median(counts) if counts.size else counts > 0
    if not np.any(many):
        return ca.jacobian(rows, variables)
    order = [np.flatnonzero(part).tolist() for part in (~many, many)]
    parts = [ca.jacobian(rows[part], variables) for part in order]
    return ca.vertcat(*parts)[np.argsort(np.concatenate(order)).tolist(), :]


def join_single_blocks(blocks: Sequence[Block]) -> list[Block]:
    """Return blocks with those of a single instance joined to one, since the derivation of each block takes time."""
    single = [block for block in blocks if block.columns.shape[1] == 1]
    if len(single) < 2:
        return list(blocks)
    tables = ("columns", "rows", "constants", "places")
    stacked: dict[str, Any] = {name: np.vstack([getattr(b, name).reshape(-1, 1) for b in single]) for name in tables}
    expressions = ("variables", "constraints", "symbols", "numbers", "intermediates", "definitions")
    joined = {name: stack([getattr(block, name) for block in single]) for name in expressions}
    sums: dict[str, Any] = {}
    for name in ("cost", "penalty"):
        parts = [part for block in single if (part := getattr(block, name)) is not None]
        sums[name] = sum(parts, ca.SX(0)) if parts else None
    others = [block for block in blocks if block.columns.shape[1] > 1]
    return [*others, Block(name="single", **stacked, **joined, **sums, merged=all(b.merged for b in single))]


class _Expressions:
    """A block and the shared data, equal to others with the same expressions.

    The expressions are serialised only to compare blocks of equal size, since this takes long.
    """

    def __init__(self, block: Block, data: ca.SX) -> None:
        self.block, self.data = block, data

    @cached_property
    def _digest(self) -> str:
        block = self.block
        minimised = [ca.SX(0, 1) if part is None else part for part in (block.cost, block.penalty)]
        outputs = [block.constraints, block.definitions, *minimised]
        function = ca.Function("block", [*block.inputs, self.data, block.intermediates], outputs)
        return hashlib.sha256(function.serialize().encode()).hexdigest()

    def __hash__(self) -> int:
        block = self.block
        parts = (*block.inputs, self.data, block.intermediates, block.constraints)
        return hash((block.cost is None, block.penalty is None, *(part.numel() for part in parts)))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Expressions) and hash(self) == hash(other) and self._digest == other._digest


def derive_block(block: Block, data: ca.SX) -> BlockFunctions:
    """Return the Functions of a block; blocks with equal expressions share them, such as those of two grids."""
    return derive_expressions(_Expressions(block, data))


@functools.lru_cache(maxsize=128)
def derive_expressions(expressions: _Expressions) -> BlockFunctions:
    """Return the Functions of a block; those of the last blocks are kept."""
    return BlockFunctions(expressions.block.merge_subexpressions(), expressions.data)


def stack(parts: Sequence[ca.SX]) -> ca.SX:
    """Return stacked columns; empty columns are omitted, and a single one is not copied, to save time."""
    filled = [part for part in parts if part.numel()]
    return filled[0] if len(filled) == 1 else ca.vertcat(*filled) if filled else ca.SX(0, 1)


def densify(matrix: ca.SX) -> ca.SX:
    """Return a dense matrix; one that is dense already is not copied, to save time."""
    return matrix if matrix.is_dense() else ca.densify(matrix)


def nonzeros(matrix: ca.SX) -> ca.SX:
    """Return the nonzeros of a matrix as a column."""
    return matrix.nz[:] if matrix.nnz() else ca.SX(0, 1)


def _triplets(pattern: ca.Sparsity) -> tuple[list[int], list[int]]:
    rows, columns = pattern.get_triplet()
    return list(rows), list(columns)
