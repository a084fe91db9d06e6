"""Stability and recovery of gaits in open loop, as measured in sweeps and fronts."""

import math

import numpy as np

from gaitopt.control.law import feedforward
from gaitopt.control.planar_laws.planar_feedback import planar_feedforward
from gaitopt.errors import InputError
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import AnyGait, PlanarGait
from gaitopt.stability.assessment import assess_stability
from gaitopt.stability.gait_recovery import walker_near
from gaitopt.stability.recovery import PushTest, find_largest_recovery

PUSHES = PushTest(starts=20, resolution=0.1)
"""Pushes by which the recovery of a gait is measured."""


def measure_multipliers(gait: AnyGait) -> Array:
    """Return the multipliers of the return map in open loop, the largest magnitude first; empty without a gait.

    Examples
    --------
    >>> from gaitopt import load
    >>> multipliers = measure_multipliers(load("docs/examples/compass_slip.h5"))
    >>> multipliers.size, round(abs(multipliers[0]), 2)
    (4, np.float64(0.63))
    """
    try:
        cycle = assess_stability(gait)
    except InputError:
        return np.empty(0, dtype=complex)
    multipliers = np.asarray(cycle.multipliers, dtype=complex)
    return multipliers[np.argsort(-np.abs(multipliers), kind="stable")]


def measure_radius(gait: AnyGait) -> float:
    """Return the spectral radius of the return map under the torques of the gait in open loop; nan if it has none."""
    try:
        return assess_stability(gait).radius
    except InputError:
        return math.nan


def measure_recovered_push(gait: AnyGait) -> float:
    """Return the radius of the largest ball of pushes from which all starts return in open loop [rad/s]."""
    try:
        cycle = assess_stability(gait)
    except InputError:
        return 0.0
    law = planar_feedforward(gait) if isinstance(gait, PlanarGait) else feedforward(gait.robot, gait.motion)
    return find_largest_recovery(walker_near(gait, law, cycle), cycle, PUSHES).radius
