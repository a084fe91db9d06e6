"""Largest deviations of a replay from its plan."""

from attrs import field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.parameters import number_within


@check_arguments
@frozen(kw_only=True)
class Tolerances:
    """Largest deviations of a replay from the plan.

    Attributes
    ----------
    state : float
        Largest difference of the state after the touchdown (rad, rad/s, m/s).
    period : float [s]
    cost_of_transport : float
        Relative difference.
    energy : float
        Relative residual of the energy balance of the replay.

    Examples
    --------
    >>> Tolerances(state=1e-5).period
    1e-06
    """

    state: float = field(default=1e-6, validator=number_within(lower=0.0, infinite=True))
    period: float = field(default=1e-6, validator=number_within("s", lower=0.0, infinite=True))
    cost_of_transport: float = field(default=5e-3, validator=number_within(lower=0.0, infinite=True))
    energy: float = field(default=1e-8, validator=number_within(lower=0.0, infinite=True))
