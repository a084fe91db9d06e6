"""Controller families: laws for a gait as functions of a few gains that are tuned."""

import math
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import Any

from gaitopt.arguments import check_arguments, check_record
from gaitopt.control.computed_torque import computed_torque
from gaitopt.control.joint_pd import joint_pd
from gaitopt.control.law import Law, feedforward
from gaitopt.control.phase_variable import by_stance_angle
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.control.push_off import push_off
from gaitopt.control.torque_saturation import UNLIMITED, limit_torque, torque_limits
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array, Motion
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.tuning.gain import Gain

TorqueLimit = float | Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class FamilySettings:
    """Settings of a controller family besides its gains, saved with tuned gains.

    Attributes
    ----------
    torque_limit : float or mapping of actuator to float [N m]
    stance_angle : bool
        Whether the stance angle replaces the clock; in flight, the velocity of the centre of mass.
    fixed : mapping of str to float
        Values of gains that are not tuned.

    Examples
    --------
    >>> FamilySettings(torque_limit=8).stance_angle
    False
    """

    torque_limit: TorqueLimit = math.inf
    stance_angle: bool = False
    fixed: Mapping[str, float] = field(default_factory=dict)


@check_record
@dataclass(frozen=True, eq=False)
class ControllerFamily:
    """A parametrised family of feedback laws.

    Attributes
    ----------
    name : str
    gains : tuple of Gain
    law : callable
        Function from values of the gains by name to the law, a Law or PlanarLaw.
    settings : FamilySettings

    Examples
    --------
    >>> from gaitopt import compass_biped, load
    >>> from gaitopt.tuning import controller_family_named
    >>> motion = load("docs/examples/compass_slip.h5").motion
    >>> family = controller_family_named("joint_pd", compass_biped(), motion, torque_limit=8)
    >>> [gain.name for gain in family.gains]
    ['ankle_stiffness', 'hip_stiffness', 'ankle_damping', 'hip_damping']
    """

    name: str
    gains: tuple[Gain, ...]
    law: Callable[[Mapping[str, float]], Any] = field(repr=False)
    settings: FamilySettings = field(default=FamilySettings(), repr=False)

    @staticmethod
    def from_law(law: Law | PlanarLaw, name: str | None = None) -> "ControllerFamily":
        """Return the family of a law with gains between 0 and three times their values in the law.

        Gains of value 0 are not tuned.

        Examples
        --------
        >>> from gaitopt import compass_biped, push_off
        >>> ControllerFamily.from_law(push_off(compass_biped(), torque=-2.0, duration=0.1)).gains[0].lower
        -6.0
        """
        values = {gain: value for gain, value in law.gain_values.items() if value}
        gains = tuple(Gain(gain, value, min(0.0, 3 * value), max(0.0, 3 * value)) for gain, value in values.items())
        return ControllerFamily(name or law.name, gains, law.with_gains)

    def with_bounds(self, bounds: Mapping[str, tuple[float, float]]) -> "ControllerFamily":
        """Return the family in which only the named gains are tuned, within new bounds; the others keep their start.

        Raises
        ------
        InputError
            If the family has no such gain.
        """
        known = {gain.name: gain for gain in self.gains}
        for name in bounds:
            if name not in known:
                raise InputError(f"The controller family {self.name!r} has no gain {name!r}. {suggest(name, known)}")
        fixed = {name: gain.start for name, gain in known.items() if name not in bounds}
        free = tuple(_clip_gain(known[name], *bound) for name, bound in bounds.items())
        settings = replace(self.settings, fixed={**self.settings.fixed, **fixed})
        return replace(self, gains=free, law=lambda values: self.law({**fixed, **values}), settings=settings)

    def with_starts(self, values: Mapping[str, float]) -> "ControllerFamily":
        """Return the family whose search begins at other gains; bounds are widened so that none is outside them.

        A gain outside its bounds is in the middle of the new ones.

        Examples
        --------
        >>> from gaitopt import compass_biped, push_off
        >>> family = ControllerFamily.from_law(push_off(compass_biped(), torque=-2.0, duration=0.1))
        >>> family.with_starts({"push_off_torque": -7.0}).gains[0].lower
        -14.0
        """
        return replace(self, gains=tuple(_move_start(gain, values.get(gain.name, gain.start)) for gain in self.gains))

    def with_torque_limit(self, robot: Robot | PlanarRobot, limit: TorqueLimit) -> "ControllerFamily":
        """Return the family of the same laws with torque limits [N m]; laws that state their limits keep them.

        Raises
        ------
        InputError
            If a limit is not positive or its name is not that of an actuator.

        Examples
        --------
        >>> from gaitopt import compass_biped, push_off
        >>> robot = compass_biped()
        >>> family = ControllerFamily.from_law(push_off(robot, torque=-2.0, duration=0.1))
        >>> family.law({}).limited, family.with_torque_limit(robot, 6.0).law({}).limited
        (False, True)
        """
        limits = torque_limits(robot, limit)

        def limited_law(values: Mapping[str, float]) -> Law | PlanarLaw:
            law = self.law(values)
            if isinstance(law, PlanarLaw):
                return replace(law, parts=tuple(_limit_law(part, limits) for part in law.parts))
            return _limit_law(law, limits)

        return replace(self, law=limited_law, settings=replace(self.settings, torque_limit=limit))

    def by_stance_angle(self, robot: Robot | PlanarRobot, motion: Motion | PlanarGait) -> "ControllerFamily":
        """Return the family of the same laws by the stance angle.

        See :func:`gaitopt.by_stance_angle`, and :func:`gaitopt.control.by_phase_variable` for a PlanarGait.
        """

        def law_by_angle(values: Mapping[str, float]) -> Any:
            if isinstance(motion, PlanarGait):
                from gaitopt.control.planar_laws.planar_phase_variable import by_phase_variable

                return by_phase_variable(motion, self.law(values))
            if not isinstance(robot, Robot):
                raise InputError("The laws of a robot with several contacts need its PlanarGait, not its motion.")
            return by_stance_angle(robot, motion, self.law(values))

        return replace(self, law=law_by_angle, settings=replace(self.settings, stance_angle=True))


def _limit_law(law: Law, limits: Array) -> Law:
    return law if law.limited else limit_torque(law, limits)


def _move_start(gain: Gain, value: float) -> Gain:
    """Return a gain with another start, which is in the middle of wider bounds if it is outside those of the gain."""
    lower, upper = gain.lower, gain.upper
    if value < lower:
        lower = value**2 / upper if gain.logarithmic else 2 * value - upper
    elif value > upper:
        upper = value**2 / lower if gain.logarithmic else 2 * value - lower
    return replace(gain, start=value, lower=lower, upper=upper)


def _clip_gain(gain: Gain, lower: float, upper: float) -> Gain:
    start = min(max(gain.start, lower), upper)
    return Gain(gain.name, start, lower, upper, gain.logarithmic and lower > 0)


@check_arguments
def controller_family_named(
    name: str, robot: Robot | PlanarRobot, motion: Motion | PlanarGait, *, torque_limit: TorqueLimit = math.inf
) -> ControllerFamily:
    """Return a controller family for a gait by name: one of ``FAMILIES``.

    Bounds of gains follow from the torque limits, those of ``"computed_torque"`` from the period.  The largest gains of
    ``"joint_pd"`` reach the limit at a deviation of 0.03 rad or 0.2 rad/s.

    Parameters
    ----------
    name : str
        ``"joint_pd"``, ``"computed_torque"``, ``"lqr"``, ``"step_lqr"`` or ``"push_off"``; see :func:`law_name`.  For a
        robot with several contacts: ``"joint_pd"``, ``"lqr"`` or ``"step_lqr"``.
    robot : Robot or PlanarRobot
    motion : Motion or PlanarGait
        One step of the gait; the gait itself for a robot with several contacts.
    torque_limit : float or mapping of actuator to float [N m]

    Raises
    ------
    InputError
        If there is no controller family of this name.

    Examples
    --------
    >>> from gaitopt import compass_biped, load
    >>> motion = load("docs/examples/compass_slip.h5").motion
    >>> family = controller_family_named("lqr", compass_biped(), motion, torque_limit=8)
    >>> [gain.name for gain in family.gains]
    ['torque', 'rate']
    """
    settings = FamilySettings(torque_limit=torque_limit)
    if isinstance(motion, PlanarGait):
        from gaitopt.tuning.planar_families import make_planar_law_family

        return ControllerFamily(law_name(name), *make_planar_law_family(law_name(name), motion, torque_limit), settings)
    if not isinstance(robot, Robot):
        raise InputError("The controller family of a robot with several contacts needs its PlanarGait, not its motion.")
    return replace(FAMILIES[law_name(name)](robot, motion, torque_limit), settings=settings)


def law_name(name: str) -> str:
    """Return the name of a feedback law, that of the function that creates it, from any accepted spelling.

    Raises
    ------
    InputError
        If there is no such law.

    Examples
    --------
    >>> law_name("computed torque"), law_name("pd"), law_name("step-to-step")
    ('computed_torque', 'joint_pd', 'step_lqr')
    """
    normalised = name.strip().replace("-", "_").replace(" ", "_")
    normalised = SYNONYMS.get(normalised, normalised)
    if normalised not in FAMILIES:
        script, _, function = name.partition(":")
        example = f", here '{script}.py:{function}'" if script and function and not script.endswith(".py") else ""
        raise InputError(
            f"There is no feedback law {name!r}. {suggest(name, FAMILIES)} On the command line, SCRIPT.py:FUNCTION "
            f"is a custom law{example}."
        )
    return normalised


def _pd(robot: Robot, motion: Motion, torque_limit: TorqueLimit) -> ControllerFamily:
    law, limit_scale = joint_pd(robot, motion, torque_limit=torque_limit), _smallest_limit(torque_limit)
    gains = [Gain(f"{actuator}_stiffness", limit_scale / 0.3, 0.0, limit_scale / 0.03) for actuator in robot.actuators]
    gains += [Gain(f"{actuator}_damping", limit_scale / 2, 0.0, limit_scale / 0.2) for actuator in robot.actuators]
    return ControllerFamily("joint_pd", tuple(gains), law.with_gains)


def _computed_torque(robot: Robot, motion: Motion, torque_limit: TorqueLimit) -> ControllerFamily:
    law = computed_torque(robot, motion, torque_limit=torque_limit)

    def set_common_gains(values: Mapping[str, float]) -> Law:
        return law.with_gains({name: values[name.rpartition("_")[2]] for name in law.gains})

    rate_scale = 1 / motion.period
    gains = (
        Gain("stiffness", (4 * rate_scale) ** 2, 0.0, (12 * rate_scale) ** 2),
        Gain("damping", 8 * rate_scale, 0.0, 24 * rate_scale),
    )
    return ControllerFamily("computed_torque", gains, set_common_gains)


def _lqr(robot: Robot, motion: Motion, torque_limit: TorqueLimit) -> ControllerFamily:
    from gaitopt.tuning.lqr import LqrWeights, lqr

    return ControllerFamily(
        "lqr",
        _weights(torque_limit),
        lambda values: lqr(robot, motion, weights=LqrWeights(**values), torque_limit=torque_limit),
    )


def _step_to_step(robot: Robot, motion: Motion, torque_limit: TorqueLimit) -> ControllerFamily:
    from gaitopt.tuning.lqr import LqrWeights, step_lqr

    return ControllerFamily(
        "step_lqr",
        _weights(torque_limit),
        lambda values: step_lqr(robot, motion, weights=LqrWeights(**values), torque_limit=torque_limit),
    )


def _push_off(robot: Robot, motion: Motion, torque_limit: TorqueLimit) -> ControllerFamily:
    """Return the open-loop torques of the gait with a push-off at the retraction of the swing leg."""
    limit_scale, gait = _smallest_limit(torque_limit), feedforward(robot, motion)
    law = push_off(robot, gait, torque=0.01 * limit_scale, duration=0.05 * motion.period, torque_limit=torque_limit)
    names = tuple(law.gains)
    gains = (
        Gain(names[0], 0.01 * limit_scale, -0.5 * limit_scale, 0.5 * limit_scale),
        Gain(names[1], 0.05 * motion.period, 0.01 * motion.period, 0.3 * motion.period),
    )
    return ControllerFamily("push_off", gains, law.with_gains)


def _weights(torque_limit: TorqueLimit) -> tuple[Gain, ...]:
    limit_scale = _smallest_limit(torque_limit)
    return (
        Gain("torque", 0.5 * limit_scale, 0.02 * limit_scale, 5 * limit_scale, logarithmic=True),
        Gain("rate", 0.3, 0.03, 3.0, logarithmic=True),
    )


def _smallest_limit(torque_limit: TorqueLimit) -> float:
    """Return the smallest finite torque limit [N m], or 10 without finite limits."""
    limits = torque_limit.values() if isinstance(torque_limit, Mapping) else [torque_limit]
    return min([float(limit) for limit in limits if float(limit) < UNLIMITED], default=10.0)


FAMILIES: dict[str, Callable[[Robot, Motion, TorqueLimit], ControllerFamily]] = {
    "joint_pd": _pd,
    "computed_torque": _computed_torque,
    "lqr": _lqr,
    "step_lqr": _step_to_step,
    "push_off": _push_off,
}
"""Families by the names of the functions that create their laws, from which the command line derives its help."""

SYNONYMS = {"pd": "joint_pd", "step_to_step": "step_lqr"}
"""Alternative names of laws, accepted as input but not printed."""
