"""Controller families of gaits of robots with several contacts."""

from collections.abc import Callable, Mapping

import numpy as np

from gaitopt.control.planar_laws.planar_feedback import planar_joint_pd
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.control.planar_laws.planar_reference import used_actuators
from gaitopt.errors import InputError
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.tuning.gain import Gain
from gaitopt.tuning.lqr import LqrWeights
from gaitopt.tuning.planar_lqr import planar_lqr, planar_step_lqr

PlanarLawFamily = tuple[tuple[Gain, ...], Callable[[Mapping[str, float]], PlanarLaw]]
"""Gains of a family, and the function from their values to the law."""

SMALL_ANGLE, SMALL_RATE = 0.03, 0.2
"""Deviations of a joint [rad or m; rad/s or m/s] at which the largest gains demand the largest planned torque."""


def make_planar_law_family(name: str, gait: PlanarGait, torque_limit: float | Mapping[str, float]) -> PlanarLawFamily:
    """Return gains and law of a family by name, one of ``PLANAR_FAMILIES``.

    Raises
    ------
    InputError
        If there is no such family for these robots, or the gait is not a solution.
    """
    if name not in PLANAR_FAMILIES:
        raise InputError(
            f"The law {name!r} is not available for robots with several contacts. Known: {', '.join(PLANAR_FAMILIES)}."
        )
    return PLANAR_FAMILIES[name](gait.require(), torque_limit)


def _joint_pd(gait: PlanarGait, torque_limit: float | Mapping[str, float]) -> PlanarLawFamily:
    law, gains = planar_joint_pd(gait, torque_limit=torque_limit), list[Gain]()
    largest = dict(zip(gait.robot.actuators, np.max(np.abs(gait.motion.channel("torque")), axis=1), strict=True))
    for kind, small in (("stiffness", SMALL_ANGLE), ("damping", SMALL_RATE)):
        for actuator in used_actuators(gait):
            most = float(largest[actuator] / small)
            gains.append(Gain(f"{actuator}_{kind}", 0.1 * most, 0.0, most))
    return tuple(gains), lambda values: law.with_gains(dict(values))


def _lqr(gait: PlanarGait, torque_limit: float | Mapping[str, float]) -> PlanarLawFamily:
    return _weights(), lambda values: planar_lqr(gait, weights=LqrWeights(**values), torque_limit=torque_limit)


def _step_lqr(gait: PlanarGait, torque_limit: float | Mapping[str, float]) -> PlanarLawFamily:
    limits = torque_limit.values() if isinstance(torque_limit, Mapping) else [torque_limit]
    if any(np.isfinite(limit) for limit in limits):
        raise InputError("The law 'step_lqr' of a robot with several contacts accepts no torque limit.")
    return _weights(), lambda values: planar_step_lqr(gait, weights=LqrWeights(**values))


def _weights() -> tuple[Gain, ...]:
    """Return the weights of an LQR as gains: sizes of deviations that cost as much as the largest planned torques."""
    start = LqrWeights()
    return (
        Gain("angle", start.angle, start.angle / 10, start.angle * 10, logarithmic=True),
        Gain("rate", start.rate, start.rate / 10, start.rate * 10, logarithmic=True),
    )


PLANAR_FAMILIES: dict[str, Callable[[PlanarGait, float | Mapping[str, float]], PlanarLawFamily]] = {
    "joint_pd": _joint_pd,
    "lqr": _lqr,
    "step_lqr": _step_lqr,
}
"""Families by the names of their laws."""
