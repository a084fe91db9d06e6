"""Numbers of joints, by which a joint has the same colour in all panels of figures and reports."""

from collections.abc import Iterable


def number_joints(angles: Iterable[str], actuators: Iterable[str]) -> dict[str, int]:
    """Return a number for each name, from 0; an actuator with the name of an angle has its number.

    Parameters
    ----------
    angles, actuators : iterable of str

    Examples
    --------
    >>> number_joints(["torso", "knee"], ["hip", "knee"])
    {'torso': 0, 'knee': 1, 'hip': 2}
    """
    return {name: number for number, name in enumerate(dict.fromkeys([*angles, *actuators]))}
