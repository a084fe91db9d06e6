"""MultiStepProblem: the definition of an optimal gait of several steps that differ."""

import math
from collections.abc import Mapping
from dataclasses import asdict, field, replace
from typing import Any

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.locks import cached_property
from gaitopt.model.coordinate_entries import ANGLES, SLIDE
from gaitopt.model.robot import Robot
from gaitopt.model.section_coordinate import dependent_coordinate
from gaitopt.model.terrain import Terrain, check_terrain
from gaitopt.model.uneven_ground import RISE, UNEVEN, adapt_to_uneven_ground
from gaitopt.motion.gait import Gait
from gaitopt.ocp.multistep.foothold_ground import Foothold, find_footholds, resolve_steps
from gaitopt.ocp.problem import GaitProblem

FOOT_SPEED = "foot_speed"
"""Name of the speed of the stance foot in a state after touchdown."""


@check_arguments
@dataclass(frozen=True, kw_only=True, eq=False)
class MultiStepProblem:
    """An optimal-control problem for several consecutive steps, each with its own sequence, friction and limits.

    Each step is stated by a :class:`gaitopt.GaitProblem`.  The impact of its sequence is the touchdown that begins the
    step, on the ground of the step; the last touchdown before a stated end has the impact of the last step.  The sum of
    the objectives of the steps is minimised.

    Attributes
    ----------
    steps : tuple of GaitProblem
        The steps in order, with the same robot and the same parameters; the ground may differ.
    start : mapping of str to float or None
        Known coordinates of the first state, which is that of a pose after touchdown: angles [rad], their rates
        ``NAME_rate`` [rad/s] and ``foot_speed`` [m/s].  Coordinates that are not named are free.  None for `start` and
        `end` means that the gait repeats after these steps.
    end : mapping of str to float or None
        Known coordinates of the state after the last touchdown, as for `start`; an empty mapping leaves it free.
    footholds : mapping of int to (float, float)
        Bounds of the position of the stance foot at the start of ``steps[number]``, relative to that at the start of
        ``steps[0]`` [m], by number.  On a terrain the number of steps stands for the foothold of the last touchdown.
    terrain : Terrain or None
        Steps, ramps and patches of the ground, with ``steps[0]`` beginning at place 0.  Each step gets the friction and
        the inclination at its foothold, and the rise to the next one.
    expected_places : mapping of int to float
        Expected places of the footholds on the terrain [m], by number, which determine their pieces.  By default a
        foothold is in the middle of its bounds, or one step ahead of the previous one.
    name : str

    Raises
    ------
    InputError
        If there is no step, the steps have different robots or slopes, or free parameters other than ``rise``, only one
        of `start` and `end` is given, a coordinate is unknown or not finite, or a foothold does not fit on its piece of
        the terrain.

    Examples
    --------
    >>> from gaitopt import Limits, compass_biped
    >>> step = GaitProblem(robot=compass_biped(), sequence="stick | stick", friction=0.3, limits=Limits(torque=10))
    >>> problem = MultiStepProblem(steps=(step, step), start={"th1_rate": 0.0, "th2_rate": 0.0}, end={})
    >>> problem.periodic, len(problem.steps)
    (False, 2)
    """

    steps: tuple[GaitProblem, ...]
    start: Mapping[str, float] | None = None
    end: Mapping[str, float] | None = None
    footholds: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    terrain: Terrain | None = None
    expected_places: Mapping[int, float] = field(default_factory=dict)
    name: str = "gait of several steps"
    robot: Robot = field(init=False)

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "steps", tuple(self.steps))
        if not self.steps or not all(isinstance(step, GaitProblem) for step in self.steps):
            raise InputError("steps must contain at least one GaitProblem(...).")
        first = self.steps[0]
        set_(self, "robot", first.robot if check_terrain(self.terrain) is None else adapt_to_uneven_ground(first.robot))
        for number, step in enumerate(self.steps):
            step.sequence.require_closed("A gait of several steps")
            if step.robot is not first.robot or self._common_parameters(step) != self._common_parameters(first):
                raise InputError(
                    f"steps[{number}] differs from steps[0] in its robot or in the parameters of the robot; all steps "
                    "need the same robot with the same parameters."
                )
            if set(step.free) - {RISE}:
                raise InputError(
                    f"steps[{number}] has the free parameters {sorted(step.free)}; gaits of several steps accept only "
                    f"{RISE!r}, because the robot must be the same in all steps."
                )
            if len(set(step.slope_range)) > 1:
                raise InputError(f"steps[{number}] has a free slope; gaits of several steps need a fixed slope.")
            if step.slope != first.slope:
                raise InputError(
                    f"steps[{number}] has the slope {step.slope:g} rad, but steps[0] has {first.slope:g} rad: angles "
                    "are measured from the normal of the slope, so all steps need the same slope; "
                    "terrain=Terrain(ramps=...) inclines the ground."
                )
        if (self.start is None) is not (self.end is None):
            raise InputError("start and end must both be stated, or both be None for a gait that repeats.")
        for name in ("start", "end"):
            if (state := getattr(self, name)) is not None:
                set_(self, name, self._check_state(name, state))
        self._check_start()
        self._check_footholds()
        if self.terrain is not None and self.periodic:
            raise InputError(
                "A gait on a terrain needs start and end, because it does not repeat. For a periodic "
                "gait on stairs, use a GaitProblem of adapt_to_uneven_ground(robot) with the parameter rise."
            )
        self.resolved_steps  # noqa: B018 - footholds that do not fit are reported when the problem is stated

    def __str__(self) -> str:
        from gaitopt.ocp.multistep.multistep_formulation import formulate_steps

        return str(formulate_steps(self))

    def _repr_latex_(self) -> str:
        from gaitopt.ocp.multistep.multistep_formulation import formulate_steps

        return formulate_steps(self).latex

    def describe(self) -> dict[str, Any]:
        """Return the steps, the ends, the footholds and the terrain as plain data (SI units, angles in rad)."""
        ground = None if self.terrain is None else asdict(self.terrain)
        return {
            "name": self.name,
            "start": self.start,
            "end": self.end,
            "footholds": {str(number): list(pair) for number, pair in self.footholds.items()},
            "terrain": ground,
            "steps": [step.describe() for step in self.steps],
        }

    @property
    def periodic(self) -> bool:
        """Whether the first step follows the last one."""
        return self.start is None

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates of a state after touchdown."""
        angles = self.robot.angles
        return (*angles, *(f"{angle}_rate" for angle in angles), FOOT_SPEED)

    @cached_property
    def ground(self) -> tuple[Foothold, ...]:
        """Footholds on the terrain, including that of the last touchdown; empty on a plane."""
        if self.terrain is None:
            return ()
        return find_footholds(self.terrain, self.steps, self.footholds, self.expected_places)

    @cached_property
    def resolved_steps(self) -> tuple[GaitProblem, ...]:
        """The steps with the ground at their footholds."""
        return self.steps if self.terrain is None else resolve_steps(self.steps, self.ground)

    @property
    def last_friction(self) -> float:
        """Friction of the ground of the last touchdown."""
        on_patch = self.ground[-1].piece.friction if self.ground else None
        return self.steps[0 if self.periodic else -1].friction if on_patch is None else on_patch

    def _common_parameters(self, step: GaitProblem) -> dict[str, float]:
        """Return the parameters of a step that must be the same in all steps: all but those of the terrain."""
        varied = [] if self.terrain is None else [parameter.name for parameter in UNEVEN]
        return {name: value for name, value in step.parameters.items() if name not in varied}

    def replace(self, **changes: Any) -> "MultiStepProblem":
        """Return the problem with some fields changed; all fields are checked again."""
        return replace(self, **changes)

    def fixed_coordinates(self, state: Mapping[str, float]) -> dict[str, float]:
        """Return the coordinates of a state that are fixed; the pose after touchdown determines one of the angles."""
        angles = self.robot.angles
        dependent = angles[dependent_coordinate(self.robot)]
        complete = all(angle in state for angle in angles)
        return {name: value for name, value in state.items() if not (complete and name == dependent)}

    def _check_state(self, which: str, state: Mapping[str, float]) -> dict[str, float]:
        for name, value in state.items():
            if name not in self.coordinates:
                raise InputError(f"{which}: there is no coordinate {name!r}. {suggest(name, self.coordinates)}")
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                raise InputError(f"{which}: {name} must be a finite number, got {value!r}.")
        return {name: float(value) for name, value in state.items()}

    def _check_start(self) -> None:
        """Raise InputError unless the speed of the foot in a stated start agrees with the first phase."""
        if self.start is None:
            return
        mode, speed = self.steps[0].sequence.phases[0], self.start.get(FOOT_SPEED, 0.0)
        if speed and not mode.slips:
            raise InputError(f"start: {FOOT_SPEED} must be 0 for a first phase {mode.value!r}, got {speed:g}.")

    def _check_footholds(self) -> None:
        numbers = range(1, len(self.steps) + (self.terrain is not None))
        for name in ("footholds", "expected_places"):
            for number in getattr(self, name):
                if isinstance(number, bool) or number not in numbers:
                    raise InputError(
                        f"{name}: the number of a step must be one of {list(numbers)}, got "
                        f"{number!r}; steps are counted from 0, and steps[0] begins at position 0."
                    )
        for number, pair in self.footholds.items():
            if len(pair) != 2 or not (pair[0] <= pair[1] and pair[0] < math.inf and pair[1] > -math.inf):
                raise InputError(
                    f"footholds: the position of steps[{number}] must be a pair (lower, upper) [m] with "
                    f"lower <= upper, lower < inf and upper > -inf, got {pair!r}."
                )
        for number, place in self.expected_places.items():
            if not math.isfinite(place):
                raise InputError(f"expected_places: the position of steps[{number}] must be finite, got {place!r} m.")


@check_arguments
def state_after_touchdown(gait: Gait) -> dict[str, float]:
    """Return the state of a gait after its touchdown by name, for the start or the end of a gait of several steps.

    Examples
    --------
    >>> from gaitopt import load
    >>> state = state_after_touchdown(load("docs/examples/compass_slip.h5"))
    >>> sorted(state), state["foot_speed"] > 0
    (['foot_speed', 'th1', 'th1_rate', 'th2', 'th2_rate'], True)
    """
    jump, angles = gait.motion.jumps[0], gait.motion.angles
    values = dict(zip(angles, jump.q_next[ANGLES].tolist(), strict=True))
    rates = {f"{name}_rate": rate for name, rate in zip(angles, jump.v_next[ANGLES].tolist(), strict=True)}
    return values | rates | {FOOT_SPEED: float(jump.v_next[SLIDE])}
