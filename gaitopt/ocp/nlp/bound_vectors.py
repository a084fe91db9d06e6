"""Bounds of the variables and constraint rows of an NLP."""

from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds of variables and constraint rows.

    Attributes
    ----------
    x_lower, x_upper : (n_variables,) arrays
    g_lower, g_upper : (n_constraints,) arrays
    """

    x_lower: Array
    x_upper: Array
    g_lower: Array
    g_upper: Array
