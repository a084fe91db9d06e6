"""PlanarProblem: the definition of an optimal gait of a planar robot with any contacts."""

import math
from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, SequenceError
from gaitopt.model.planar.planar_check import require_planar
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.planar.undeclared_travel import state_undeclared_travel
from gaitopt.model.robot_type import check_robot_type
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.motion.printable import format_count
from gaitopt.ocp.multicontact.actuator_impulse import (
    ActuatorImpulse,
    ImpulseEntry,
    check_impulses,
    list_impulse_entries,
)
from gaitopt.ocp.multicontact.objective_unit import find_objective_unit
from gaitopt.ocp.multicontact.planar_guess import PlanarGuess, PoseGuess
from gaitopt.ocp.multicontact.planar_limits import PlanarLimits
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
from gaitopt.ocp.statement.limits import Margins, Range, Target
from gaitopt.ocp.statement.objective import Objective
from gaitopt.ocp.statement.objective_names import objective_named
from gaitopt.ocp.statement.problem_formulation import formulate_planar_problem
from gaitopt.ocp.transcription.collocation import Collocation
from gaitopt.ocp.transcription.method import DEFAULT_INTERVALS, check_count
from gaitopt.parameters import check_type

MOST_RECURSIVE = 10
"""Largest number of coordinates for which the recursive equations are chosen: eight links on a floating base."""

EQUATIONS = ("by size", "recursive", "lifted")


@check_arguments
@dataclass(frozen=True, kw_only=True, eq=False)
class PlanarProblem:
    """An optimal-control problem for one period of a planar robot with any contacts.

    Attributes
    ----------
    robot : PlanarRobot
    sequence : PhaseSequence or str
        Contact phases and events, see :mod:`gaitopt.motion.phase_sequence`; ``any`` in place of a mode, or of the whole
        sequence, leaves it open.
    parameters : mapping of str to float
        Robot parameters; missing ones have their default values.
    friction : float
        Coulomb coefficient; ``inf`` for feet that never slip.
    slope : float [rad]
    speed, step_length : float, (float, float) or None
        Requested value, bounds, or None for a free value [m/s, m].
    free : mapping of str to (float, float)
        Bounds of the parameters of robot and ground that are optimised with the gait: design variables, such as
        ``{"leg_mass": (1, 4), "slope": (0, 0.1)}``.  Their initial values are those of the fields above.  `speed`
        and `step_length` may also be listed here instead of as a pair above.
    objective : Objective or str
        Its integrand and peak take a :class:`gaitopt.ocp.multicontact.planar_objective.PlanarInstant`, its boundary
        term a :class:`gaitopt.ocp.multicontact.planar_step_cost.PlanarStepBoundary`.
    limits : PlanarLimits
    impulses : tuple of ActuatorImpulse
        Impulses of actuators just before or just after impacts, such as a push-off, which are unknowns.  Objectives of
        work count theirs, those of torques do not.
    margins : Margins
        `touchdown_rate` is the least approach speed of a closing contact [m/s or rad/s].  `sliding_inertia` has no
        effect: the replay reports Painleve's paradox.
    guess : PlanarGuess
    transcription : Collocation
        `intervals` is the number of intervals of each phase; a single number counts for every phase.  If
        `cost_tolerance` is stated, the intervals are doubled up to three times, until this changes the objective by at
        most this share; `fractions` must be None.
    equations : str
        ``"recursive"`` or ``"lifted"`` Newton-Euler equations.  In the lifted form accelerations and forces of the
        joints are unknowns, so that the number of nonzeros grows linearly with the number of links, if the coordinates
        are absolute angles of the links.  By default ``"by size"``: recursive up to 10 coordinates.
    name : str
    script : ScriptRecord or None
        The script that states the problem, for the record of the gait.

    Raises
    ------
    InputError
        If any argument is invalid; the message names it and gives the reason.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> problem = PlanarProblem(
    ...     robot=monopod(), sequence="foot stick > flight |", friction=1.0, speed=1.5, step_length=0.6,
    ...     objective="torque_squared",
    ... )
    >>> problem.counts
    (40, 40)
    """

    robot: PlanarRobot
    sequence: PhaseSequence
    parameters: Mapping[str, float] = field(default_factory=dict)
    friction: float = math.inf
    slope: float = 0.0
    speed: Target = None
    step_length: Target = None
    free: Mapping[str, Ends] = field(default_factory=dict)
    objective: Objective = field(default_factory=CostOfTransport)
    limits: PlanarLimits = field(default_factory=PlanarLimits)
    impulses: tuple[ActuatorImpulse, ...] = ()
    margins: Margins = field(default_factory=Margins)
    guess: PlanarGuess = field(default_factory=PoseGuess)
    transcription: Collocation = field(default_factory=Collocation)
    equations: str = "by size"
    name: str = "gait"
    script: ScriptRecord | None = None

    def __post_init__(self) -> None:
        check_robot_type(self.robot, PlanarRobot, "a PlanarRobot such as monopod()", "GaitProblem")
        for name, kind in (("limits", PlanarLimits), ("margins", Margins), ("guess", PlanarGuess)):
            hint = ', such as FromPlanarGait(load("gait.h5"))' if kind is PlanarGuess else ""
            check_type(name, getattr(self, name), kind, f"a {kind.__name__}{hint}")
        check_type("name", self.name, str, "a string")
        check_type("transcription", self.transcription, Collocation, "a Collocation(...)")
        if self.equations not in EQUATIONS:
            raise InputError(f"equations must be one of {EQUATIONS}, got {self.equations!r}.")
        set_ = object.__setattr__
        set_(self, "sequence", self._read_sequence())
        set_(self, "objective", objective_named(self.objective))
        self._check_free()
        values = self.robot.resolve({**self.parameters, "slope": self.slope, "friction": self.friction})
        values = clip_values(values, self.free)
        set_(self, "slope", values.pop("slope"))
        set_(self, "friction", values.pop("friction"))
        set_(self, "parameters", values)
        check_corners(self.robot, self.values, self.free)
        self._check_robot()
        self._check_sequence()
        check_impulses(self.impulses, self.robot, self.sequence)
        self._check_targets()

    def _read_sequence(self) -> PhaseSequence:
        """Return the sequence; if it is not possible with the robot, a faulty robot is reported first."""
        try:
            return PhaseSequence.parse(self.sequence, self.robot)
        except SequenceError:
            require_planar(self.robot, self.parameters)
            raise

    def _check_free(self) -> None:
        """Check the bounds of the free parameters; bounds of speed and step length become values of their fields."""
        free, fields = separate_targets(self.free, ("speed", "step_length"))
        for name, ends in fields.items():
            object.__setattr__(self, name, ends)
        robot, values = self.robot, {**self.parameters, "slope": self.slope, "friction": self.friction}
        object.__setattr__(self, "free", read_bounds(free, robot.parameters, values, f"Robot {robot.name!r}"))

    def __repr__(self) -> str:
        return f"PlanarProblem({self.name!r}, robot={self.robot.name!r}, sequence='{self.sequence}')"

    def __str__(self) -> str:
        return str(formulate_planar_problem(self))

    def _repr_latex_(self) -> str:
        return formulate_planar_problem(self).latex

    def replace(self, **changes: Any) -> "PlanarProblem":
        """Return the problem with some fields changed; all fields are checked again."""
        return replace(self, **changes)

    def fix_parameters(self, values: Mapping[str, float]) -> "PlanarProblem":
        """Return the problem with some parameters of robot and ground, free or not, fixed at values.

        Examples
        --------
        >>> from gaitopt.model import monopod
        >>> problem = PlanarProblem(robot=monopod(), sequence="foot stick > flight |", free={"body_mass": (5, 20)})
        >>> problem.fix_parameters({"body_mass": 8.0}).values["body_mass"]
        8.0
        """
        return self.replace(**fix_free_parameters(values, self.parameters, self.free))

    @property
    def values(self) -> dict[str, float]:
        """Every parameter of robot and ground by name (SI units); for a free one, its initial value."""
        return {**self.parameters, "slope": self.slope, "friction": self.friction}

    @property
    def free_ranges(self) -> dict[str, Ends]:
        """Bounds of all parameters of robot and ground that are optimised."""
        return dict(self.free)

    @property
    def corners(self) -> list[dict[str, float]]:
        """Values of all parameters with the free ones at their initial values, and at their bounds."""
        return list(list_corners(self.values, self.free))

    @property
    def impulse_entries(self) -> dict[ImpulseEntry, tuple[float, float]]:
        """Impulses of actuators at each impact, and their bounds [N s or N m s]."""
        return list_impulse_entries(self.impulses, self.robot, self.sequence)

    @property
    def lifted(self) -> bool:
        """Whether accelerations and forces of the joints are unknowns."""
        if self.equations == "by size":
            return self.robot.n_q > MOST_RECURSIVE and self.robot.lifted.n_j > 0
        return self.equations == "lifted"

    @property
    def counts(self) -> tuple[int, ...]:
        """Intervals of each phase."""
        intervals, phases = self.transcription.intervals, len(self.sequence.phases)
        intervals = DEFAULT_INTERVALS if intervals is None else intervals
        return tuple(intervals) if isinstance(intervals, tuple | list) else (intervals,) * phases

    @property
    def speed_range(self) -> Range:
        """Bounds of the average speed [m/s]."""
        return Range.of(self.speed, "speed", "m/s")

    @property
    def step_length_range(self) -> Range:
        """Bounds of the travel in a period [m]."""
        return Range.of(self.step_length, "step_length", "m")

    @property
    def objective_unit(self) -> str:
        """Unit of the objective; torques and forces of actuators that have any are added in SI units."""
        limits = self.limits.torques(self.robot.actuators)
        units = [unit for unit, limit in zip(self.robot.actuator_units, limits, strict=True) if limit]
        return find_objective_unit(self.objective, units)

    def describe(self) -> dict[str, Any]:
        """Return the fully resolved problem as plain data (SI units)."""
        robot, limits, tolerance = self.robot, self.limits, self.transcription.cost_tolerance
        return {
            "name": self.name,
            "robot": robot.name,
            "sequence": str(self.sequence),
            "events": [" & ".join(self.sequence.describe_event(robot, i)) for i in range(len(self.sequence.phases))],
            "objective": self.objective.name,
            "objective_unit": self.objective_unit,
            **self.values,
            "free": {name: list(ends) for name, ends in self.free.items()},
            "speed": self.speed,
            "step_length": self.step_length,
            "torque_limit": dict(zip(robot.actuators, limits.torques(robot.actuators), strict=True)),
            "coordinate_limit": {name: list(pair) for name, pair in limits.coordinate.items()},
            "height_limit": limits.heights(robot.points),
            "clearance": limits.clearance,
            "rate_limit": limits.rate,
            "shortest_phase": limits.shortest_phase,
            "longest_step": limits.longest_step,
            "least_impulse": limits.impulse,
            "impulses": [impulse.describe() for impulse in self.impulses],
            "margins": plain_fields(self.margins),
            "guess": self.guess.describe(),
            "transcription": self.transcription.name,
            "intervals": list(self.counts),
            "equations": "lifted" if self.lifted else "recursive",
            "script": self.script and self.script.describe(),
        } | ({} if tolerance is None else {"cost_tolerance": tolerance})

    def _check_robot(self) -> None:
        robot = self.robot
        if robot.n_u == 0:
            raise InputError(
                f"Robot {robot.name!r} has no actuators; an optimal gait requires at least one. "
                "Use a PlanarWalkProblem for passive gaits."
            )
        if robot.switches:
            raise InputError(
                f"Robot {robot.name!r} has switched springs, which an optimal gait cannot contain; replace them by "
                "actuators."
            )
        if not any(self.limits.torques(robot.actuators)):
            raise InputError("PlanarLimits.torque is 0 for every actuator; at least one must be greater than 0.")
        self.limits.coordinates(robot.coordinates)
        self.limits.heights(robot.points)

    def _check_sequence(self) -> None:
        modes = [mode for phase in self.sequence.phases for _, mode in phase]
        if self.friction == 0 or (math.isinf(self.friction) and any(mode.slips for mode in modes)):
            raise InputError(
                f"The sequence '{self.sequence}' needs a finite friction coefficient greater than 0, "
                f"got {self.friction:g}."
            )
        if len(self.counts) != len(self.sequence.phases):
            raise InputError(
                f"intervals has {format_count(len(self.counts), 'entry', 'entries')}, but the sequence "
                f"'{self.sequence}' has {format_count(len(self.sequence.phases), 'phase')}."
            )
        for count in self.counts:
            check_count("intervals", count, 2, 2000)
        if self.transcription.fractions is not None:
            raise InputError(
                "Collocation.fractions must be None for several contacts, whose phases have equal intervals. "
                "Use more intervals."
            )

    def _check_targets(self) -> None:
        requires_travel = (self.speed, self.step_length) != (None, None) or self.objective.per_weight_and_travel
        undeclared = state_undeclared_travel(self.robot, self.values) if requires_travel else ""
        if undeclared:
            raise InputError(f"{undeclared}.")
        if self.robot.travel is None and requires_travel:
            raise InputError(
                f"Robot {self.robot.name!r} does not travel: no coordinate moves the whole robot along the ground. "
                f"speed and step_length must be None, got {self.speed} and {self.step_length}, and the objective must "
                f"not be per travel, as 'cost_of_transport' is, got {self.objective.name!r}."
            )
        speed, step = self.speed_range, self.step_length_range
        for name, ends in (("speed", speed), ("step_length", step)):
            if getattr(self, name) is not None:
                fixed = not isinstance(getattr(self, name), tuple | list)
                object.__setattr__(self, name, ends.lower if fixed else (ends.lower, ends.upper))
        shortest = self.limits.shortest_phase * len(self.sequence.phases)
        if speed.lower > 0 and step.upper / speed.lower < shortest:
            raise InputError(
                f"speed {speed.lower:g} m/s and step_length {step.upper:g} m leave {step.upper / speed.lower:.3g} s, "
                f"less than the {shortest:g} s that the sequence '{self.sequence}' needs "
                "(PlanarLimits.shortest_phase in each phase)."
            )
        if math.isfinite(speed.upper) and step.lower / speed.upper > self.limits.longest_step:
            raise InputError(
                f"step_length {step.lower:g} m at speed {speed.upper:g} m/s takes {step.lower / speed.upper:.3g} s, "
                f"more than PlanarLimits.longest_step = {self.limits.longest_step:g} s."
            )
