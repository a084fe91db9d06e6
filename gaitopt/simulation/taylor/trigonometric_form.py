"""Trigonometric normal form of the equations of motion, with fewer products.

The mass matrix M(q) and the bias h(q, v) of a linkage are sums of *harmonics*, cosines and sines of integer
combinations of the angles, times coefficients that depend on parameters only and, in h, products of two rates:

    M_ij = sum_w a_ijw w(q),    h_i = sum_w w(q) (b_iw + sum_jk c_iwjk v_j v_k)

A derivation body by body yields many more products, which cancel or add up to constants.  Least squares at random
angles identifies the harmonics, and their coefficients are solved for at as many angles as there are harmonics.
"""

import functools
import itertools
from collections import defaultdict
from collections.abc import Sequence

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.locks import one_at_a_time
from gaitopt.model.assembly import contact_functions
from gaitopt.model.robot import Robot

FIT_TOLERANCE = 1e-10
"""Values below this fraction of the largest one count as rounding."""


@dataclass(frozen=True, order=True)
class Harmonic:
    """The cosine or sine of an integer combination of coordinates; the constant 1 if all integers are zero."""

    integers: tuple[int, ...]
    sine: bool

    def evaluate(self, q: np.ndarray) -> np.ndarray:
        """Return the values at configurations, one per row."""
        return np.asarray((np.sin if self.sine else np.cos)(q @ np.array(self.integers)))

    def to_expression(self, q: ca.SX) -> ca.SX:
        """Return the harmonic as an expression."""
        angle = sum((k * q[i] for i, k in enumerate(self.integers) if k), ca.SX(0))
        return ca.sin(angle) if self.sine else ca.cos(angle)


Terms = dict[Harmonic, ca.SX]


@functools.lru_cache(maxsize=32)
@one_at_a_time
def to_trigonometric_form(robot: Robot) -> Robot:
    """Return a robot with fewer products in `acceleration` and `wellposed`, or the same if no harmonics fit.

    Examples
    --------
    >>> from gaitopt import Mode, compass_biped
    >>> robot = compass_biped()
    >>> q, v, u, p = [0, 0, 0.1, 0.2], [0, 0, 1, -1], [0, 0], robot.vector(robot.resolve({}))
    >>> pair = robot, to_trigonometric_form(robot)
    >>> [round(float(one.acceleration[Mode.STICK](q, v, u, p)[0][2]), 9) for one in pair]
    [2.688179332, 2.688179332]
    """
    harmonics = _fit_harmonics(robot)
    if harmonics is None:
        return robot
    q, v, p = robot.dynamics.sx_in()
    u, friction = ca.SX.sym("u", robot.n_u), p[robot.index("friction")]
    mass_matrix, bias = harmonics(q, v, p)
    drive = robot.dynamics(q, v, p)[2] @ u - bias
    acceleration, wellposed = contact_functions(q, v, u, p, lambda: (mass_matrix, drive), friction)
    return robot.replace_fields(acceleration=acceleration, wellposed=wellposed)


def _fit_harmonics(robot: Robot) -> ca.Function | None:
    """Return (q, v, p) -> mass matrix and bias as sums of harmonics, or None if harmonics do not fit."""
    q, v, p = robot.dynamics.sx_in()
    mass_matrix, bias, _ = robot.dynamics(q, v, p)
    n, rng = robot.n_q, np.random.default_rng(0)
    pairs = [(i, j) for i in range(n) for j in range(i, n)]
    hessians = [ca.hessian(bias[i], v)[0] for i in range(n)]
    parts = (
        [mass_matrix[i, j] for i, j in pairs],
        ca.vertsplit(ca.substitute(bias, v, ca.SX.zeros(n))),
        [hessian[i, j] / (2 if i == j else 1) for hessian in hessians for i, j in pairs],
    )
    fits = []
    for part in parts:
        fitted = _fit_terms(ca.Function("part", [q, p], ca.cse([ca.densify(ca.vertcat(*part))])), robot, rng)
        if fitted is None:
            return None
        fits.append(fitted)
    masses, weights, velocity_terms = fits
    matrix, rows = ca.SX.zeros(n, n), []
    for (i, j), terms in zip(pairs, masses, strict=True):
        matrix[i, j] = matrix[j, i] = _sum(terms, q)
    for i, weight in enumerate(weights):
        row = defaultdict(lambda: ca.SX(0), weight)
        for (j, k), curved in zip(pairs, velocity_terms[i * len(pairs) : (i + 1) * len(pairs)], strict=True):
            for harmonic, c in curved.items():
                row[harmonic] += c * (v[j] * v[k])
        rows.append(_sum(row, q))
    form = ca.Function("harmonics", [q, v, p], ca.cse([matrix, ca.vertcat(*rows)]))
    # The forms differ if a bias is not quadratic in the rates.
    points = [(*rng.uniform(-2, 2, (2, n)), _near_defaults(robot, rng)) for _ in range(3)]
    return form if all(_agree(form(*point), robot.dynamics(*point)[:2]) for point in points) else None


def _agree(matrices: Sequence[ca.DM], others: Sequence[ca.DM]) -> bool:
    """Return whether matrices agree up to rounding."""
    pairs = zip(map(np.asarray, matrices), map(np.asarray, others), strict=True)
    return all(bool(np.all(np.abs(one - other) <= FIT_TOLERANCE * np.abs(other).max())) for one, other in pairs)


def _sum(terms: Terms, q: ca.SX) -> ca.SX:
    return sum((c * harmonic.to_expression(q) for harmonic, c in sorted(terms.items())), ca.SX(0))


def _fit_terms(function: ca.Function, robot: Robot, rng: np.random.Generator) -> list[Terms] | None:
    """Return each entry of a Function of (q, p) as harmonics with coefficients, or None if harmonics do not fit."""
    harmonics = _list_candidates(function)
    p = function.sx_in()[1]
    points = rng.uniform(-3, 3, (2 * len(harmonics), robot.n_q))
    table = np.column_stack([harmonic.evaluate(points) for harmonic in harmonics])
    present = np.zeros((len(harmonics), function.numel_out(0)), dtype=bool)
    for _ in range(2):
        parameters = _near_defaults(robot, rng)
        values = np.array([np.asarray(function(point, parameters)).ravel() for point in points])
        coefficients = np.linalg.lstsq(table, values, rcond=None)[0]
        if not np.all(np.abs(table @ coefficients - values) <= FIT_TOLERANCE * np.abs(values).max()):
            return None
        present |= np.abs(coefficients) > np.maximum(
            FIT_TOLERANCE * np.abs(coefficients).max(axis=0), 1e-13 * np.abs(values).max()
        )
    terms: list[Terms] = [{}] * present.shape[1]
    for which in {tuple(np.flatnonzero(column)) for column in present.T} - {()}:
        chosen = _select_rows(table[:, which])
        inverse = ca.DM(np.linalg.inv(table[np.ix_(chosen, which)]))
        columns = [function(points[k], p) for k in chosen]
        for i in np.flatnonzero([tuple(np.flatnonzero(column)) == which for column in present.T]):
            solved = inverse @ ca.vertcat(*[column[int(i)] for column in columns])
            terms[i] = {harmonics[k]: solved[j] for j, k in enumerate(which)}
    return terms


def _select_rows(values: np.ndarray) -> np.ndarray:
    """Return as many rows of a matrix as it has columns, which differ most: those of a QR factorisation with pivoting.

    SciPy has this factorisation, but importing it takes as long as all else that precedes a simulation.
    """
    rest, chosen = values.copy(), list[int]()
    for _ in range(values.shape[1]):
        sizes = np.linalg.norm(rest, axis=1)
        chosen.append(int(np.flatnonzero(sizes >= (1 - 1e-9) * sizes.max())[0]))  # the first of equal ones
        direction = rest[chosen[-1]] / np.linalg.norm(rest[chosen[-1]])
        rest -= np.outer(rest @ direction, direction)
    return np.array(chosen)


def _list_candidates(function: ca.Function) -> list[Harmonic]:
    """Return the harmonics that products of two sines or cosines in a Function of (q, p) may contain."""
    q, _ = symbols = function.sx_in()
    results, angles = dict[int, ca.SX](), {(0,) * q.numel()}
    for k in range(function.n_instructions()):
        operation, sources = function.instruction_id(k), function.instruction_input(k)
        if operation == ca.OP_OUTPUT:
            continue
        if operation == ca.OP_INPUT:
            result = symbols[sources[0]].nz[sources[1]]
        elif operation == ca.OP_CONST:
            result = ca.SX(function.instruction_constant(k))
        else:
            arguments = [results[i] for i in sources]
            result = (ca.SX.unary if len(arguments) == 1 else ca.SX.binary)(operation, *arguments)
            if operation in (ca.OP_SIN, ca.OP_COS):
                slope = ca.jacobian(arguments[0], q)
                if slope.is_constant():
                    angles.add(tuple(np.rint(np.asarray(ca.DM(slope))).astype(int).ravel().tolist()))
        results[function.instruction_output(k)[0]] = result
    sums = {
        tuple(a + sign * b for a, b in zip(one, other, strict=True))
        for sign in (1, -1)
        for one, other in itertools.product(angles, angles)
    }
    forward = {max(one, tuple(-k for k in one)) for one in sums}  # one of two opposite combinations
    return [Harmonic(one, sine) for one in sorted(forward) for sine in (False, True) if any(one) or not sine]


def _near_defaults(robot: Robot, rng: np.random.Generator) -> np.ndarray:
    """Return random parameters near the defaults of a robot."""
    # Static friction, the last parameter, does not enter the equations of motion.
    p, factor = robot.vector(robot.resolve({})), np.append(rng.uniform(0.7, 1.3, len(robot.parameters) - 1), 1.0)
    return np.where(np.isfinite(p) & (p != 0), p * factor, factor)
