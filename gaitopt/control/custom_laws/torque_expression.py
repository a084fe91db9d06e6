"""Torques that a custom law's function returns: evaluation, conversion to one vector, and checks."""

import traceback
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import casadi as ca
import numpy as np

from gaitopt.control.custom_laws.condition_continuity import STATE_INPUTS, has_continuous_conditions
from gaitopt.control.custom_laws.law_arguments import FeedbackPlan, FeedbackState
from gaitopt.control.signature import LawInputs
from gaitopt.errors import NAN_CAUSES, GaitoptError, InputError, suggest

FORM = "the torques by actuator, such as {'hip': plan.torque['hip'] - stiffness * error}"
"""What a custom law's function returns, for messages."""

JUMPS = {ca.OP_SIGN: "sign", ca.OP_FLOOR: "floor", ca.OP_CEIL: "ceil"}
"""Operations whose value jumps."""

COMPARISON, CONDITION = "a comparison of the state", "if_else with a condition on the state"

STATE_JUMPS = {
    ca.OP_LT: (COMPARISON, (0, 1)),
    ca.OP_LE: (COMPARISON, (0, 1)),
    ca.OP_EQ: (COMPARISON, (0, 1)),
    ca.OP_NE: (COMPARISON, (0, 1)),
    ca.OP_NOT: (CONDITION, (0,)),
    ca.OP_AND: (CONDITION, (0, 1)),
    ca.OP_OR: (CONDITION, (0, 1)),
    ca.OP_IF_ELSE_ZERO: (CONDITION, (0,)),
    ca.OP_FMOD: ("fmod of the state", (0, 1)),
    ca.OP_REMAINDER: ("remainder of the state", (0, 1)),
    ca.OP_COPYSIGN: ("copysign with the sign of the state", (1,)),
}
"""Operations whose value jumps if an operand of these numbers depends on the state; plans apply them to the time."""

TorqueFunction = Callable[..., Any]
"""Function (state, plan, **gains) of a custom law."""


def evaluate_torque(
    function: TorqueFunction,
    state: FeedbackState,
    plan: FeedbackPlan,
    gains: Mapping[str, ca.SX],
    actuators: tuple[str, ...],
) -> ca.SX:
    """Return the torques of a custom law's function, shape (n_u, 1); planned ones for actuators that are not named.

    Raises
    ------
    InputError
        If the function returns something else, or applies a function to an expression that does not accept it.
    """
    name = function.__name__
    try:
        with warnings.catch_warnings():  # CasADi converts functions of NumPy such as np.sin
            warnings.simplefilter("ignore", FutureWarning)
            made = function(state, plan, **gains)
    except InputError as error:  # such as a coordinate of another robot
        raise InputError(f"Law {name}: {error}") from error
    except GaitoptError:
        raise
    except Exception as error:
        _explain(function, error)
    if isinstance(made, Mapping):
        for actuator in made:
            if actuator not in actuators:
                raise InputError(
                    f"{name} returns a torque of {actuator!r}, which is not an actuator of the robot. "
                    f"{suggest(str(actuator), actuators)}"
                )
        entries = [made.get(actuator, _find_planned_torque(plan, actuator)) for actuator in actuators]
        return ca.vertcat(*[_number(name, *entry) for entry in zip(actuators, entries, strict=True)])
    return _vector(name, made, actuators)


def _find_planned_torque(plan: FeedbackPlan, actuator: str) -> ca.SX:
    return plan.torque[actuator] if plan.torque else ca.SX(0)


def _vector(name: str, made: Any, actuators: tuple[str, ...]) -> ca.SX:
    """Return a sequence or vector of torques as a column; raise InputError if it is not one number per actuator."""
    try:
        vector = ca.SX(made) if isinstance(made, ca.SX | ca.DM | np.ndarray) else ca.vertcat(*_items(made))
        vector = ca.SX(vector)
    except (NotImplementedError, TypeError, RuntimeError):
        kind = "nothing" if made is None else f"a {type(made).__name__}"
        raise InputError(f"{name} returns {kind}; it must return {FORM}.") from None
    if vector.numel() != len(actuators):
        raise InputError(
            f"{name} returns {vector.numel()} torque{'' if vector.numel() == 1 else 's'}, but the robot has "
            f"{len(actuators)} actuator{'' if len(actuators) == 1 else 's'} ({', '.join(actuators)}). Return {FORM}."
        )
    return ca.reshape(vector, -1, 1)


def _items(made: Any) -> Iterable[Any]:
    return made if isinstance(made, list | tuple) else [made]


def _number(name: str, actuator: str, value: Any) -> ca.SX:
    """Return the torque of one actuator; raise InputError if it is not one number or expression."""
    try:
        torque = ca.SX(value)
    except (NotImplementedError, TypeError, RuntimeError):
        raise InputError(
            f"{name} returns a {type(value).__name__} as the torque of {actuator!r}; accepted are a number or an "
            "expression of the entries of state and plan and of the gains."
        ) from None
    if torque.numel() != 1:
        raise InputError(f"{name} returns {torque.numel()} numbers as the torque of {actuator!r}; one is accepted.")
    return torque


def check_torque_expression(name: str, inputs: LawInputs, torque: ca.SX, actuators: tuple[str, ...]) -> None:
    """Raise InputError if a torque depends on other symbols, is not a number, or has an operation that jumps."""
    for actuator, entry in zip(actuators, ca.vertsplit(torque), strict=True):
        function = ca.Function("torque", [*inputs], [entry], {"allow_free": True})
        if function.has_free():
            raise InputError(
                f"The torque of {actuator!r} in {name} depends on the symbol {', '.join(function.get_free())}; "
                "accepted are the entries of state and plan, and gains, which are arguments with default values."
            )
        steps = range(function.n_instructions())
        codes = [function.instruction_id(step) for step in steps]
        constants = [function.instruction_constant(step) for step in steps if codes[step] == ca.OP_CONST]
        if np.any(np.isnan(constants)):
            raise InputError(f"The torque of {actuator!r} in {name} contains nan: {NAN_CAUSES}.")
        if not np.all(np.isfinite(constants)):
            raise InputError(
                f"The torque of {actuator!r} in {name} contains an infinite number, such as a division by 0 or inf."
            )
        jumps = [JUMPS[code] for code in codes if code in JUMPS] or _find_state_jumps(function, codes)
        if jumps and (jumps[0] in JUMPS.values() or not has_continuous_conditions(function)):
            raise InputError(
                f"The torque of {actuator!r} in {name} contains {jumps[0]}, which jumps; the derivatives of a law "
                "need a smooth torque. Use a smooth function such as casadi.tanh(x / width) in place of sign(x)."
            )


def _find_state_jumps(function: ca.Function, codes: Sequence[int]) -> list[str]:
    """Return the operations of a torque that jump at a state, in words."""
    depends, jumps = set[int](), []  # numbers of the intermediate values that depend on the state
    for step, code in enumerate(codes):
        sources, results = function.instruction_input(step), function.instruction_output(step)
        if code == ca.OP_OUTPUT:
            continue
        of_state = sources[0] in STATE_INPUTS if code == ca.OP_INPUT else not depends.isdisjoint(sources)
        text, operands = STATE_JUMPS.get(code, ("", ()))
        if any(sources[operand] in depends for operand in operands):
            jumps.append(text)
        for result in results:  # its place may have contained another value
            (depends.add if of_state else depends.discard)(result)
    return jumps


def _explain(function: TorqueFunction, error: Exception) -> NoReturn:
    """Raise InputError if the error is due to a function that does not accept expressions, otherwise the error."""
    text, name = str(error), function.__name__
    numpy_texts = ("__array_function__", "Implicit conversion of symbolic", "__array_ufunc__", "loop of ufunc")
    if "truth value" in text:
        reason = (
            "uses an expression as a condition (if, and, max, min or a comparison); its value is not known when the "
            "law is made. Use casadi.if_else for a condition on the time, otherwise casadi.fmax or casadi.fmin, or a "
            "smooth function such as casadi.tanh."
        )
    elif any(part in text for part in numpy_texts) or ("real number" in text and isinstance(error, TypeError)):
        reason = (
            "applies a function to an expression that accepts numbers only. Use that of casadi, such as casadi.sin, "
            "casadi.tanh or casadi.polyval."
        )
    else:
        raise error
    path = function.__code__.co_filename if hasattr(function, "__code__") else ""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == path]
    place = f"{name} ({Path(path).name}, line {lines[-1]})" if lines else name
    raise InputError(f"{place} {reason}") from error
