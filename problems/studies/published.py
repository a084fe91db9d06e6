"""Numbers beside published ones, with the tolerance their printed digits allow."""

import math

from gaitopt.study import PublishedValue

STUDY = "Gamus & Or 2015"
OWN = "own computation"
CLOSED_FORM = "closed form"


def published(name, value, printed, unit="1", source=STUDY):
    """Return ours beside a printed number; they agree within half a unit of its last digit.

    Parameters
    ----------
    name : str
    value : float
        Ours.
    printed : str
        The published number, digit by digit.
    unit, source : str

    Examples
    --------
    >>> published("speed", 0.8760312, "0.876031").agrees
    True
    """
    decimals = len(printed.partition(".")[2])
    tolerance = 0.5 * 10**-decimals if decimals else 0.0  # whole numbers are counts
    return PublishedValue(name, float(value), float(printed), tolerance, source, unit)


def energy_balance(name, cycle, mass):
    """Return the energy a passive gait loses over what gravity gives, m g L sin(alpha), which must be 1.

    Parameters
    ----------
    name : str
    cycle : Cycle
    mass : float
        Of the whole walker [kg].
    """
    given = mass * cycle.parameters["gravity"] * cycle.travel * math.sin(cycle.parameters["slope"])
    lost = cycle.energy.impact_loss + cycle.energy.friction_loss
    return PublishedValue(
        f"{name}: (impact + friction loss) / (m g L sin alpha)", lost / given, 1.0, 1e-9, "energy balance"
    )
