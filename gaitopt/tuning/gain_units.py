"""Units of the gains of the feedback laws of gaitopt."""

from collections.abc import Mapping

UNITS = {
    "joint_pd": {"stiffness": "N m/rad", "damping": "N m s/rad"},
    "computed_torque": {"stiffness": "1/s^2", "damping": "1/s"},
    "lqr": {"torque": "N m", "rate": "rad/s"},
    "step_lqr": {"torque": "N m", "rate": "rad/s"},
    "push_off": {"torque": "N m", "duration": "s"},
}
"""Units by controller family and last word of the gain; an actuator of a robot with several contacts may be a force."""


def format_gains(family: str, gains: Mapping[str, float], *, several_contacts: bool = False) -> str:
    """Return gains with their units as a text; those of custom laws have no units.

    Examples
    --------
    >>> format_gains("computed_torque", {"stiffness": 253.8, "damping": 30.68})
    'stiffness 253.8 1/s^2, damping 30.68 1/s'
    """
    units = {} if several_contacts else UNITS.get(family, {})
    texts = (f"{name} {value:.4g} {units.get(name.rpartition('_')[2], '')}" for name, value in gains.items())
    return ", ".join(text.rstrip() for text in texts)


def describe_gains(family: str) -> str:
    """Return the heading of tuned gains; those of LQR are the scales of its weights.

    Examples
    --------
    >>> describe_gains("lqr"), describe_gains("joint_pd")
    ('LQR weights (a deviation or torque of this size costs 1)', 'gains')
    """
    return "LQR weights (a deviation or torque of this size costs 1)" if family in ("lqr", "step_lqr") else "gains"


def tabulate_gains(family: str, text: str) -> tuple[str, str]:
    """Return the row of tuned gains in a table: its name, and the gains with what they mean.

    Examples
    --------
    >>> tabulate_gains("lqr", "torque 3.6 N m")
    ('LQR weights', 'torque 3.6 N m (a deviation or torque of this size costs 1)')
    """
    name, opening, meaning = describe_gains(family).partition(" (")
    return name, f"{text}{opening}{meaning}"
