"""Masses and inertias of a robot that could be negative for some values of its parameters."""

import math
from collections.abc import Mapping, Sequence

import casadi as ca

from gaitopt.errors import InputError
from gaitopt.parameters import Parameter, as_vector

NONNEGATIVE_OPERATIONS = (ca.OP_ADD, ca.OP_MUL, ca.OP_SQ, ca.OP_TWICE, ca.OP_OUTPUT)
"""Operations of CasADi whose results are finite and not negative if their operands are."""


def derive_inertias(
    robot: str, scalars: Mapping[str, ca.SX | float], symbols: ca.SX, parameters: Sequence[Parameter]
) -> ca.Function | None:
    """Return the masses and inertias as a Function of the parameters; None if none of them could be negative.

    Parameters
    ----------
    robot : str
    scalars : mapping of str to SX
        Scalar expressions by label; those of masses and inertias begin with "mass of" and "inertia of".
    symbols : SX
    parameters : sequence of Parameter
        In the order of the symbols.

    Returns
    -------
    Function or None
        One output for each mass or inertia that is an expression of parameters, such as ``mass_of_body_2``, unless sums
        and products of nonnegative parameters are its only operations.  An inertia that depends on coordinates is
        checked with the mass matrix.

    Raises
    ------
    InputError
        If one is negative, or not finite, with the default parameters, or a mass depends on coordinates.

    Examples
    --------
    >>> leg_mass = ca.SX.sym("leg_mass")
    >>> leg = Parameter("leg_mass", 3.0, "kg", "mass of a leg")
    >>> masses = {"mass of body 1": leg_mass, "mass of body 2": 8 - 2 * leg_mass}
    >>> derive_inertias("mule", masses, leg_mass, [leg]).name_out()
    ['mass_of_body_2']
    >>> derive_inertias("mule", {"mass of body 1": leg_mass}, leg_mass, [leg])
    """
    known = {symbol.element_hash() for symbol in symbols.elements()}
    free = {}
    for label, value in scalars.items():
        expression = ca.SX(value)
        if not label.startswith(("mass of", "inertia of")) or expression.is_constant():
            continue
        used = {symbol.element_hash() for symbol in ca.symvar(expression)}
        if not used <= known and label.startswith("mass of"):
            raise InputError(f"Robot {robot!r}: {label} must not depend on coordinates.")
        if used <= known:
            free[label.replace(" ", "_")] = expression
    free = {name: each for name, each in free.items() if not _is_nonnegative(each, symbols, parameters)}
    if not free:
        return None
    inertias = ca.Function("inertias", [symbols], list(free.values()), ["p"], list(free))
    defaults = {parameter.name: parameter.default for parameter in parameters}
    check_inertias(robot, inertias, parameters, defaults, "with the default parameters")
    return inertias


def _is_nonnegative(expression: ca.SX, symbols: ca.SX, parameters: Sequence[Parameter]) -> bool:
    """Return whether an expression has sums and products of nonnegative parameters and numbers only, or fractions."""
    steps, numbers = ca.Function("steps", [symbols], [expression]), set[int]()
    for step in range(steps.n_instructions()):
        operation, operands = steps.instruction_id(step), steps.instruction_input(step)
        if operation == ca.OP_CONST:
            valid = steps.instruction_constant(step) >= 0
        elif operation == ca.OP_INPUT:
            valid = parameters[operands[1]].lower >= 0
        else:
            valid = operation in NONNEGATIVE_OPERATIONS or (operation == ca.OP_DIV and operands[1] in numbers)
        if not valid:
            return False
        results = set(steps.instruction_output(step))  # places whose former contents are replaced
        numbers = numbers | results if operation == ca.OP_CONST else numbers - results
    return True


def check_inertias(
    robot: str,
    inertias: ca.Function | None,
    parameters: Sequence[Parameter],
    values: Mapping[str, float],
    condition: str = "",
) -> None:
    """Raise InputError if a mass or an inertia is negative or not finite.

    Parameters
    ----------
    robot : str
    inertias : Function or None
        That of :func:`derive_inertias`.
    parameters : sequence of Parameter
    values : mapping of str to float
        Values of all parameters.
    condition : str
        Origin of the values, for the message.

    Examples
    --------
    >>> leg_mass = ca.SX.sym("leg_mass")
    >>> leg = Parameter("leg_mass", 3.0, "kg", "mass of a leg")
    >>> inertias = derive_inertias("mule", {"mass of body 2": 8 - 2 * leg_mass}, leg_mass, [leg])
    >>> check_inertias("mule", inertias, [leg], {"leg_mass": 5.0})
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: Robot 'mule': mass of body 2 must not be negative [kg], got -2 for leg_mass = 5 kg.
    """
    if inertias is None:
        return
    numbers = inertias.call([as_vector(tuple(parameters), values)])
    for place, number in enumerate(map(float, numbers)):
        if 0 <= number < math.inf:
            continue
        what = inertias.name_out(place).replace("_", " ")
        used = _list_dependences(inertias, place, parameters)
        stated = ", ".join(f"{each.name} = {values[each.name]:g}{_unit(each.unit)}" for each in used)
        unit = "kg" if what.startswith("mass") else "kg m^2"
        fault = "must not be negative" if number < 0 else "must be finite"
        origin = f"{condition} ({stated})" if condition else f"for {stated}"
        raise InputError(f"Robot {robot!r}: {what} {fault} [{unit}], got {number:g} {origin}.")


def _list_dependences(inertias: ca.Function, place: int, parameters: Sequence[Parameter]) -> list[Parameter]:
    """Return the parameters on which an output depends."""
    columns = inertias.jac_sparsity(place, 0).get_col()
    return [parameters[column] for column in columns]


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"
