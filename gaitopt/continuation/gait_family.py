"""Periodic gaits of a walker over a parameter of robot, ground or law, as a family of return maps."""

import math
from collections.abc import Mapping
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaitopt.continuation.apex_energy import least_kinetic_energy
from gaitopt.continuation.branch_diagram import section_unit
from gaitopt.continuation.map_family import MapSample
from gaitopt.continuation.parameter_values import gains_of, set_gains
from gaitopt.continuation.special_point import SpecialKind, classify_change, read_structure
from gaitopt.continuation.value_slope import differentiate_by_value
from gaitopt.control.law import Law
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.locks import cached_property
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.step_limits import StepLimits
from gaitopt.stability.cycle import Cycle, slips_throughout
from gaitopt.stability.cycle_iteration import find_cycle, search_section
from gaitopt.stability.cycle_search import MAX_STEP_TIME
from gaitopt.stability.linearisation import Linearisation
from gaitopt.stability.return_map import Passage, ReturnMap
from gaitopt.stability.section import Section
from gaitopt.stability.section_walk import natural_rate, natural_scale

PARAMETER_STEP = 1e-6
"""Step of the central difference by the parameter, relative to its natural size."""

KEPT_WALKERS = 8
"""Number of values of the parameter whose walkers are kept."""
COMPLETE_SLIP_SPEED = 3.0
"""Foot speed of complete slip, relative to the natural speed sqrt(g l)."""

Structure = tuple[tuple[tuple[Mode, ...], Mode | None], ...]
"""Contact modes and outcome of the touchdown of each step."""


@dataclass(frozen=True, eq=False, kw_only=True)
class GaitFamily:
    """Return maps of a walker over one parameter.

    The coordinates are those of the section with foot speed.  In complete slip the foot speed drifts and does not
    influence the motion: there its row of the residual is zero, so that its value is kept.

    Attributes
    ----------
    robot : Robot
    parameters : dict of str to float
        All other parameters, the gains of the law included.
    parameter : str
    law : Law
    engine : Engine
    steps : int
        Steps of the return map.
    line : dict of str to (float, float)
        For a line in the space of several parameters: origin and direction; the parameter of the family is then the
        coordinate along this line.
    size, scale, value_scale
        See :class:`gaitopt.continuation.map_family.MapFamily`.

    Examples
    --------
    >>> from gaitopt import compass_biped, find_cycles
    >>> gait = find_cycles(compass_biped(), {"slope": 0.0174533, "friction": 0.3}, starts=10)[0]
    >>> family = make_gait_family(compass_biped(), gait, "friction", (0.3, 0.1))
    >>> bool(np.max(np.abs(family.evaluate(family.start(gait), 0.3).residual)) < 1e-10)
    True
    """

    robot: Robot
    parameters: dict[str, float]
    parameter: str
    law: Law
    engine: Engine
    steps: int
    size: int
    scale: Array
    value_scale: float
    line: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def evaluate(self, z: Array, value: float) -> MapSample:
        """Simulate the steps from a point of the section."""
        try:
            walker, section, _ = self._walker(value)
        except InputError:
            return MapSample(None, f"{self.parameter} out of range")
        passage = ReturnMap(walker, section, self.steps)(z)
        if passage.end is None:
            return MapSample(None, passage.stop.key if passage.stop is not None else "no gait", passage)
        residual = passage.end - z
        structure = structure_of(passage)
        if section.sliding and slips_completely(structure):
            residual[-1] = 0.0
        return MapSample(residual, structure, passage)

    def derivative(self, z: Array, value: float, sample: MapSample, by_value: Array | None = None) -> Array:
        """Return the derivative of the residual: exact for z, a central difference for the parameter."""
        walker, section, linearisation = self._walker(value)
        if self._latest.get("sample") is not sample:
            return_map = ReturnMap(walker, section, self.steps, linearisation)
            self._latest.update(sample=sample, by_z=return_map.derivative(z, sample.passage) - np.eye(self.size))
        by_z = self._latest["by_z"].copy()
        if by_value is None:
            by_value = differentiate_by_value(self, z, value, sample, self._latest["by_z"], PARAMETER_STEP)
        by_value = np.array(by_value)
        if section.sliding and slips_completely(sample.structure):
            by_z[-1], by_value[-1] = np.eye(self.size)[-1], 0.0
        return np.column_stack([by_z, by_value])

    def multipliers(self, derivative: Array, sample: MapSample) -> NDArray[np.complex128]:
        """Return the multipliers without that of a foot speed that is 0 after the touchdown or has no influence."""
        matrix = derivative[:, :-1] + np.eye(self.size)
        if slips_completely(sample.structure) or sticks_at_touchdown(sample.structure):
            keep = len(self._rigid)
            matrix = matrix[:keep, :keep]
        values = np.linalg.eigvals(matrix).astype(complex)
        return values[np.argsort(-np.abs(values))]

    def measures(self, z: Array, value: float, sample: MapSample) -> dict[str, float]:
        """Return the change of the foot speed over a period of complete slip."""
        if "foot_speed" not in self.names or not slips_completely(sample.structure):
            return {}
        following = sample.passage.walk_steps[-1].following
        return {"drift_reversal": float(following[self.robot.state_entries.slip_velocity] - z[-1])}

    def apex_energy(self, z: Array, value: float, sample: MapSample) -> float:
        """Return the least kinetic energy of the joint rates along the steps [J]."""
        return least_kinetic_energy(self._walker(value)[0], sample.passage.states)

    def orbit(self, z: Array, value: float, sample: MapSample) -> Array:
        """Return the point of the section at the start of each step of the period, shape (steps, n)."""
        section = self._section(value)
        return np.array([section.project(state) for state in sample.passage.states])

    def after_change(self, z: Array, sample: MapSample) -> Array:
        """Return a point with the foot speed left by its touchdown, so that its first phase is that of the new gait."""
        if sample.residual is None or "foot_speed" not in self.names:
            return z
        return np.append(z[:-1], z[-1] + sample.residual[-1])

    def classify(self, before: MapSample, after: MapSample) -> SpecialKind:
        """Return the kind of a change between two samples."""
        return classify_change(before.structure, after.structure)

    def classify_names(self, before: str, after: str) -> SpecialKind:
        """Return the kind of a change between two contact sequences."""
        return classify_change(read_structure(before), read_structure(after))

    def keeps_coordinates(self, before: MapSample, after: MapSample) -> bool:
        """Return whether gaits before and after a change are periodic in the same coordinates.

        In complete slip the foot speed drifts: such gaits form a separate branch.
        """
        return slips_completely(before.structure) == slips_completely(after.structure)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the coordinates."""
        return tuple(map(section_unit, self.names))

    def double_period(self) -> "GaitFamily":
        """Return the family of the maps of twice as many steps."""
        values = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return GaitFamily(**values | {"steps": 2 * self.steps})

    def start(self, cycle: Cycle) -> Array:
        """Return a periodic gait as a point of the section of the family, shape (n,).

        The foot speed of complete slip has no influence; it is set to a speed that remains large over a step.
        """
        values = {"foot_speed": 0.0} | cycle.state
        if cycle.drift:
            natural, height = natural_rate(self.robot, self.robot.vector(cycle.parameters))
            speed = COMPLETE_SLIP_SPEED * natural * height
            values["foot_speed"] = math.copysign(max(abs(values["foot_speed"]), speed), values["foot_speed"])
        return np.array([values[name] for name in self.names])

    def cycle(self, z: Array, value: float) -> Cycle | None:
        """Return the periodic gait at a point with all its derived quantities, or None if none exists."""
        return find_cycle(self._walker(value)[0], z, self.steps)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        return self._section(0.0 if self.line else self.parameters[self.parameter]).names

    @cached_property
    def _rigid(self) -> tuple[str, ...]:
        return tuple(name for name in self.names if name != "foot_speed")

    def _section(self, value: float) -> Section:
        return self._walker(value)[1]

    @cached_property
    def _latest(self) -> dict[str, Any]:
        """The last sample whose derivative was computed, and its derivative with respect to the state."""
        return {}

    @cached_property
    def _walkers(self) -> dict[float, tuple[Walker, Section, Linearisation]]:
        """The last walkers, by the value of the parameter."""
        return {}

    def _walker(self, value: float) -> tuple[Walker, Section, Linearisation]:
        if value not in self._walkers:
            while len(self._walkers) >= KEPT_WALKERS:
                del self._walkers[next(iter(self._walkers))]
            self._walkers[value] = self._make_walker(value)
        return self._walkers[value]

    def _make_walker(self, value: float) -> tuple[Walker, Section, Linearisation]:
        line = self.line or {self.parameter: (0.0, 1.0)}
        moved = {name: origin + value * slope for name, (origin, slope) in line.items()}
        known = {each.name for each in self.robot.parameters}
        values = {name: number for name, number in {**self.parameters, **moved}.items() if name in known}
        p, law = self.robot.vector(self.robot.resolve(values)), set_gains(self.robot, self.law, moved)
        walker = make_patient_walker(self.robot, law, p, self.engine)
        return walker, search_section(walker), Linearisation(walker)


def make_gait_family(
    robot: Robot,
    cycle: Cycle,
    parameter: str,
    ends: tuple[float, float],
    *,
    law: Law | None = None,
    engine: Engine | None = None,
) -> GaitFamily:
    """Return the family to which a periodic gait belongs.

    Parameters
    ----------
    robot : Robot
    cycle : Cycle
    parameter : str
    ends : (float, float)
        Ends of the range of the parameter.
    law : Law, optional
        Passive by default.
    engine : Engine, optional

    """
    from gaitopt.control.law import passive
    from gaitopt.simulation.engine_choice import default_engine

    law = law or passive(robot)
    engine = engine or default_engine(law, robot)
    values = robot.resolve(cycle.parameters)
    walker = Walker(robot, law, robot.vector(values), engine)
    section = search_section(walker)
    if parameter == "friction":
        section = Section(robot, walker.p, sliding=True)
    return GaitFamily(
        robot=robot,
        parameters=gains_of(law) | dict(values),
        parameter=parameter,
        law=law,
        engine=engine,
        steps=len(cycle.sequences),
        size=len(section.names),
        scale=natural_scale(walker, section, section.project(cycle.section.embed(cycle.z))),
        value_scale=abs(ends[1] - ends[0]),
    )


def make_patient_walker(robot: Robot, law: Law, p: Array, engine: Engine) -> Walker:
    """Return a walker whose steps may take as long as in a search for gaits, as those that just roll over do."""
    limits = StepLimits(duration=MAX_STEP_TIME / natural_rate(robot, p)[0])
    return Walker(robot, law, p, engine, step_limits=limits)


def structure_of(passage: Passage) -> Structure:
    """Return contact modes and outcome of the touchdown of each step."""
    return tuple(
        (walk_step.modes, walk_step.impact.mode if walk_step.impact else None) for walk_step in passage.walk_steps
    )


def slips_completely(structure: object) -> bool:
    """Return whether every step slips in one direction from impact to impact."""
    return isinstance(structure, tuple) and all(slips_throughout(modes, impact) for modes, impact in structure)


def sticks_at_touchdown(structure: object) -> bool:
    """Return whether the landing foot sticks at every touchdown."""
    return isinstance(structure, tuple) and all(impact is Mode.STICK for _, impact in structure)


def name_structure(structure: object) -> str:
    """Return the contact sequences of a structure as text; a reason is returned unchanged."""
    if not isinstance(structure, tuple):
        return str(structure)
    return "; ".join(
        f"{' '.join(mode.value for mode in modes)} | {impact.value if impact else '-'}" for modes, impact in structure
    )
