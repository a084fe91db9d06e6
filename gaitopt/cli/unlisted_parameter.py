"""Hint for a setting of a parameter that a robot has, but that the function of its script does not accept."""

from collections.abc import Callable
from typing import Any


def explain_unlisted_parameter(function: Callable[..., Any], name: str) -> str:
    """Return how a parameter of a script's robot is made settable; an empty text if the robot does not have it.

    Parameters
    ----------
    function : callable
        The function ``problem`` of the script, which is called with its defaults.
    name : str

    Examples
    --------
    >>> from gaitopt import GaitProblem, compass_biped
    >>> def problem():
    ...     return GaitProblem(
    ...         robot=compass_biped(), sequence="stick | stick", friction=0.14, speed=0.6, step_length=0.45
    ...     )
    >>> explain_unlisted_parameter(problem, "hip_mass")
    "'hip_mass' is a parameter of the robot: to set it, add the argument hip_mass=2 to problem() and pass \
parameters={'hip_mass': hip_mass} to GaitProblem."
    """
    try:
        stated = function()
        defaults = {parameter.name: parameter.default for parameter in stated.robot.parameters}
        value = {**defaults, **stated.parameters}[name]
    except Exception:  # the script is invalid, which its call reports, or states no robot with this parameter
        return ""
    passed = f"{name}={name}" if hasattr(stated, name) else f"parameters={{{name!r}: {name}}}"
    return (
        f"{name!r} is a parameter of the robot: to set it, add the argument {name}={value:g} to problem() and pass "
        f"{passed} to {type(stated).__name__}."
    )
