"""Titles of figures over parameters: the robot, its slope and friction, and parameters that are not the defaults."""

import math
import textwrap
from collections.abc import Collection, Mapping

from gaitopt.errors import InputError
from gaitopt.model.robots.catalogue import robot_named
from gaitopt.motion.quantity_labels import show_unit
from gaitopt.plot.legends import NO_BREAK

LINE, MOST_LINES, LETTERS_PER_INCH = 58, 3, 13.5
"""Largest numbers of characters of a line of the changed parameters, and of such lines, beyond which the parameters are
counted; characters per inch."""


def describe_model(
    robot: str,
    parameters: Mapping[str, float],
    width: float,
    *,
    varied: Collection[str] = (),
    facts: Collection[str] = (),
) -> str:
    r"""Return a title: the robot, slope, friction and further facts, and in lines below what is not the default.

    Parameters
    ----------
    robot : str
    parameters : mapping of str to float [SI, rad]
    width : float [inch]
        Width of the page.
    varied : collection of str
        Parameters that are axes of the figure, which are not stated.
    facts : collection of str
        Further facts, such as the speed.

    Examples
    --------
    >>> print(describe_model("compass_biped", {"slope": 0.05, "friction": 0.2, "hip_mass": 12.0}, 7.2))
    compass biped, slope 2.865 deg, friction $\mu$ = 0.2
    hip mass 12 kg
    """
    stated = [robot.replace("_", " ")]
    if "slope" in parameters and "slope" not in varied:
        stated.append(f"slope {math.degrees(parameters['slope']):.4g} deg")
    if "friction" in parameters and "friction" not in varied:
        friction = parameters["friction"]
        stated.append(rf"friction $\mu$ = {friction:.4g}" if math.isfinite(friction) else "infinite friction")
    letters = int(LETTERS_PER_INCH * width)
    text = ", ".join(fact.replace(" ", NO_BREAK) for fact in [*stated, *facts])
    changes = _describe_changes(robot, parameters, varied, min(LINE, letters))
    return textwrap.fill(text, letters).replace(NO_BREAK, " ") + (f"\n{changes}" if changes else "")


def _describe_changes(robot: str, parameters: Mapping[str, float], varied: Collection[str], letters: int) -> str:
    """Return the parameters of a robot of the catalogue that are not the defaults, in lines; their number if many."""
    try:
        known = robot_named(robot).parameters
    except InputError:  # a custom robot
        return ""
    changed = [
        each
        for each in known
        if each.name not in ("slope", "friction", *varied)
        and not math.isclose(parameters.get(each.name, each.default), each.default, rel_tol=1e-12)
    ]
    units = ["" if each.unit == "1" else show_unit(each.unit) for each in changed]
    changes = [
        f"{each.name.replace('_', ' ')} {parameters[each.name]:.4g} {unit}"
        for each, unit in zip(changed, units, strict=True)
    ]
    text = ", ".join(change.rstrip().replace(" ", NO_BREAK) for change in changes)
    lines = textwrap.wrap(text, letters)
    if len(lines) > MOST_LINES:
        return f"{len(changes)} parameters are not the defaults"
    return "\n".join(lines).replace(NO_BREAK, " ")
