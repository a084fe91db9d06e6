"""GaitProblem: everything that defines an optimal gait, as a frozen record."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.word import Word
from gaitopt.ocp.guess import Guess
from gaitopt.ocp.limits import Limits, Margins, Range, Target
from gaitopt.ocp.objective import CostOfTransport, Objective, objective_named
from gaitopt.ocp.reach import longest_reach
from gaitopt.ocp.shooting import MultipleShooting


@dataclass(frozen=True, kw_only=True, eq=False)
class GaitProblem:
    """An optimal-control problem for one periodic step.

    Attributes
    ----------
    robot : Robot
    word : Word or str
        Phases and impact, such as ``"slip+ stick | slip+"``.
    parameters : mapping of str to float
        Robot parameters (SI units); those not named keep their defaults.
    friction : float
        Coulomb coefficient; ``inf`` for a foot that never slips.
    slope : float [rad]
        Downhill positive.
    speed, step_length : float, (float, float) or None
        Wanted value, bounds, or free [m/s, m].  Travel includes foot slide.
    objective : Objective or str
    limits : Limits
    margins : Margins
    guess : Guess or None
        Where the optimiser starts; None lets :func:`gaitopt.solve` choose, a straight line from pose to pose.
    transcription : MultipleShooting
    name : str
        For people.

    Raises
    ------
    InputError
        At construction, if anything cannot be: the message says what and why.

    Examples
    --------
    >>> from gaitopt import GaitProblem, compass_biped, Limits
    >>> problem = GaitProblem(
    ...     robot=compass_biped(), word="stick | stick", friction=0.14, speed=0.6, step_length=0.47,
    ...     limits=Limits(torque=6),
    ... )
    >>> problem.replace(friction=0.2).friction
    0.2
    """

    robot: Robot
    word: Word
    parameters: Mapping[str, float] = field(default_factory=dict)
    friction: float = math.inf
    slope: float = 0.0
    speed: Target = None
    step_length: Target = None
    objective: Objective = field(default_factory=CostOfTransport)
    limits: Limits = field(default_factory=Limits)
    margins: Margins = field(default_factory=Margins)
    guess: Guess | None = None
    transcription: MultipleShooting = field(default_factory=MultipleShooting)
    name: str = "gait"

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        if not isinstance(self.robot, Robot):
            raise InputError(f"robot must be a Robot such as compass_biped(), got {self.robot!r}.")
        set_(self, "word", Word.parse(self.word).check_periodic())
        set_(self, "objective", objective_named(self.objective))
        self._check_parts()
        for ground in ("slope", "friction"):
            if ground in self.parameters:
                raise InputError(f"Give {ground} as GaitProblem({ground}=...), not among the robot's parameters.")
        values = self.robot.resolve({**self.parameters, "slope": self.slope, "friction": self.friction})
        set_(self, "slope", values.pop("slope"))
        set_(self, "friction", values.pop("friction"))
        set_(self, "parameters", values)
        self._check_actuation()
        self._check_friction()
        self._check_targets()

    def replace(self, **changes: Any) -> "GaitProblem":
        """Return the problem with some fields changed and everything checked again."""
        return replace(self, **changes)

    @property
    def values(self) -> dict[str, float]:
        """Every parameter of robot and ground by name (SI units)."""
        return {**self.parameters, "slope": self.slope, "friction": self.friction}

    @property
    def speed_range(self) -> Range:
        """Bounds of the average speed [m/s]."""
        return Range.of(self.speed, "speed", "m/s")

    @property
    def step_range(self) -> Range:
        """Bounds of the travel per step [m]."""
        return Range.of(self.step_length, "step_length", "m")

    def describe(self) -> dict[str, Any]:
        """Return the fully resolved problem as plain data (numbers in SI units, angles in rad)."""
        limits, margins = self.limits, self.margins
        return {
            "name": self.name,
            "robot": self.robot.name,
            "word": str(self.word),
            "objective": self.objective.name,
            **self.values,
            "speed": _plain(self.speed),
            "step_length": _plain(self.step_length),
            "torque_limit": dict(zip(self.robot.actuators, limits.torques(self.robot.actuators), strict=True)),
            "angle_limit": limits.angle,
            "rate_limit": limits.rate,
            "shortest_phase": limits.shortest_phase,
            "longest_step": limits.longest_step,
            "cone_margin": margins.cone,
            "impact_cone_margin": margins.impact_cone,
            "slip_speed_margin": margins.slip_speed,
            "separation_margin": margins.separation,
            "normal_force_margin": margins.normal_force,
            "guess": "automatic" if self.guess is None else self.guess.describe(),
            "transcription": self.transcription.name,
            "substeps": self.transcription.substeps,
            "tolerance": self.transcription.tolerance,
            "intervals": list(self.transcription.intervals_for(self.word)),
        }

    def _check_parts(self) -> None:
        for name, kinds in (
            ("limits", (Limits,)),
            ("margins", (Margins,)),
            ("guess", (Guess, type(None))),
            ("transcription", (MultipleShooting,)),
        ):
            part = getattr(self, name)
            if not isinstance(part, kinds):
                raise InputError(f"{name} must be a {kinds[0].__name__}, got {part!r}.")

    def _check_actuation(self) -> None:
        if self.robot.n_u == 0:
            raise InputError(f"Robot {self.robot.name!r} has no actuators, so there is nothing to optimise.")
        self.limits.torques(self.robot.actuators)
        self.transcription.intervals_for(self.word)

    def _check_friction(self) -> None:
        slips = any(mode.slips for mode in (*self.word.phases, self.word.impact))
        if slips and math.isinf(self.friction):
            raise InputError(f"The word '{self.word}' slips, which needs a finite friction, got inf.")
        if self.friction == 0:  # the cones are written with 1 / mu
            raise InputError("A gait needs a friction greater than 0: without it no foot can push off.")

    def _check_targets(self) -> None:
        speed, step = self.speed_range, self.step_range
        reach = longest_reach(self.robot, self.values, self.limits.angle)
        if step.lower > reach:
            raise InputError(
                f"step_length {step.lower:g} m is longer than the {reach:.3g} m the robot can reach with angles within "
                f"{math.degrees(self.limits.angle):.3g} deg; shorten the step or lengthen the legs."
            )
        shortest = self.limits.shortest_phase * len(self.word.phases)
        if shortest > self.limits.longest_step:
            raise InputError(
                f"{len(self.word.phases)} phases of at least Limits.shortest_phase = {self.limits.shortest_phase:g} s "
                f"take longer than Limits.longest_step = {self.limits.longest_step:g} s."
            )
        longest_period = min(step.upper, reach) / speed.lower if speed.lower > 0 else math.inf
        if longest_period < shortest:
            raise InputError(
                f"speed {speed.lower:g} m/s and step_length leave at most {longest_period:.3g} s for a step, less than "
                f"the {shortest:.3g} s that {len(self.word.phases)} phases need (Limits.shortest_phase)."
            )
        if math.isfinite(speed.upper) and step.lower / speed.upper > self.limits.longest_step:
            raise InputError(
                f"step_length {step.lower:g} m at speed {speed.upper:g} m/s takes {step.lower / speed.upper:.3g} s, "
                f"more than Limits.longest_step = {self.limits.longest_step:g} s."
            )


def _plain(target: Target) -> float | list[float] | None:
    if target is None:
        return None
    return float(target) if np.isscalar(target) else [float(bound) for bound in target]  # type: ignore[union-attr, arg-type]
