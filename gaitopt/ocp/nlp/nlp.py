"""A partially separable nonlinear programme: many instances of few small functions.

minimise    sum over blocks and instances of cost(w[columns], z)
subject to  lower <= g <= upper,  g[rows] += constraint(w[columns], z)

Each block is a small SX function of the few variables it touches.  Its Jacobian and Hessian are derived once, mapped
over its instances and scattered into the sparse derivatives of the whole.  Building costs what the small functions
cost, whatever the number of intervals, and evaluation runs at the speed of a fully expanded problem.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from gaitopt.ocp.nlp.layout import Index


@dataclass(frozen=True, eq=False, kw_only=True)
class Block:
    """A small function and where its instances live.

    Attributes
    ----------
    name : str
    variables : SX, shape (n, 1)
        Local variables.
    cost : SX or None
        Scalar added to the objective.
    constraints : SX, shape (m, 1)
        Added to the constraint rows; several blocks may add to the same row.
    columns : (n, instances) int array
        Position of the local variables in the decision vector.
    rows : (m, instances) int array
        Position of the constraints.
    """

    name: str
    variables: ca.SX
    cost: ca.SX | None = None
    constraints: ca.SX
    columns: Index
    rows: Index


@dataclass(frozen=True, eq=False)
class Nlp:
    """The programme as CasADi Functions, in the form an NLP solver takes.

    Attributes
    ----------
    functions : dict
        ``x``, ``p``, ``f``, ``g`` expressions.
    derivatives : dict
        ``grad_f``, ``jac_g``, ``hess_lag`` Functions.
    n_variables, n_constraints : int
    typical : float
        Size of the objective, by which a solver scales it.
    smooth : bool
        Whether optima are smooth functions of the data, as against such that switch on and off.
    """

    functions: dict[str, ca.MX]
    derivatives: dict[str, ca.Function]
    n_variables: int
    n_constraints: int
    typical: float = 1.0
    smooth: bool = False

    def solver(self, name: str, plugin: str, options: dict[str, object]) -> ca.Function:
        """Return a CasADi solver of the programme."""
        own = {**self.derivatives, "no_nlp_grad": True, "calc_lam_p": False}
        own |= {"print_time": False, "show_eval_warnings": False}
        return ca.nlpsol(name, plugin, self.functions, {**own, **options})


def assemble_nlp(
    blocks: Sequence[Block],
    data: ca.SX,
    n_variables: int,
    n_constraints: int,
    *,
    typical: float = 1.0,
    smooth: bool = False,
) -> Nlp:
    """Assemble blocks into one programme.

    Parameters
    ----------
    blocks : sequence of Block
    data : SX, shape (n_z, 1)
        The symbols shared by all blocks whose values are given at each solve.
    n_variables, n_constraints : int
        Sizes of the decision vector and of the constraint vector.
    typical : float
        Size of the objective.
    smooth : bool
        Whether optima are smooth functions of the data.

    Returns
    -------
    Nlp
    """
    x, z = ca.MX.sym("x", n_variables), ca.MX.sym("z", data.numel())
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", n_constraints)
    cost, gradient = ca.MX(0), ca.MX.zeros(n_variables)
    g_values, g_index, j_values, j_index, h_values, h_index = ([] for _ in range(6))
    for block in blocks:
        count = block.columns.shape[1]
        local = ca.reshape(x[_flat(block.columns)], block.columns.shape[0], count)
        block = _shared(block)
        g_values.append(_mapped(block, data, "g", [block.constraints])(local, z))
        g_index.append(_flat(block.rows))

        jacobian = ca.jacobian(block.constraints, block.variables)
        rows, columns = _triplets(jacobian.sparsity())
        j_values.append(_mapped(block, data, "j", [_nonzeros(jacobian)])(local, z))
        j_index.append((_flat(block.rows[rows]), _flat(block.columns[columns])))

        multipliers, weight = ca.SX.sym("m", block.constraints.numel()), ca.SX.sym("s")
        lagrangian = ca.dot(multipliers, block.constraints)
        if block.cost is not None:
            lagrangian += weight * block.cost
            slope = ca.gradient(block.cost, block.variables)
            value, slopes = _mapped(block, data, "c", [block.cost, ca.densify(slope)])(local, z)
            cost += ca.sum2(value)
            gradient += _scatter(_flat(block.columns), n_variables, ca.vec(slopes))
        hessian = ca.hessian(lagrangian, block.variables)[0]
        rows, columns = _triplets(hessian.sparsity())
        own = ca.Function(f"{block.name}_h", [block.variables, data, multipliers, weight], [_nonzeros(hessian)]).map(
            block.name + "_h_map", "serial", count, [1, 3], []
        )
        local_multipliers = ca.reshape(lam_g[_flat(block.rows)], block.rows.shape[0], count)
        h_values.append(own(local, z, local_multipliers, lam_f))
        h_index.append((_flat(block.columns[rows]), _flat(block.columns[columns])))

    g = _scatter(np.concatenate(g_index).tolist(), n_constraints, ca.vertcat(*map(ca.vec, g_values)))
    jac = _matrix(j_index, j_values, (n_constraints, n_variables), upper=False)
    hess = _matrix(h_index, h_values, (n_variables, n_variables), upper=True)
    derivatives = {
        "grad_f": ca.Function("nlp_grad_f", [x, z], [cost, gradient], ["x", "p"], ["f", "grad:f:x"]),
        "jac_g": ca.Function("nlp_jac_g", [x, z], [g, jac], ["x", "p"], ["g", "jac:g:x"]),
        "hess_lag": ca.Function(
            "nlp_hess_l", [x, z, lam_f, lam_g], [hess], ["x", "p", "lam:f", "lam:g"], ["triu:hess:gamma:x:x"]
        ),
    }
    return Nlp({"x": x, "p": z, "f": cost, "g": g}, derivatives, n_variables, n_constraints, typical, smooth)


def _shared(block: Block) -> Block:
    """Return the block with common subexpressions merged: cheap here, and all derivatives profit."""
    if block.cost is None:
        return replace(block, constraints=ca.cse(block.constraints))
    constraints, cost = ca.cse([block.constraints, block.cost])
    return replace(block, constraints=constraints, cost=cost)


def _mapped(block: Block, data: ca.SX, suffix: str, outputs: list[ca.SX]) -> ca.Function:
    """Return a function of (local variables, data), mapped over the instances; the data are shared."""
    name = f"{block.name}_{suffix}"
    return ca.Function(name, [block.variables, data], outputs).map(
        name + "_map", "serial", block.columns.shape[1], [1], []
    )


def _flat(index: Index) -> list[int]:
    """Return indices instance by instance (column-major)."""
    return index.flatten(order="F").tolist()


def _triplets(pattern: ca.Sparsity) -> tuple[list[int], list[int]]:
    rows, columns = pattern.get_triplet()
    return list(rows), list(columns)


def _nonzeros(matrix: ca.SX) -> ca.SX:
    return matrix.nz[:] if matrix.nnz() else ca.SX(0, 1)


def _scatter(index: Sequence[int], size: int, values: ca.MX) -> ca.MX:
    """Return the vector of `size` whose entry i sums the values with index i."""
    selection = ca.Sparsity.triplet(size, len(index), list(index), list(range(len(index))))
    return ca.DM(selection, 1.0) @ values


def _matrix(
    index: list[tuple[list[int], list[int]]], values: list[ca.MX], shape: tuple[int, int], *, upper: bool
) -> ca.MX:
    """Return the sparse matrix that sums the given entries (only its upper triangle if `upper`)."""
    rows = np.concatenate([np.asarray(r, dtype=np.int64) for r, _ in index])
    columns = np.concatenate([np.asarray(c, dtype=np.int64) for _, c in index])
    entries = ca.vertcat(*map(ca.vec, values))
    if upper:
        keep = np.flatnonzero(rows <= columns)
        rows, columns, entries = rows[keep], columns[keep], entries[keep.tolist()]
    key, position = np.unique(columns * shape[0] + rows, return_inverse=True)  # column-major, as CasADi stores
    pattern = ca.Sparsity.triplet(*shape, (key % shape[0]).tolist(), (key // shape[0]).tolist())
    return ca.MX(pattern, _scatter(position.tolist(), len(key), entries))
