"""Continuity of a torque whose conditions depend on the state, verified at the boundaries of the conditions."""

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from gaitopt.control.signature import INPUTS
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError

Vector = NDArray[np.float64]

STATE_INPUTS = (INPUTS.index("q"), INPUTS.index("v"))
"""Numbers of the inputs of a law that are the state of the robot."""

COMPARISONS = (ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE)
"""Operations that compare two numbers."""

CONDITIONALS = {ca.OP_NOT: (0,), ca.OP_AND: (0, 1), ca.OP_OR: (0, 1), ca.OP_IF_ELSE_ZERO: (0,)}
"""Operations of conditions, with the numbers of the operands that are conditions."""

JUMPING = (ca.OP_FMOD, ca.OP_REMAINDER, ca.OP_COPYSIGN)
"""Operations that jump at other values than those of a comparison."""

SAMPLES, LEAST_SAMPLES, ITERATIONS = 48, 8, 40
"""Random starts of each search for a boundary, the points of it that must be found, and the most steps of a search."""

SCALES = (0.1, 1.0, 10.0)
"""Standard deviations of the random states."""

ON_BOUNDARY, LARGEST_JUMP = 1e-11, 1e-7
"""Distance of the compared numbers on a boundary, and the largest jump of a continuous torque, both relative."""


@dataclass(frozen=True, eq=False)
class _SeparatedTorque:
    """A torque as a function of its comparisons: their differences, and the torque for given results.

    Attributes
    ----------
    differences : (inputs) -> differences (k,), and Jacobian with respect to the state (k, n_x)
    torque : (inputs, results) -> torque
    codes : tuple of int
        Operation of each comparison.
    """

    differences: ca.Function
    torque: ca.Function
    codes: tuple[int, ...]

    def results(self, differences: Vector) -> Vector:
        """Return the results of the comparisons, 0 or 1."""
        tests = {ca.OP_LT: np.less, ca.OP_LE: np.less_equal, ca.OP_EQ: np.equal, ca.OP_NE: np.not_equal}
        pairs = zip(self.codes, differences, strict=True)
        return np.array([float(tests[code](value, 0.0)) for code, value in pairs])


def has_continuous_conditions(function: ca.Function) -> bool:
    """Return whether a torque with conditions on the state is continuous.

    A torque is continuous if at the boundary of every condition, where the compared numbers are equal, it has the same
    value on both sides.  This is verified at random points of each boundary, and of each boundary close to every other
    one, so that the torque of each combination of conditions that occurs there is evaluated.

    Parameters
    ----------
    function : casadi.Function
        Function of the inputs of a law that returns a torque.

    Examples
    --------
    >>> from gaitopt.control.signature import law_inputs
    >>> from gaitopt.model import compass_biped
    >>> inputs = law_inputs(compass_biped())
    >>> x = inputs.q[0]
    >>> def verify(torque):
    ...     return has_continuous_conditions(ca.Function("torque", [*inputs], [torque]))
    >>> verify(ca.if_else(x > 0.2, x, 0.2)), verify(ca.if_else(x > 0.2, x, 0.0))
    (True, False)
    """
    conditions = _separate_conditions(function)
    if conditions is None:
        return False
    rng = np.random.default_rng(0)
    count = len(conditions.codes)
    return all(
        _is_continuous_at(function, conditions, number, other, rng) for number in range(count) for other in range(count)
    )


def _is_continuous_at(
    function: ca.Function, conditions: _SeparatedTorque, number: int, other: int, rng: np.random.Generator
) -> bool:
    """Return whether the torque is continuous at a boundary, close to another boundary if that is a different one."""
    points = 0
    for start in range(SAMPLES):
        inputs = [rng.normal(size=function.size_in(i)) for i in range(function.n_in())]
        for i in STATE_INPUTS:
            inputs[i] *= SCALES[start % len(SCALES)]
        targets = {number: 0.0} if other == number else {number: 0.0, other: rng.choice([-1.0, 1.0]) * 1e-3}
        differences = _find_boundary(conditions, inputs, targets)
        if differences is None:
            continue
        points += 1
        sides = []
        for result in (0.0, 1.0):
            results = conditions.results(differences)
            results[number] = result
            sides.append(float(conditions.torque(*inputs, results)))
        if not abs(sides[0] - sides[1]) <= LARGEST_JUMP * (1 + max(map(abs, sides))):
            return False
    return other != number or points >= LEAST_SAMPLES  # two boundaries need not meet


def _find_boundary(conditions: _SeparatedTorque, inputs: list[Any], targets: dict[int, float]) -> Vector | None:
    """Change the state of the inputs until some differences have their targets; return all differences, or None."""
    rows, sizes = list(targets), [inputs[i].shape[0] for i in STATE_INPUTS]
    required = np.array([*targets.values()])
    for _ in range(ITERATIONS):
        values, jacobian = (np.asarray(part, dtype=float) for part in conditions.differences(*inputs))
        differences, scale = values[:, 0], 1 + np.max(np.abs(values[:, 1:]), initial=0.0)
        error = differences[rows] - required
        if not np.all(np.isfinite(error)) or not np.all(np.isfinite(jacobian)):
            return None
        if np.max(np.abs(error)) <= ON_BOUNDARY * scale:
            return np.asarray(differences)
        change = np.linalg.lstsq(jacobian[rows], -error, rcond=None)[0]
        for i, part in zip(STATE_INPUTS, np.split(change, np.cumsum(sizes)[:-1]), strict=True):
            inputs[i] = inputs[i] + part[:, None]
    return None


def _separate_conditions(function: ca.Function) -> _SeparatedTorque | None:
    """Return the comparisons of the state in a torque; None if a jump of the torque has another reason."""
    inputs = [ca.SX.sym(f"input_{i}", *function.size_in(i)) for i in range(function.n_in())]
    replay = _TorqueReplay(function, inputs)
    if not replay.succeeded or not replay.compared:
        return None
    state = ca.vertcat(*[inputs[i] for i in STATE_INPUTS])
    pairs = ca.vertcat(*[ca.horzcat(one - other, one, other) for one, other in replay.compared])
    jacobian = ca.jacobian(pairs[:, 0], state)
    return _SeparatedTorque(
        ca.Function("differences", inputs, [ca.densify(pairs), ca.densify(jacobian)]),
        ca.Function("torque", [*inputs, ca.vertcat(*replay.results)], [replay.output]),
        tuple(replay.codes),
    )


class _TorqueReplay:
    """The instructions of a torque with a symbol for the result of each comparison of the state."""

    def __init__(self, function: ca.Function, inputs: Sequence[ca.SX]) -> None:
        self.compared: list[tuple[ca.SX, ca.SX]] = []
        self.results: list[ca.SX] = []
        self.codes: list[int] = []
        self.output = ca.SX(0)
        try:
            self._run(function, inputs)
            self.succeeded = True
        except InputError:
            self.succeeded = False

    def _run(self, function: ca.Function, inputs: Sequence[ca.SX]) -> None:
        values: dict[int, ca.SX] = {}
        kinds: dict[int, str] = {}  # "" if a value does not depend on the state, otherwise "number" or "condition"
        for step in range(function.n_instructions()):
            code, sources = function.instruction_id(step), function.instruction_input(step)
            targets = function.instruction_output(step)
            if code == ca.OP_OUTPUT:
                self.output = values[sources[0]]
            elif code == ca.OP_INPUT:
                values[targets[0]] = inputs[sources[0]].nz[sources[1]]
                kinds[targets[0]] = "number" if sources[0] in STATE_INPUTS else ""
            elif code == ca.OP_CONST:
                values[targets[0]], kinds[targets[0]] = ca.SX(function.instruction_constant(step)), ""
            else:
                operands, of = [values[i] for i in sources], [kinds[i] for i in sources]
                kind = _classify(code, of)
                values[targets[0]] = self._evaluate(code, operands, compares=code in COMPARISONS and any(of))
                kinds[targets[0]] = kind

    def _evaluate(self, code: int, operands: list[ca.SX], *, compares: bool) -> ca.SX:
        if not compares:
            return ca.SX.unary(code, *operands) if len(operands) == 1 else ca.SX.binary(code, *operands)
        if ca.depends_on(ca.vertcat(*operands), ca.vertcat(ca.SX(0, 1), *self.results)):
            raise InputError("a comparison depends on another one")
        self.compared.append((operands[0], operands[1]))
        self.results.append(ca.SX.sym(f"result_{len(self.results)}"))
        self.codes.append(code)
        return self.results[-1]


def _classify(code: int, kinds: Sequence[str]) -> str:
    """Return the kind of a result; InputError if the operation jumps at other values than those of a comparison."""
    if any(kinds) and code in JUMPING:
        raise InputError("an operation jumps")
    if any(kinds[operand] == "number" for operand in CONDITIONALS.get(code, ())):
        raise InputError("a condition is a number")
    if not any(kinds):
        return ""
    return "condition" if code in COMPARISONS or code in (ca.OP_NOT, ca.OP_AND, ca.OP_OR) else "number"
