"""Feedback designs: laws for a gait as functions of a few gains, to be tuned."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from gaitopt.control.computed_torque import computed_torque
from gaitopt.control.joint_pd import joint_pd
from gaitopt.control.law import Law
from gaitopt.control.limits import UNLIMITED
from gaitopt.control.phase_variable import by_stance_angle
from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Motion
from gaitopt.tuning.lqr import LqrWeights, lqr, step_lqr

TorqueLimit = float | Mapping[str, float]


@dataclass(frozen=True)
class Gain:
    """A number to be tuned.

    Attributes
    ----------
    name : str
    start : float
    lower, upper : float
    logarithmic : bool
        Whether it is searched by its logarithm; `lower` is then positive.

    Examples
    --------
    >>> Gain("hip_stiffness", 20.0, 0.0, 100.0).at(0.5)
    50.0
    """

    name: str
    start: float
    lower: float
    upper: float
    logarithmic: bool = False

    def __post_init__(self) -> None:
        if not self.lower <= self.start <= self.upper or not self.lower < self.upper < math.inf:
            raise InputError(f"Gain {self.name!r} needs finite bounds around its start, got {self}.")
        if self.logarithmic and self.lower <= 0:
            raise InputError(f"Gain {self.name!r} is searched by its logarithm: its lower bound must be positive.")

    def at(self, share: float) -> float:
        """Return the value at a share of the way from the lower bound to the upper."""
        if self.logarithmic:
            return float(self.lower * (self.upper / self.lower) ** share)
        return float(self.lower + share * (self.upper - self.lower))

    @property
    def share(self) -> float:
        """Where the start lies between the bounds."""
        if self.logarithmic:
            return math.log(self.start / self.lower) / math.log(self.upper / self.lower)
        return (self.start - self.lower) / (self.upper - self.lower)


@dataclass(frozen=True, eq=False)
class ControllerFamily:
    """A family of laws.

    Attributes
    ----------
    name : str
    gains : tuple of Gain
    law : callable
        From values of the gains by name to the law.

    Examples
    --------
    >>> from gaitopt import compass_biped, controller_family_named, load
    >>> design = controller_family_named("joint_pd", compass_biped(), load("docs/examples/compass_slip.h5").motion, torque_limit=8)
    >>> [gain.name for gain in design.gains]
    ['ankle_stiffness', 'hip_stiffness', 'ankle_damping', 'hip_damping']
    """

    name: str
    gains: tuple[Gain, ...]
    law: Callable[[Mapping[str, float]], Law] = field(repr=False)

    def bounded(self, bounds: Mapping[str, tuple[float, float]]) -> "ControllerFamily":
        """Return the design with only the named gains left to tune, within other bounds; the others keep their start.

        Raises
        ------
        InputError
            If it has no such gain.
        """
        known = {gain.name: gain for gain in self.gains}
        for name in bounds:
            if name not in known:
                raise InputError(f"The design {self.name!r} has no gain {name!r}. {suggest(name, known)}")
        fixed = {name: gain.start for name, gain in known.items() if name not in bounds}
        free = tuple(_within(known[name], *span) for name, span in bounds.items())
        return ControllerFamily(self.name, free, lambda values: self.law({**fixed, **values}))

    def by_stance_angle(self, robot: Robot, motion: Motion) -> "ControllerFamily":
        """Return the design of the same law by the stance angle; see :func:`gaitopt.by_stance_angle`."""
        return replace(self, law=lambda values: by_stance_angle(robot, motion, self.law(values)))


def _within(gain: Gain, lower: float, upper: float) -> Gain:
    start = min(max(gain.start, lower), upper)
    return Gain(gain.name, start, lower, upper, gain.logarithmic and lower > 0)


def controller_family_named(
    name: str, robot: Robot, motion: Motion, *, torque_limit: TorqueLimit = math.inf
) -> ControllerFamily:
    """Return the design of a law for a gait by name: one of ``DESIGNS``.

    Bounds follow from the torque limits: feedback should not use them up for 0.03 rad or 0.2 rad/s.

    Parameters
    ----------
    name : str
        ``"joint_pd"``, ``"computed_torque"``, ``"lqr"`` or ``"step_lqr"``; see :func:`law_name`.
    robot : Robot
    motion : Motion
        One step of the gait.
    torque_limit : float or mapping of actuator to float [N m]

    Raises
    ------
    InputError
        If there is no design of this name.

    Examples
    --------
    >>> from gaitopt import compass_biped, load
    >>> design = controller_family_named("lqr", compass_biped(), load("docs/examples/compass_slip.h5").motion, torque_limit=8)
    >>> [gain.name for gain in design.gains]
    ['torque', 'rate']
    """
    return DESIGNS[law_name(name)](robot, motion, torque_limit)


def law_name(name: str) -> str:
    """Return the name of a feedback law, that of the function that makes it, from any accepted spelling.

    Raises
    ------
    InputError
        If there is no such law.

    Examples
    --------
    >>> law_name("computed torque"), law_name("pd"), law_name("step-to-step")
    ('computed_torque', 'joint_pd', 'step_lqr')
    """
    spelled = name.strip().replace("-", "_").replace(" ", "_")
    spelled = SYNONYMS.get(spelled, spelled)
    if spelled not in DESIGNS:
        raise InputError(f"There is no feedback law {name!r}. {suggest(name, DESIGNS)}")
    return spelled


def _pd(robot: Robot, motion: Motion, torque_limit: TorqueLimit) -> ControllerFamily:
    law, most = joint_pd(robot, motion, torque_limit=torque_limit), _most(torque_limit)
    gains = [Gain(f"{actuator}_stiffness", most / 0.3, 0.0, most / 0.03) for actuator in robot.actuators]
    gains += [Gain(f"{actuator}_damping", most / 2, 0.0, most / 0.2) for actuator in robot.actuators]
    return ControllerFamily("joint_pd", tuple(gains), law.with_gains)


def _computed_torque(robot: Robot, motion: Motion, torque_limit: TorqueLimit) -> ControllerFamily:
    law = computed_torque(robot, motion, torque_limit=torque_limit)

    def with_common(values: Mapping[str, float]) -> Law:
        return law.with_gains({name: values[name.rpartition("_")[2]] for name in law.gains})

    fast = 1 / motion.period
    gains = (
        Gain("stiffness", (4 * fast) ** 2, 0.0, (12 * fast) ** 2),
        Gain("damping", 8 * fast, 0.0, 24 * fast),
    )
    return ControllerFamily("computed_torque", gains, with_common)


def _lqr(robot: Robot, motion: Motion, torque_limit: TorqueLimit) -> ControllerFamily:
    return ControllerFamily(
        "lqr",
        _weights(torque_limit),
        lambda values: lqr(robot, motion, weights=LqrWeights(**values), torque_limit=torque_limit),
    )


def _step_to_step(robot: Robot, motion: Motion, torque_limit: TorqueLimit) -> ControllerFamily:
    return ControllerFamily(
        "step_lqr",
        _weights(torque_limit),
        lambda values: step_lqr(robot, motion, weights=LqrWeights(**values), torque_limit=torque_limit),
    )


def _weights(torque_limit: TorqueLimit) -> tuple[Gain, ...]:
    most = _most(torque_limit)
    return (
        Gain("torque", 0.5 * most, 0.02 * most, 5 * most, logarithmic=True),
        Gain("rate", 0.3, 0.03, 3.0, logarithmic=True),
    )


def _most(torque_limit: TorqueLimit) -> float:
    """Return the smallest finite limit [N m], 10 where there is none."""
    limits = torque_limit.values() if isinstance(torque_limit, Mapping) else [torque_limit]
    return min([float(limit) for limit in limits if float(limit) < UNLIMITED], default=10.0)


DESIGNS: dict[str, Callable[[Robot, Motion, TorqueLimit], ControllerFamily]] = {
    "joint_pd": _pd,
    "computed_torque": _computed_torque,
    "lqr": _lqr,
    "step_lqr": _step_to_step,
}
"""Designs by the names of the functions that make their laws."""

SYNONYMS = {"pd": "joint_pd", "step_to_step": "step_lqr"}
"""Other names of laws, which are accepted and not printed."""
