"""A partially separable NLP: many instances of few small functions.

minimise    sum over blocks and instances of cost(w[columns], z)
subject to  lower <= g <= upper,  g[rows] += constraint(w[columns], z)

Each block is a small SX function of the few variables it touches.  Its Jacobian and Hessian are derived once, mapped
over its instances and scattered into the sparse derivatives of the whole.  The time to build the NLP depends on the
small functions and not on the number of intervals; its evaluation is as fast as that of a fully expanded problem.
"""

import functools
import operator
from collections.abc import Callable, Iterator, Mapping, Sequence

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.lazy import Deferred, LazyField, LazyRecord
from gaitopt.locks import ONE_AT_A_TIME, cached_property
from gaitopt.ocp.nlp.block import Block, BlockFunctions, derive_block, join_single_blocks
from gaitopt.ocp.nlp.layout import Index
from gaitopt.ocp.nlp.sparse_entries import Entries, scatter


class Derivatives(Mapping[str, ca.Function]):
    """The derivatives of an NLP as the Functions that its solvers accept, each built at its first use.

    Attributes
    ----------
    inputs : (x, z, lam_f, lam_g)
        Unknowns, data, and the multipliers of the objective and of the constraints.
    minimised : (f, gradient)
    constraints : (g, jacobian)
    hessian : callable
        Returns the upper triangle of the Hessian of the Lagrangian for expressions of both multipliers.
    """

    def __init__(
        self,
        inputs: tuple[ca.MX, ca.MX, ca.MX, ca.MX],
        minimised: tuple[ca.MX, ca.MX],
        constraints: tuple[ca.MX, ca.MX],
        hessian: Callable[[ca.MX | float, ca.MX], ca.MX],
    ) -> None:
        self.inputs, self.minimised, self.constraints, self.hessian = inputs, minimised, constraints, hessian
        self._built: dict[str, ca.Function] = {}

    def __getitem__(self, name: str) -> ca.Function:
        with ONE_AT_A_TIME:
            if name not in self._built:
                self._built[name] = self._build(name)
            return self._built[name]

    def _build(self, name: str) -> ca.Function:
        both, names = list(self.inputs[:2]), ["x", "p"]
        if name == "grad_f":
            return ca.Function("nlp_grad_f", both, list(self.minimised), names, ["f", "grad:f:x"])
        if name == "jac_g":
            return ca.Function("nlp_jac_g", both, list(self.constraints), names, ["g", "jac:g:x"])
        if name == "hess_lag":
            names += ["lam:f", "lam:g"]
            hessian = self.hessian(*self.inputs[2:])
            return ca.Function("nlp_hess_l", list(self.inputs), [hessian], names, ["triu:hess:gamma:x:x"])
        raise KeyError(name)

    def __iter__(self) -> Iterator[str]:
        return iter(("grad_f", "jac_g", "hess_lag"))

    def __len__(self) -> int:
        return 3


@dataclass(frozen=True, eq=False, kw_only=True)
class Nlp(LazyRecord):
    """The NLP as CasADi Functions, in the form a solver takes.

    Attributes
    ----------
    functions : dict
        ``x``, ``p``, ``f``, ``g`` expressions.
    derivatives : Derivatives
        ``grad_f``, ``jac_g``, ``hess_lag`` Functions.
    objective : (x, p) -> scalar
        The objective, without the penalties of a relaxation.
    n_variables, n_constraints : int
    typical : float
        Typical size of the objective, by which a solver scales it.
    smooth : bool
        Whether optima are smooth functions of the data; otherwise torques may switch on and off.
    dissect : bool
        Whether linear systems are ordered by nested dissection, which has less fill-in than minimum degree if every
        unknown is coupled to few others of its link and of its interval.
    independent : bool
        Whether constraint rows are known to be independent, so that the linear systems of a solver need no refinement.
    """

    functions: LazyField[dict[str, ca.MX]] = LazyField()
    derivatives: Derivatives
    objective: LazyField[ca.Function] = LazyField()
    n_variables: int
    n_constraints: int
    typical: float = 1.0
    smooth: bool = False
    dissect: bool = False
    independent: bool = False

    @cached_property
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
    dissect: bool = False,
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
    dissect : bool
        Whether linear systems are ordered by nested dissection.

    Returns
    -------
    Nlp
    """
    assembly = _Assembly(data.numel(), n_numbers, n_variables, n_constraints)
    for block in join_single_blocks(blocks):
        assembly.add(block, derive_block(block, data))
    return assembly.finish(typical, smooth=smooth, dissect=dissect)


class _Assembly:
    """Sums of the blocks so far, as expressions of the whole decision vector."""

    def __init__(self, n_shared: int, n_numbers: int, n_variables: int, n_constraints: int) -> None:
        self.x, self.z = ca.MX.sym("x", n_variables), ca.MX.sym("z", n_shared + n_numbers)
        self.shared = self.z[:n_shared]
        self.lam_f, self.lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", n_constraints)
        self.costs, self.penalties, self.gradients = list[ca.MX](), list[ca.MX](), list[ca.MX]()
        self.constraints, self.jacobian = Entries(), Entries()
        self._blocks: list[tuple[Block, BlockFunctions, ca.Function, list[ca.MX]]] = []

    def add(self, block: Block, functions: BlockFunctions) -> None:
        """Add the instances of a block."""
        local, count = [_reshape(self.x[_flat(block.columns)], block.columns.shape)], block.columns.shape[1]
        if block.symbols.numel():
            local.append(ca.DM(block.constants))
        if block.numbers.numel():
            local.append(_reshape(self.z[_flat(block.places)], block.places.shape))
        if functions.has_intermediates:
            local += _map(functions.definitions, count, [*local, self.shared])
        local.append(self.shared)
        self._blocks.append((block, functions, functions.hessian, local))
        rows, columns = functions.jacobian_entries
        values, slopes = _map(functions.jacobian, count, local)
        self.constraints.add(block.rows, np.zeros_like(block.rows), values)
        self.jacobian.add(block.rows[rows], block.columns[columns], slopes)
        if block.minimised is not None:
            cost, penalty, gradient = _map(functions.cost, count, local)
            self.costs.append(ca.sum2(cost))
            if block.penalty is not None:
                self.penalties.append(ca.sum2(penalty))
            self.gradients.append(scatter(_flat(block.columns), self.x.numel(), gradient.nz[:]))

    def hessian(self, lam_f: ca.MX | float, lam_g: ca.MX) -> ca.MX:
        """Return the upper triangle of the Hessian of the Lagrangian for multipliers of objective and constraints."""
        hessian, n = Entries(), self.x.numel()
        for block, functions, function, local in self._blocks:
            lam = _reshape(lam_g[_flat(block.rows)], block.rows.shape)
            (values,) = _map(function, block.columns.shape[1], [*local, lam, lam_f])
            entries = functions.hessian_entries
            rows, columns = (block.columns[part] for part in entries)
            hessian.add(np.minimum(rows, columns), np.maximum(rows, columns), values)
            # A pair of local variables that are the same unknown adds to the diagonal twice.
            pairs = (rows == columns) & np.not_equal(*entries)[:, None]
            twice = np.flatnonzero(pairs.ravel(order="F"))
            if twice.size:
                diagonal = rows.ravel(order="F")[twice]
                hessian.add(diagonal, diagonal, ca.vec(values)[twice.tolist()])
        return hessian.matrix((n, n))

    def finish(self, typical: float, *, smooth: bool, dissect: bool) -> Nlp:
        """Return the NLP."""
        x, z, n, m = self.x, self.z, self.x.numel(), self.lam_g.numel()
        g = self.constraints.vector(m)
        jac = self.jacobian.matrix((m, n))
        minimised = self._sum_costs(), ca.densify(_sum(self.gradients, n))  # Ipopt misreads a sparse gradient
        derivatives = Derivatives((x, z, self.lam_f, self.lam_g), minimised, (g, jac), self.hessian)
        return Nlp(
            functions=Deferred(self._functions),
            derivatives=derivatives,
            objective=Deferred(lambda: ca.Function("objective", [x, z], [_sum(self.costs)])),
            n_variables=n,
            n_constraints=m,
            typical=typical,
            smooth=smooth,
            dissect=dissect,
        )

    def _functions(self) -> dict[str, ca.MX]:
        """Return the expressions of the NLP; the constraints are evaluated without their derivatives."""
        g = Entries()
        for block, functions, _, local in self._blocks:
            (values,) = _map(functions.constraints, block.columns.shape[1], local)
            g.add(block.rows, np.zeros_like(block.rows), values)
        return {"x": self.x, "p": self.z, "f": self._sum_costs(), "g": g.vector(self.lam_g.numel())}

    def _sum_costs(self) -> ca.MX:
        """Return the sum of costs and penalties."""
        return _sum([*self.costs, *self.penalties])


def _sum(parts: Sequence[ca.MX], size: int = 1) -> ca.MX:
    """Return the sum of columns; no zeros are added, to save time."""
    return functools.reduce(operator.add, parts) if parts else ca.MX.zeros(size)


def _map(function: ca.Function, count: int, arguments: list[ca.MX | float]) -> list[ca.MX]:
    """Return the outputs of a Function for all instances of a block.

    Their arguments are side by side; a single column is common to all of them.
    """
    return list((function if count == 1 else function.map(count)).call(arguments))


def _reshape(column: ca.MX, shape: tuple[int, ...]) -> ca.MX:
    """Return a column as a table; a single column is not copied, to save time."""
    return column if shape[1] == 1 else ca.reshape(column, *shape)


def _flat(index: Index) -> list[int]:
    """Return indices instance by instance (column-major)."""
    return index.flatten(order="F").tolist()
