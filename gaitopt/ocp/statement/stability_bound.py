"""StabilityBound: bound on the spectral radius of the return map at the planned gait."""

import math

from attrs import field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.parameters import as_float, number_within, positive

LEAST_RADIUS = 0.02
"""Least bound of the spectral radius, by whose powers the coefficients of a polynomial are divided in the NLP: below
0.0022, its conditions are smaller than a solver's tolerance."""


@check_arguments
@frozen(kw_only=True)
class StabilityBound:
    """Bound on the largest modulus of the multipliers of a planned gait, and its weight in the objective.

    The multipliers are the eigenvalues of the exact derivative of the return map: the deviations of the motion in
    every phase, with the shifts of all events, are unknowns of the NLP.  The torques are functions of time, or with
    free gains those of the law  u = u_ref(t) - K (x - x_ref(t)),  x = (angles, foot speed, rates), see
    :func:`gaitopt.design.planned_law`.

    Attributes
    ----------
    radius : float
        Largest spectral radius, at least 0.02; ``inf`` if it has only a weight.
    weight : float
        Weight of the spectral radius in the objective, in the unit of the objective.
    gain_limit : float
        Largest absolute value of the entries of K (N m per rad, rad/s and m/s), which are optimised with the gait; with
        0, the torques do not depend on the state.

    Raises
    ------
    InputError
        If a value is outside its range, or neither a bound nor a weight is stated.

    Examples
    --------
    >>> StabilityBound(radius=0.5).gain_limit
    0.0
    """

    radius: float = field(default=math.inf, converter=as_float, validator=positive(infinite=True))
    weight: float = field(default=0.0, converter=as_float, validator=number_within(lower=0))
    gain_limit: float = field(default=0.0, converter=as_float, validator=number_within(lower=0))

    def __attrs_post_init__(self) -> None:
        if self.radius < LEAST_RADIUS:
            raise InputError(f"radius of StabilityBound must be at least {LEAST_RADIUS:g}, got {self.radius:g}.")
        if math.isinf(self.radius) and self.weight == 0:
            raise InputError("StabilityBound needs a finite radius, or a weight greater than 0.")
