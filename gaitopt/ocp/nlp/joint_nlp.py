"""Several NLPs as one: they share some unknowns, and their objectives are summed or the largest is minimised.

The Functions of each NLP are called, not derived again, so that NLPs of equal structure are built once and the time of
an evaluation grows linearly with their number.
"""

import functools
import itertools

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.lazy import Deferred
from gaitopt.locks import cached_property
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.layout import Index
from gaitopt.ocp.nlp.nlp import Derivatives, Nlp
from gaitopt.ocp.nlp.sparse_entries import Entries, scatter

SHARE_OF_SUM = 1e-4
"""Share of the weighted sum that is added to the largest objective, so that all gaits are determined."""


@dataclass(frozen=True)
class JointLayout:
    """Places of several NLPs in one: first the shared unknowns, then the largest objective, then all others.

    Attributes
    ----------
    nlps : tuple of Nlp
    shared : tuple of tuple of int
        For each NLP the indices of the shared unknowns in its decision vector.
    worst_case : bool
        Whether the largest weighted objective is minimised instead of the weighted sum, with a small share of the sum.
    """

    nlps: tuple[Nlp, ...]
    shared: tuple[tuple[int, ...], ...]
    worst_case: bool = False

    @property
    def n_shared(self) -> int:
        """Number of shared unknowns."""
        return len(self.shared[0])

    @cached_property
    def columns(self) -> tuple[Index, ...]:
        """Indices of the unknowns of each NLP in the joint decision vector."""
        first, columns = self.n_shared + self.worst_case, []
        for nlp, shared in zip(self.nlps, self.shared, strict=True):
            column = np.empty(nlp.n_variables, dtype=np.intp)
            others = np.setdiff1d(np.arange(nlp.n_variables), shared)
            column[list(shared)], column[others] = np.arange(len(shared)), first + np.arange(others.size)
            columns.append(column)
            first += others.size
        return tuple(columns)

    @property
    def n_variables(self) -> int:
        """Size of the joint decision vector."""
        return self.n_shared + self.worst_case + sum(nlp.n_variables - self.n_shared for nlp in self.nlps)

    @cached_property
    def rows(self) -> tuple[Index, ...]:
        """Indices of the constraint rows of each NLP in the joint ones; rows on the largest objective are the last."""
        ends = np.cumsum([0, *(nlp.n_constraints for nlp in self.nlps)])
        return tuple(np.arange(first, last) for first, last in itertools.pairwise(ends))

    @cached_property
    def data(self) -> tuple[slice, ...]:
        """Parts of the joint data that are those of each NLP; the weights follow."""
        ends = np.cumsum([0, *(nlp.derivatives["grad_f"].size1_in(1) for nlp in self.nlps)])
        return tuple(slice(int(first), int(last)) for first, last in itertools.pairwise(ends))

    def gather(self, vectors: list[Array]) -> Array:
        """Return a joint vector of unknowns; of the shared ones, those of the first NLP."""
        joint = np.zeros(self.n_variables)
        for columns, vector in zip(self.columns[::-1], vectors[::-1], strict=True):
            joint[columns] = vector
        return joint


@functools.lru_cache(maxsize=8)
def join_nlps(layout: JointLayout) -> Nlp:
    """Return several NLPs as one.

    Its data are those of each NLP and their weights.  In the worst case, there is a further row for each NLP, unknown -
    weight objective, which must be at least 0.

    Parameters
    ----------
    layout : JointLayout

    Returns
    -------
    Nlp
    """
    return _JointAssembly(layout).finish()


class _JointAssembly:
    """Expressions of the joint NLP."""

    def __init__(self, layout: JointLayout) -> None:
        self.layout, count = layout, len(layout.nlps)
        self.m = layout.rows[-1][-1] + 1 + count * layout.worst_case
        self.x, self.z = ca.MX.sym("x", layout.n_variables), ca.MX.sym("z", layout.data[-1].stop + count)
        self.lam_f, self.lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", self.m)
        self.cost, self.gradient = ca.MX(0), ca.MX.zeros(layout.n_variables)
        self.constraints, self.jacobian = Entries(), Entries()
        for i in range(count):
            self._add(i)
        if layout.worst_case:
            self.cost += self.x[layout.n_shared]
            self.gradient += scatter([layout.n_shared], layout.n_variables, ca.MX(1))

    def _arguments(self, i: int) -> tuple[ca.MX, ca.MX, ca.MX]:
        """Return unknowns, data and weight of an NLP."""
        layout = self.layout
        data = layout.data[i]
        weight = self.z[layout.data[-1].stop + i]
        return self.x[layout.columns[i].tolist()], self.z[data.start : data.stop], weight

    def _add(self, i: int) -> None:
        layout = self.layout
        nlp, columns, rows = layout.nlps[i], layout.columns[i], layout.rows[i]
        x, z, weight = self._arguments(i)
        f, gradient = nlp.derivatives["grad_f"](x, z)
        g, jacobian = nlp.derivatives["jac_g"](x, z)
        self.constraints.add(rows, np.zeros_like(rows), g)
        at, of = (np.array(part, dtype=np.intp) for part in jacobian.sparsity().get_triplet())
        self.jacobian.add(rows[at], columns[of], jacobian.nz[:])
        part = SHARE_OF_SUM * weight if layout.worst_case else weight
        self.cost += part * f
        self.gradient += scatter(columns.tolist(), layout.n_variables, part * gradient)
        if layout.worst_case:
            self._bound_objective(i, self._worst_row(i), weight * f, weight * gradient)

    def _worst_row(self, i: int) -> int:
        """Return the row: largest objective - weighted objective of an NLP."""
        return self.m - len(self.layout.nlps) + i

    def _hessian(self, lam_f: ca.MX, lam_g: ca.MX) -> ca.MX:
        """Return the upper triangle of the Hessian of the Lagrangian."""
        layout, entries = self.layout, Entries()
        for i, (nlp, columns, rows) in enumerate(zip(layout.nlps, layout.columns, layout.rows, strict=True)):
            x, z, weight = self._arguments(i)
            factor = (SHARE_OF_SUM * weight if layout.worst_case else weight) * lam_f
            if layout.worst_case:
                factor -= weight * lam_g[self._worst_row(i)]
            (hessian,) = nlp.derivatives["hess_lag"].call([x, z, factor, lam_g[rows.tolist()]])
            at, of = (np.array(part, dtype=np.intp) for part in hessian.sparsity().get_triplet())
            pair = np.array([columns[at], columns[of]])
            entries.add(pair.min(axis=0), pair.max(axis=0), hessian.nz[:])
        return entries.matrix((layout.n_variables, layout.n_variables))

    def _bound_objective(self, i: int, row: int, value: ca.MX, gradient: ca.MX) -> None:
        """Add the row: largest objective - weighted objective."""
        layout, nlp = self.layout, self.layout.nlps[i]
        f, x = nlp.functions["f"], nlp.functions["x"]
        places = np.array(ca.jacobian_sparsity(f, x).get_triplet()[1], dtype=np.intp)
        first = np.array([row])
        self.constraints.add(first, np.zeros(1, dtype=np.intp), self.x[layout.n_shared] - value)
        self.jacobian.add(np.full(places.size, row), layout.columns[i][places], -gradient[places.tolist()])
        self.jacobian.add(first, np.array([layout.n_shared]), ca.MX(1))

    def finish(self) -> Nlp:
        """Return the NLP."""
        x, z, n, m = self.x, self.z, self.layout.n_variables, self.m
        g, jacobian = self.constraints.vector(m), self.jacobian.matrix((m, n))
        inputs = x, z, self.lam_f, self.lam_g
        derivatives = Derivatives(inputs, (self.cost, self.gradient), (g, jacobian), self._hessian)
        return Nlp(
            functions=Deferred(self._functions),
            derivatives=derivatives,
            objective=Deferred(lambda: ca.Function("objective", [x, z], [self.cost])),
            n_variables=n,
            n_constraints=m,
            typical=self.layout.nlps[0].typical,
        )

    def _functions(self) -> dict[str, ca.MX]:
        """Return the expressions of the NLP; objective and constraints are evaluated without their derivatives."""
        layout, objectives, rows = self.layout, list[ca.MX](), list[ca.MX]()
        for i, nlp in enumerate(layout.nlps):
            x, z, weight = self._arguments(i)
            f, g = nlp.values(x, z)
            objectives.append(weight * f)
            rows.append(g)
        if layout.worst_case:
            largest = self.x[layout.n_shared]
            rows += [largest - f for f in objectives]
            objectives = [largest, *(SHARE_OF_SUM * f for f in objectives)]
        return {"x": self.x, "p": self.z, "f": sum(objectives, ca.MX(0)), "g": ca.vertcat(*rows)}
