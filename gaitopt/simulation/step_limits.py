"""Limits that end the simulation of a step without a touchdown."""

from attrs import field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.parameters import positive, whole_number


@check_arguments
@frozen(kw_only=True)
class StepLimits:
    """Limits of one simulated step; a walk that reaches one ends with a named stop.

    Attributes
    ----------
    duration : float [s]
        Maximum time without a touchdown.
    events : int
        Maximum number of contact events, so that chattering ends.

    Raises
    ------
    InputError
        If the duration is not a positive number, or the number of events is not a positive whole number.

    Examples
    --------
    >>> from gaitopt import rimless_wheel, simulate
    >>> wheel, limits = rimless_wheel(), StepLimits(duration=0.5)
    >>> simulate(wheel, [0, 0, 0], [0, 0, 0], {"friction": 0.3}, step_limits=limits).stop.key
    'no_touchdown'
    """

    duration: float = field(default=10.0, validator=positive("s"))
    events: int = field(default=50, validator=whole_number())
