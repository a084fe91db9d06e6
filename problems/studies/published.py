"""Comparison with published numbers, with the tolerance implied by their printed digits."""

import math

from gaitopt.study import PublishedValue

STUDY = "Gamus & Or 2015"
OWN = "independent computation"
CLOSED_FORM = "closed form"


def check_value(name, value, printed, unit="1", source=STUDY):
    """Return a computed value with a published number; they agree within half a unit of its last digit.

    Parameters
    ----------
    name : str
    value : float
        Computed value.
    printed : str
        The published number as printed.
    unit, source : str

    Examples
    --------
    >>> check_value("speed", 0.8760312, "0.876031").agrees
    True
    """
    decimals = len(printed.partition(".")[2])
    tolerance = 0.5 * 10**-decimals if decimals else 0.0  # whole numbers are counts
    return PublishedValue(name, float(value), float(printed), tolerance, source, unit)


OPTIMA = {"stick | stick": 0.0162508, "slip+ stick | slip+": 0.0158511}
"""Cost of transport by contact sequence: level ground, 0.633 m/s, 0.4713 m, friction 0.14, torques within 6 N m.

Another transcription with 80 intervals: tests/references/compass_optimum.py.
"""


def check_optimum(name, value, reference, tolerance=1e-3):
    """Return an optimal cost with that of another optimiser.

    Parameters
    ----------
    name : str
    value, reference : float
    tolerance : float
        Relative error of the two grids together.
    """
    return PublishedValue(name, float(value), reference, tolerance * reference, f"{OWN}, to {100 * tolerance:g} %")


def energy_balance(name, cycle, mass):
    """Return the energy loss of a passive gait divided by the work of gravity, m g L sin(alpha), which must be 1.

    Parameters
    ----------
    name : str
    cycle : Cycle
    mass : float
        Total mass of the walker [kg].
    """
    gravity_work = mass * cycle.parameters["gravity"] * cycle.travel * math.sin(cycle.parameters["slope"])
    loss = cycle.energy.impact_loss + cycle.energy.friction_loss
    return PublishedValue(
        f"{name}: (impact + friction loss) / (m g L sin alpha)", loss / gravity_work, 1.0, 1e-9, "energy balance"
    )
