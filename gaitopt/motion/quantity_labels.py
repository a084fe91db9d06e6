"""Labels of quantities in figures and pages: names with units; angles are shown in degrees."""

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.motion.printable import typeset_powers


def label_quantity(name: str, unit: str) -> str:
    """Return the label of a quantity: its name in words and its unit, which is deg for rad.

    Examples
    --------
    >>> label_quantity("peak_torque", "N m"), label_quantity("slope", "rad"), label_quantity("friction", "1")
    ('peak torque [N m]', 'slope [deg]', 'friction')
    """
    words = name.replace("_", " ")
    return words if unit in ("", "1") else f"{words} [{show_unit(unit)}]"


def show_unit(unit: str) -> str:
    """Return a unit as figures show it: deg for rad, and powers as superscripts.

    Examples
    --------
    >>> show_unit("rad"), show_unit("N^2 m^2 s")
    ('deg', 'N² m² s')
    """
    return "deg" if unit == "rad" else typeset_powers(unit)


def in_shown_unit(values: Array, unit: str) -> Array:
    """Return values in the unit in which they are shown: angles in degrees.

    Examples
    --------
    >>> in_shown_unit(np.array([np.pi]), "rad").tolist(), in_shown_unit(np.array([2.0]), "m").tolist()
    ([180.0], [2.0])
    """
    return np.degrees(values) if unit == "rad" else values


def state_value(value: float, unit: str) -> str:
    """Return a number with its unit for a sentence; an angle is stated in degrees as well.

    Examples
    --------
    >>> state_value(0.5, "m"), state_value(np.radians(2), "rad"), state_value(0.3, "1")
    ('0.5 m', '0.0349066 rad (2 deg)', '0.3')
    """
    degrees = f" ({np.degrees(value):.6g} deg)" if unit == "rad" else ""
    return f"{value:.6g}" + ("" if unit in ("", "1") else f" {unit}") + degrees
