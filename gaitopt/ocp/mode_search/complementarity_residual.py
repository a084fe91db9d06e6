"""Complementarity residual of impact and friction, computed from impulses, forces and speeds alone."""

from typing import Any

import numpy as np

from gaitopt.model.contacts.impact_law import PlasticFrictional


def complementarity_residual(tangential: Any, normal: Any, speed: Any, friction: float) -> float:
    """Return the complementarity residual of contacts: the largest product or negative part of the sides of a pair.

    The auxiliary unknowns of the NLP are not used: a and b are the parts of the tangential impulse or force, c is the
    absolute speed.  The residual is nan if any argument is.

    Parameters
    ----------
    tangential, normal : scalars or (K,) arrays
        Impulses or forces.
    speed : scalar or (K,) array
        Tangential speed of the foot [m/s].
    friction : float

    Examples
    --------
    A foot that slides at 0.5 m/s with a tenth of its friction missing:

    >>> round(complementarity_residual(-0.9, 10.0, 0.5, 0.1), 12)
    0.05
    """
    forward, backward, slip = np.maximum(tangential, 0), np.maximum(-np.asarray(tangential), 0), np.abs(speed)
    left, right = PlasticFrictional().pairs((normal, forward, backward), slip, (0.0 * slip, speed), friction)
    products = [np.abs(np.ravel(a * b)) for a, b in zip(left, right, strict=True)]
    negative = [-np.ravel(side) for side in (*left, *right)]
    return float(np.max(np.concatenate([*products, *negative]), initial=0.0))
