"""A partially separable NLP: many instances of few small functions.

minimise    sum over blocks and instances of cost(w[columns], z)
subject to  lower <= g <= upper,  g[rows] += constraint(w[columns], z)

Each block is a small SX function of the few variables it touches.  Its Jacobian and Hessian are derived once, mapped
over its instances and scattered into the sparse derivatives of the whole.  The time to build the NLP depends on the
small functions and not on the number of intervals; its evaluation is as fast as that of a fully expanded problem.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.layout import Index
from gaitopt.ocp.nlp.sparse_entries import Entries, scatter


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

    @property
    def minimised(self) -> ca.SX | None:
        """Cost and penalty."""
        return self.cost if self.penalty is None else self.penalty if self.cost is None else self.cost + self.penalty

    @property
    def inputs(self) -> list[ca.SX]:
        """Local variables, followed by the symbols of constants and of data that differ, if there are any."""
        return [self.variables, *(part for part in (self.symbols, self.numbers) if part.numel())]


@dataclass(frozen=True, eq=False)
class Nlp:
    """The NLP as CasADi Functions, in the form a solver takes.

    Attributes
    ----------
    functions : dict
        ``x``, ``p``, ``f``, ``g`` expressions.
    derivatives : dict
        ``grad_f``, ``jac_g``, ``hess_lag`` Functions.
    objective : (x, p) -> scalar
        The objective, without the penalties of a relaxation.
    n_variables, n_constraints : int
    typical : float
        Typical size of the objective, by which a solver scales it.
    smooth : bool
        Whether optima are smooth functions of the data; otherwise torques may switch on and off.
    """

    functions: dict[str, ca.MX]
    derivatives: dict[str, ca.Function]
    objective: ca.Function
    n_variables: int
    n_constraints: int
    typical: float = 1.0
    smooth: bool = False

    @functools.cached_property
    def values(self) -> ca.Function:
        """Function (x, p) -> minimised value and constraints, without derivatives."""
        x, p, f, g = (self.functions[name] for name in ("x", "p", "f", "g"))
        return ca.Function("nlp_fg", [x, p], [f, g])

    def solver(self, name: str, plugin: str, options: dict[str, object]) -> ca.Function:
        """Return a CasADi solver of the NLP."""
        fixed = {**self.derivatives, "no_nlp_grad": True, "calc_lam_p": False}
        fixed |= {"print_time": False, "show_eval_warnings": False}
        return ca.nlpsol(name, plugin, self.functions, {**fixed, **options})


def assemble_nlp(
    blocks: Sequence[Block],
    data: ca.SX,
    n_variables: int,
    n_constraints: int,
    *,
    n_numbers: int = 0,
    typical: float = 1.0,
    smooth: bool = False,
) -> Nlp:
    """Assemble blocks into one NLP.

    Parameters
    ----------
    blocks : sequence of Block
    data : SX, shape (n_z, 1)
        Symbols shared by all blocks; their values are data of a solve.
    n_variables, n_constraints : int
        Sizes of the decision vector and of the constraint vector.
    n_numbers : int
        Number of data after the shared ones, of which blocks take those of their instances.
    typical : float
        Size of the objective.
    smooth : bool
        Whether optima are smooth functions of the data.

    Returns
    -------
    Nlp
    """
    assembly = _Assembly(data.numel(), n_numbers, n_variables, n_constraints)
    for block in blocks:
        assembly.add(_merge_subexpressions(block), data)
    return assembly.finish(typical, smooth)


class _Assembly:
    """Sums of the blocks so far, as expressions of the whole decision vector."""

    def __init__(self, n_shared: int, n_numbers: int, n_variables: int, n_constraints: int) -> None:
        self.x, self.z = ca.MX.sym("x", n_variables), ca.MX.sym("z", n_shared + n_numbers)
        self.shared = self.z[:n_shared]
        self.lam_f, self.lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", n_constraints)
        self.cost, self.penalty, self.gradient = ca.MX(0), ca.MX(0), ca.MX.zeros(n_variables)
        self.constraints, self.jacobian, self.hessian = Entries(), Entries(), Entries()

    def add(self, block: Block, data: ca.SX) -> None:
        """Add the instances of a block."""
        count = block.columns.shape[1]
        local = [ca.reshape(self.x[_flat(block.columns)], block.columns.shape[0], count)]
        if block.symbols.numel():
            local.append(ca.DM(block.constants))
        if block.numbers.numel():
            local.append(ca.reshape(self.z[_flat(block.places)], *block.places.shape))
        local.append(self.shared)
        self.constraints.add(_flat(block.rows), [0], _map_block(block, data, "g", [block.constraints])(*local))
        jacobian = ca.jacobian(block.constraints, block.variables)
        rows, columns = _triplets(jacobian.sparsity())
        values = _map_block(block, data, "j", [_nonzeros(jacobian)])(*local)
        self.jacobian.add(_flat(block.rows[rows]), _flat(block.columns[columns]), values)
        if block.minimised is not None:
            self._add_cost(block, data, local)
        self._add_hessian(block, data, local)

    def _add_cost(self, block: Block, data: ca.SX, local: list[ca.MX]) -> None:
        if block.minimised is None:
            raise ValueError(f"block {block.name} has no cost")
        slope = ca.gradient(block.minimised, block.variables)
        parts = [ca.SX(0) if part is None else part for part in (block.cost, block.penalty)]
        cost, penalty, slopes = _map_block(block, data, "c", [*parts, ca.densify(slope)])(*local)
        self.cost += ca.sum2(cost)
        if block.penalty is not None:
            self.penalty += ca.sum2(penalty)
        self.gradient += scatter(_flat(block.columns), self.x.numel(), ca.vec(slopes))

    def _add_hessian(self, block: Block, data: ca.SX, local: list[ca.MX]) -> None:
        multipliers, weight = ca.SX.sym("m", block.constraints.numel()), ca.SX.sym("s")
        lagrangian = ca.dot(multipliers, block.constraints)
        if block.minimised is not None:
            lagrangian += weight * block.minimised
        hessian = ca.hessian(lagrangian, block.variables)[0]
        rows, columns = _triplets(hessian.sparsity())
        inputs, count = [*block.inputs, data, multipliers, weight], block.columns.shape[1]
        shared = [len(block.inputs), len(block.inputs) + 2]
        function = ca.Function(f"{block.name}_h", inputs, [_nonzeros(hessian)])
        curvature = function.map(f"{block.name}_h_map", "serial", count, shared, [])
        lam = ca.reshape(self.lam_g[_flat(block.rows)], block.rows.shape[0], count)
        values = curvature(*local, lam, self.lam_f)
        self.hessian.add(_flat(block.columns[rows]), _flat(block.columns[columns]), values)

    def finish(self, typical: float, smooth: bool) -> Nlp:
        """Return the NLP."""
        x, z, n, m = self.x, self.z, self.x.numel(), self.lam_g.numel()
        g = scatter(np.concatenate(self.constraints.rows).tolist(), m, ca.vertcat(*self.constraints.values))
        jac, hess = self.jacobian.matrix((m, n), upper=False), self.hessian.matrix((n, n), upper=True)
        f = self.cost + self.penalty
        derivatives = {
            "grad_f": ca.Function("nlp_grad_f", [x, z], [f, self.gradient], ["x", "p"], ["f", "grad:f:x"]),
            "jac_g": ca.Function("nlp_jac_g", [x, z], [g, jac], ["x", "p"], ["g", "jac:g:x"]),
            "hess_lag": ca.Function(
                "nlp_hess_l",
                [x, z, self.lam_f, self.lam_g],
                [hess],
                ["x", "p", "lam:f", "lam:g"],
                ["triu:hess:gamma:x:x"],
            ),
        }
        objective = ca.Function("objective", [x, z], [self.cost])
        return Nlp({"x": x, "p": z, "f": f, "g": g}, derivatives, objective, n, m, typical, smooth)


def _merge_subexpressions(block: Block) -> Block:
    """Return the block with common subexpressions merged, before its derivatives are built."""
    parts = {name: part for name in ("constraints", "cost", "penalty") if (part := getattr(block, name)) is not None}
    return replace(block, **dict(zip(parts, ca.cse(list(parts.values())), strict=True)))


def _map_block(block: Block, data: ca.SX, suffix: str, outputs: list[ca.SX]) -> ca.Function:
    """Return a function of (local variables, constants, data), mapped over the instances; the data are shared."""
    name = f"{block.name}_{suffix}"
    return ca.Function(name, [*block.inputs, data], outputs).map(
        name + "_map", "serial", block.columns.shape[1], [len(block.inputs)], []
    )


def _flat(index: Index) -> list[int]:
    """Return indices instance by instance (column-major)."""
    return index.flatten(order="F").tolist()


def _triplets(pattern: ca.Sparsity) -> tuple[list[int], list[int]]:
    rows, columns = pattern.get_triplet()
    return list(rows), list(columns)


def _nonzeros(matrix: ca.SX) -> ca.SX:
    return matrix.nz[:] if matrix.nnz() else ca.SX(0, 1)
