"""Numbers beside published ones, with the tolerance their printed digits allow."""

from gaitopt import Number

STUDY = "Gamus & Or 2015"
OWN = "own computation"


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
    return Number(name, float(value), float(printed), tolerance, source, unit)
