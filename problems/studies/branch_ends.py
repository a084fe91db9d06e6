"""Branches of gaits of one word, followed to their ends."""

from dataclasses import dataclass

from gaitopt import trace_branch

NEAR = 1e-3


@dataclass(frozen=True, eq=False)
class Stretch:
    """Gaits of one word over a parameter.

    Attributes
    ----------
    values : list of float
        The last one is the end of the stretch, within the tolerance it was located to.
    cycles : list of Cycle
    """

    values: list
    cycles: list

    @property
    def end(self):
        """The last value of the parameter."""
        return self.values[-1]


def follow(robot, start, parameter, values, tolerance=1e-6):
    """Follow a gait over the values of a parameter; locate by bisection where it, or its word, ends.

    Parameters
    ----------
    robot : Robot
    start : Cycle
        At the first value.
    parameter : str
    values : (K,) array
        Evenly spaced.
    tolerance : float
        To which an end before the last value is located.

    Returns
    -------
    Stretch
    """
    given = {name: value for name, value in start.parameters.items() if name != parameter}
    branch = trace_branch(robot, given, start, parameter, values, same_word=True, smallest_step=NEAR)
    found, cycles = branch.values.tolist(), list(branch.cycles)
    step = 0.0 if found[-1] == values[-1] else float(values[1] - values[0])
    if branch.ended.startswith("no gait"):  # located to this share of the spacing already
        step *= NEAR
    while abs(step) > tolerance:
        step /= 2
        further = [found[-1] + step]
        nearer = trace_branch(robot, given, cycles[-1], parameter, further, same_word=True, smallest_step=1.0)
        found += nearer.values.tolist()
        cycles += nearer.cycles
    return Stretch(found, cycles)
