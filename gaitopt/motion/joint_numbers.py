"""Numbers of joints, by which every figure and report gives a joint one colour in all its panels."""

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
