"""Physical quantities of a robot at a few states, as plain data."""

import numpy as np
from numpy.typing import NDArray

from gaitopt.dataclass import dataclass

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PhysicsSamples:
    """Physical quantities of a robot at a few states.

    Attributes
    ----------
    points : dict of str to (K,) or (n, K) array
        The states: `q`, `v`, `u`, `w` (rates after an impact), `impulse`, and every parameter by name (SI units).
    values : dict of str to (n, K) array
        Quantities by name (SI units).

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> from gaitopt.model.physics import physics_of
    >>> physics_of(compass_biped()).values["mass matrix"].shape
    (16, 3)
    """

    points: dict[str, Array]
    values: dict[str, Array]
