"""GaitProblem: the definition of an optimal gait as a frozen record."""

import copy
import math
from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any

import attrs
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.model.robot_type import check_robot_type
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.ocp.provenance import ScriptRecord, plain_fields
from gaitopt.ocp.statement.criteria import CostOfTransport
from gaitopt.ocp.statement.free_parameters import (
    Ends,
    check_corners,
    clip_values,
    fix_free_parameters,
    list_corners,
    read_bounds,
    separate_targets,
)
from gaitopt.ocp.statement.initial_guess import Guess
from gaitopt.ocp.statement.limits import Limits, Margins, Range, Target
from gaitopt.ocp.statement.objective import Objective, check_objective
from gaitopt.ocp.statement.objective_names import objective_named
from gaitopt.ocp.statement.stability_bound import StabilityBound
from gaitopt.ocp.statement.touchdown_pose import find_longest_reach, reaches
from gaitopt.ocp.transcription.collocation import Collocation
from gaitopt.ocp.transcription.deviations import check_scheme, section_names
from gaitopt.ocp.transcription.method import Method
from gaitopt.parameters import check_type

_DEFAULT_MARGINS = Margins()


@check_arguments
@dataclass(frozen=True, kw_only=True, eq=False)
class GaitProblem:
    """An optimal-control problem for one periodic step.

    Attributes
    ----------
    robot : Robot
    sequence : ContactSequence or str
        Phases and impact, such as ``"slip+ stick | slip+"``; ``any`` leaves a place open, see :func:`gaitopt.solve`.
    parameters : mapping of str to float
        Robot parameters (SI units); missing ones have their default values.
    friction : float
        Coulomb coefficient; ``inf`` for a foot that never slips.
    slope : float or (float, float) [rad]
        Downhill positive; a pair makes the slope an unknown within bounds.
    speed, step_length : float, (float, float) or None
        Requested value, bounds, or None for a free value [m/s, m].  Travel includes foot slide.
    free : mapping of str to (float, float)
        Bounds of the parameters of robot and ground that are optimised with the gait: design variables, such as
        ``{"leg_com": (0.4, 1.2), "friction": (0.1, 0.2)}``.  Their values above are where the solve starts.  `slope`,
        `speed` and `step_length` may be listed, too, instead of a pair above.
    objective : Objective or str
    stability : StabilityBound or None
        Bound or weight of the spectral radius of the return map.
    limits : Limits
    margins : Margins
    guess : Guess or None
        Initial guess; None for automatic starts, see :func:`gaitopt.solve`.
    transcription : Collocation or MultipleShooting
    name : str
        Name shown in reports.
    script : ScriptRecord or None
        The script that states the problem, for the record of the gait.

    Raises
    ------
    InputError
        If any argument is invalid; the message names it and gives the reason.

    Examples
    --------
    >>> from gaitopt import GaitProblem, compass_biped, Limits
    >>> problem = GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.14, speed=0.6, step_length=0.47,
    ...     limits=Limits(torque=6),
    ... )
    >>> problem.replace(friction=0.2).friction
    0.2
    """

    robot: Robot
    sequence: ContactSequence
    parameters: Mapping[str, float] = field(default_factory=dict)
    friction: float = math.inf
    slope: float | tuple[float, float] = 0.0
    speed: Target = None
    step_length: Target = None
    free: Mapping[str, Ends] = field(default_factory=dict)
    objective: Objective = field(default_factory=CostOfTransport)
    stability: StabilityBound | None = None
    limits: Limits = field(default_factory=Limits)
    margins: Margins = _DEFAULT_MARGINS
    guess: Guess | None = None
    transcription: Method = field(default_factory=Collocation)
    name: str = "gait"
    script: ScriptRecord | None = None

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        check_robot_type(self.robot, Robot, "a Robot such as compass_biped()", "PlanarProblem")
        set_(self, "sequence", ContactSequence.parse(self.sequence).check_periodic())
        set_(self, "objective", objective_named(self.objective))
        check_type("name", self.name, str, "a string")
        self._check_parts()
        check_objective(self.objective, self.robot)
        for ground in ("slope", "friction"):
            if ground in self.parameters:
                raise InputError(
                    f"{ground} must be passed as GaitProblem({ground}=...), not among the robot's parameters."
                )
        self._check_free()
        slopes = self._slopes()
        lower = self._resolve(slopes[0])
        upper = dict(lower) if slopes[1] is slopes[0] else self._resolve(slopes[1])
        set_(self, "slope", lower.pop("slope") if lower == upper else (lower.pop("slope"), upper["slope"]))
        set_(self, "friction", lower.pop("friction"))
        set_(self, "parameters", lower)
        check_corners(self.robot, self.values, self.free)
        if self.stability is not None:
            self.sequence.require_closed("StabilityBound")
            section_names(self.robot, self.sequence)
            check_scheme(self.transcription.scheme)
        self._check_actuation()
        self._check_friction()
        self._check_targets()

    def _check_free(self) -> None:
        """Check the bounds of the free parameters; slope, speed and step length are moved to their fields."""
        free, fields = separate_targets(self.free, ("slope", "speed", "step_length"))
        for name, ends in fields.items():
            object.__setattr__(self, name, ends)
        robot, values = self.robot, {**self.parameters, "friction": self.friction}
        object.__setattr__(self, "free", read_bounds(free, robot.parameters, values, f"Robot {robot.name!r}"))

    def _slopes(self) -> tuple[object, object]:
        """Return the bounds of the slope, unchecked."""
        if not isinstance(self.slope, tuple | list):
            return self.slope, self.slope
        if len(self.slope) != 2 or not self.slope[0] <= self.slope[1]:
            raise InputError(f"slope must be a number or a pair (lower, upper) [rad], got {self.slope!r}.")
        return self.slope[0], self.slope[1]

    def _resolve(self, slope: object) -> dict[str, float]:
        values = self.robot.resolve({**self.parameters, "slope": slope, "friction": self.friction})
        return clip_values(values, self.free)

    def __repr__(self) -> str:
        return f"GaitProblem({self.name!r}, robot={self.robot.name!r}, sequence='{self.sequence}')"

    def __str__(self) -> str:
        from gaitopt.ocp.statement.problem_formulation import formulate_gait_problem

        return str(formulate_gait_problem(self))

    def _repr_latex_(self) -> str:
        from gaitopt.ocp.statement.problem_formulation import formulate_gait_problem

        return formulate_gait_problem(self).latex

    def replace(self, **changes: Any) -> "GaitProblem":
        """Return the problem with some fields changed; all fields are checked again."""
        return replace(self, **changes)

    def fix_parameters(self, values: Mapping[str, float]) -> "GaitProblem":
        """Return the problem with some parameters of robot and ground, free or not, fixed at values.

        Examples
        --------
        >>> from gaitopt import GaitProblem, Limits, compass_biped
        >>> problem = GaitProblem(
        ...     robot=compass_biped(), sequence="stick | stick", limits=Limits(torque=6), free={"leg_com": (0.4, 1.2)}
        ... )
        >>> problem.fix_parameters({"leg_com": 0.7}).values["leg_com"]
        0.7
        """
        return self.replace(**fix_free_parameters(values, self.parameters, self.free))

    def without_guess(self) -> "GaitProblem":
        """Return the problem without its guess, which may reference other gaits."""
        bare = copy.copy(self)
        object.__setattr__(bare, "guess", None)
        return bare

    @property
    def values(self) -> dict[str, float]:
        """Every parameter of robot and ground by name (SI units).

        The value of a free slope is the middle of its bounds, that of any other free parameter its initial value.
        """
        lower, upper = self.slope_range
        return {**self.parameters, "slope": (lower + upper) / 2, "friction": self.friction}

    @property
    def slope_range(self) -> tuple[float, float]:
        """Bounds of the slope [rad], equal if the slope is fixed."""
        return self.slope if isinstance(self.slope, tuple) else (self.slope, self.slope)

    @property
    def free_ranges(self) -> dict[str, Ends]:
        """Bounds of all parameters of robot and ground that are optimised, the slope included."""
        lower, upper = self.slope_range
        return {**self.free, "slope": (lower, upper)} if lower < upper else dict(self.free)

    @property
    def corners(self) -> list[dict[str, float]]:
        """Values of all parameters where a solve starts, and with free parameters at their bounds."""
        return list(list_corners(self.values, self.free))

    @property
    def speed_range(self) -> Range:
        """Bounds of the average speed [m/s]."""
        return Range.of(self.speed, "speed", "m/s")

    @property
    def step_length_range(self) -> Range:
        """Bounds of the travel per step [m]."""
        return Range.of(self.step_length, "step_length", "m")

    def describe(self) -> dict[str, Any]:
        """Return the fully resolved problem as plain data (numbers in SI units, angles in rad)."""
        limits, margins, actuators = self.limits, self.margins, self.robot.actuators
        return {
            "name": self.name,
            "robot": self.robot.name,
            "sequence": str(self.sequence),
            "objective": self.objective.name,
            "objective_parameters": plain_fields(self.objective),
            "objective_unit": self.objective.unit,
            "stability": self.stability and attrs.asdict(self.stability),
            **self.values,
            "slope": _plain(self.slope),
            "free": {name: list(ends) for name, ends in self.free_ranges.items()},
            "speed": _plain(self.speed),
            "step_length": _plain(self.step_length),
            "torque_limit": dict(zip(actuators, limits.torques(actuators), strict=True)),
            "torque_rate_limit": dict(zip(actuators, limits.torque_rates(actuators), strict=True)),
            "angle_limit": dict(zip(self.robot.angles, map(list, limits.angles(self.robot.angles)), strict=True)),
            "rate_limit": limits.rate,
            "shortest_phase": limits.shortest_phase,
            "longest_step": limits.longest_step,
            "clearance": limits.clearance,
            "cone_margin": margins.cone,
            "impact_cone_margin": margins.impact_cone,
            "slip_speed_margin": margins.slip_speed,
            "sliding_inertia_margin": margins.sliding_inertia,
            "separation_margin": margins.separation,
            "normal_force_margin": margins.normal_force,
            "touchdown_rate_margin": margins.touchdown_rate,
            "touchdown_armed_margin": margins.touchdown_armed,
            "guess": "automatic" if self.guess is None else self.guess.describe(),
            "transcription": self.transcription.name,
            "tolerance": self.transcription.tolerance,
            "cost_tolerance": self.transcription.largest_cost_error,
            "intervals": list(self.transcription.intervals_for(self.sequence)),
            "script": self.script and self.script.describe(),
        }

    def _check_parts(self) -> None:
        for name, kinds in (
            ("limits", (Limits,)),
            ("margins", (Margins,)),
            ("guess", (Guess, type(None))),
            ("stability", (StabilityBound, type(None))),
            ("transcription", (Method,)),
        ):
            part = getattr(self, name)
            if not isinstance(part, kinds):
                hint = ", such as Collocation() or MultipleShooting()" if kinds[0] is Method else ""
                if kinds[0] is Guess:
                    hint = ', such as WarmStart(load("gait.h5"))'
                raise InputError(f"{name} must be a {kinds[0].__name__}{hint}, got {part!r}.")

    def _check_actuation(self) -> None:
        if self.robot.n_u == 0:
            raise InputError(
                f"Robot {self.robot.name!r} has no actuators; an optimal gait requires at least one. "
                "Use a WalkProblem for passive gaits."
            )
        self.limits.torque_rates(self.robot.actuators)
        if not any(self.limits.torques(self.robot.actuators)):
            raise InputError("Limits.torque is 0 for every actuator; at least one must be greater than 0.")
        self.transcription.intervals_for(self.sequence)
        self.transcription.fractions_for(self.sequence)

    def _check_friction(self) -> None:
        if self.sequence.is_open and math.isinf(self.friction):
            raise InputError(
                f"The sequence '{self.sequence}' contains 'any', which needs a finite friction coefficient, got inf."
            )
        slips = any(mode.slips for mode in (*self.sequence.phases, self.sequence.impact))
        if slips and math.isinf(self.friction):
            raise InputError(
                f"The sequence '{self.sequence}' contains slip, which needs a finite friction coefficient, got inf."
            )
        if self.friction == 0:  # the cones contain 1 / mu
            raise InputError("friction must be greater than 0, got 0: a foot cannot push off without friction.")

    def _reaches(self, step: float) -> bool:
        """Return whether a step [m] is possible for some values of the free parameters."""
        angles = self.limits.angles(self.robot.angles)
        return any(reaches(self.robot, values, angles, step) for values in self.corners)

    def _reach(self) -> float:
        """Return the longest step for any values of the free parameters [m]."""
        angles = self.limits.angles(self.robot.angles)
        return max(find_longest_reach(self.robot, values, angles) for values in self.corners)

    def _check_targets(self) -> None:
        speed, step = self.speed_range, self.step_length_range
        for name in ("speed", "step_length"):
            target = _plain(getattr(self, name))
            object.__setattr__(self, name, tuple(target) if isinstance(target, list) else target)
        if not self._reaches(step.lower):
            raise InputError(
                f"step_length {step.lower:g} m is longer than the {self._reach():.3g} m the robot can reach within "
                f"Limits.angle; shorten the step or lengthen the legs."
            )
        shortest = self.limits.shortest_phase * len(self.sequence.phases)
        if shortest > self.limits.longest_step:
            raise InputError(
                f"The sequence '{self.sequence}' needs {shortest:g} s (Limits.shortest_phase in each phase), more than "
                f"Limits.longest_step = {self.limits.longest_step:g} s."
            )
        least_step = shortest * speed.lower
        if step.upper < least_step or (least_step > step.lower and not self._reaches(least_step)):
            longest_period = min(step.upper, self._reach()) / speed.lower
            raise InputError(
                f"speed {speed.lower:g} m/s and step_length leave at most {longest_period:.3g} s for a step, less than "
                f"the {shortest:.3g} s that the sequence '{self.sequence}' needs (Limits.shortest_phase in each phase)."
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
