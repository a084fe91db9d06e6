"""Periodic gaits of a planar robot with any contacts over a parameter, as a family of return maps."""

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from gaitopt.continuation.map_family import MapSample
from gaitopt.continuation.parameter_values import set_gains
from gaitopt.continuation.planar_changes import classify_planar_change, ends_early
from gaitopt.continuation.planar_chart import ChartAt, PlanarChart
from gaitopt.continuation.special_point import SpecialKind
from gaitopt.continuation.value_slope import differentiate_by_value
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.locks import cached_property
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_engine import REFERENCE, PlanarEngine
from gaitopt.simulation.planar_simulation.planar_simulator import PlanarRollout, follow
from gaitopt.simulation.planar_simulation.planar_state import PlanarState
from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle, find_cycle_from
from gaitopt.stability.planar_gaits.planar_linearisation import planar_derivative
from gaitopt.stability.planar_gaits.planar_section import PlanarSection, exchange_legs
from gaitopt.status import Stop

PARAMETER_STEP = 1e-5
"""Step of the central difference by the parameter, relative to its natural size."""
LONGEST = 5.0
"""Longest period, relative to that of the first gait."""
KEPT_AUTOMATA = 8
"""Number of values of the parameter whose equations are kept."""
SAME_PERIOD = 1e-3
"""Relative difference of the periods of two gaits beside a continuous change."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanarFamily:
    """Return maps of a planar robot over one parameter.

    Attributes
    ----------
    robot : PlanarRobot
    parameters : dict of str to float
        All other parameters, the gains of the law included.
    parameter : str
    torque : Function, PlanarLaw or None
    section : str
        Event that ends a period.
    start_state : PlanarState
        Right after the section, with the contacts that are closed there.
    chart : PlanarChart
        Coordinates of the section.
    longest : float
        Longest period [s].
    steps : int
        Periods of the first gait after which the gaits repeat.
    line : mapping of str to (float, float)
        See :class:`gaitopt.continuation.gait_family.GaitFamily`.
    engine : PlanarEngine
        By default the reference engine.
    scale, value_scale
        See :class:`gaitopt.continuation.map_family.MapFamily`.
    """

    robot: PlanarRobot
    parameters: dict[str, float]
    parameter: str
    torque: ca.Function | PlanarLaw | None
    section: str
    start_state: PlanarState
    chart: PlanarChart
    longest: float
    steps: int
    scale: Array
    value_scale: float
    line: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    engine: PlanarEngine = REFERENCE

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.chart.size

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        return self.chart.names

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the coordinates."""
        return self.chart.units

    def evaluate(self, z: Array, value: float) -> MapSample:
        """Simulate the periods from a point of the section."""
        try:
            automaton, chart = self._at(value)
        except InputError:
            return MapSample(None, f"{self.parameter} out of range")
        following, rollouts = np.array(z), list[PlanarRollout]()
        for _ in range(self.steps):
            rollout = self._simulate(automaton, chart, following)
            if rollout is None or rollout.end is None or rollout.stop is not Stop.EVENT_REACHED:
                return MapSample(None, "no gait" if rollout is None else _reason(rollout.stop))
            rollouts.append(rollout)
            following = chart.read(exchange_legs(rollout.end, self.robot, self.robot.mirror).y)
        return MapSample(following - z, name_rollouts(rollouts), tuple(rollouts))

    def derivative(self, z: Array, value: float, sample: MapSample, by_value: Array | None = None) -> Array:
        """Return the derivative of the residual: exact for z, a central difference for the parameter."""
        if self._latest.get("sample") is not sample:
            automaton, chart = self._at(value)
            by_z = np.eye(self.size)
            for rollout in sample.passage:
                by_z = self._step_derivative(automaton, chart, rollout) @ by_z
            self._latest.update(sample=sample, by_z=by_z)
        by_z = self._latest["by_z"]
        if by_value is None:
            by_value = differentiate_by_value(self, z, value, sample, self._latest["by_z"], PARAMETER_STEP)
        return np.column_stack([by_z - np.eye(self.size), by_value])

    def _step_derivative(self, automaton: PlanarAutomaton, chart: ChartAt, rollout: PlanarRollout) -> Array:
        """Return the derivative of the map of one period, shape (n, n)."""
        start, end, n = rollout.start, rollout.end, 2 * self.robot.n_q
        if start is None or end is None:
            raise ValueError("a period has a start and an end")
        section = PlanarSection(automaton, rollout.arcs[-1], rollout.motion.events[-1], self.robot.mirror)
        matrix = section.matrix() @ planar_derivative(automaton, rollout)
        by_state = matrix[:, :n] + matrix[:, n:] @ automaton.torque.latched_slope(start.q, start.v)
        return np.asarray(chart.reading(section.exchange(end).y) @ by_state @ chart.embedding(start.y))

    def multipliers(self, derivative: Array, sample: MapSample) -> NDArray[np.complex128]:
        """Return the multipliers without those of slip speeds that are 0 after the section."""
        matrix = derivative[:, :-1] + np.eye(self.size)
        if _sticks(sample):
            keep = len(self.chart.entries)
            matrix = matrix[:keep, :keep]
        values = np.linalg.eigvals(matrix).astype(complex)
        return values[np.argsort(-np.abs(values))]

    def measures(self, z: Array, value: float, sample: MapSample) -> dict[str, float]:
        """Return the lowest clearance of a foot that swings, whose zero is scuffing."""
        from gaitopt.continuation.planar_clearance import lowest_clearance

        automaton, _ = self._at(value)
        clearance = lowest_clearance(automaton, sample.passage)
        return {} if clearance is None else {"scuffing": clearance}

    def apex_energy(self, z: Array, value: float, sample: MapSample) -> None:
        """Return None: these robots fall when a contact that marks a fall closes, not at an equilibrium."""

    def orbit(self, z: Array, value: float, sample: MapSample) -> Array:
        """Return the point of the section at the start of each period, shape (steps, n)."""
        chart = self._at(value)[1]
        return np.array([chart.read(rollout.start.y) for rollout in sample.passage])

    def after_change(self, z: Array, sample: MapSample) -> Array:
        """Return a point with the slip speeds left by its touchdown."""
        keep = len(self.chart.entries)
        return z if sample.residual is None else np.append(z[:keep], z[keep:] + sample.residual[keep:])

    def classify(self, before: MapSample, after: MapSample) -> SpecialKind:
        """Return the kind of a change between two samples; a step that ends too early scuffs."""
        if ends_early(str(before.structure), str(after.structure)):
            periods = [sample.passage[0].motion.period for sample in (before, after)]
            if abs(periods[1] - periods[0]) > SAME_PERIOD * periods[0]:
                return SpecialKind.SCUFFING
        return self.classify_names(str(before.structure), str(after.structure))

    def classify_names(self, before: str, after: str) -> SpecialKind:
        """Return the kind of a change between two contact sequences."""
        stops = [contact.name for contact in self.robot.contacts if contact.is_stop]
        return classify_planar_change(before, after, stops)

    def keeps_coordinates(self, before: MapSample, after: MapSample) -> bool:
        """Return whether the same contacts are closed after the section, so that the coordinates are the same."""
        return _closed_contacts(before) == _closed_contacts(after)

    def double_period(self) -> "PlanarFamily":
        """Return the family of the maps of twice as many periods."""
        return replace(self, steps=2 * self.steps)

    def start(self, cycle: PlanarCycle) -> Array:
        """Return a periodic gait as a point of the section of the family, shape (n,)."""
        p = self.robot.vector(self.robot.resolve(cycle.parameters), self.start_state.extended)
        return self.chart.at(p).read(np.array([*cycle.state.values()]))

    def cycle(self, z: Array, value: float) -> PlanarCycle | None:
        """Return the periodic gait of one period near a point, or None if none exists."""
        automaton, chart = self._at(value)
        y, n = chart.embed(z), self.robot.n_q
        if y is None or self.steps > 1:
            return None
        try:
            return find_cycle_from(automaton, y[:n], y[n:], self.section)
        except InputError:
            return None

    def _simulate(self, automaton: PlanarAutomaton, chart: ChartAt, z: Array) -> PlanarRollout | None:
        """Return one period from a point of the section, or None if there is no such state."""
        y, n = chart.embed(z), self.robot.n_q
        if y is None:
            return None
        state = automaton.restart(replace(self.start_state, time=0.0, q=y[:n], v=y[n:]))
        chosen = automaton.events.choose(state, state.closed, state.latched, {})
        return follow(automaton, chosen, duration=self.longest, until=self.section)

    @cached_property
    def _latest(self) -> dict[str, Any]:
        """The last sample whose derivative was computed, and its derivative with respect to the state."""
        return {}

    @cached_property
    def _automata(self) -> dict[float, tuple[PlanarAutomaton, ChartAt]]:
        """The last equations, by the value of the parameter."""
        return {}

    def _at(self, value: float) -> tuple[PlanarAutomaton, ChartAt]:
        if value not in self._automata:
            while len(self._automata) >= KEPT_AUTOMATA:
                del self._automata[next(iter(self._automata))]
            automaton = self._make_automaton(value)
            self._automata[value] = automaton, self.chart.at(automaton.p(self.start_state.extended))
        return self._automata[value]

    def _make_automaton(self, value: float) -> PlanarAutomaton:
        line = self.line or {self.parameter: (0.0, 1.0)}
        moved = {name: origin + value * slope for name, (origin, slope) in line.items()}
        known = {each.name for each in self.robot.parameters}
        values = {name: number for name, number in {**self.parameters, **moved}.items() if name in known}
        torque = set_gains(self.robot, self.torque, moved) if isinstance(self.torque, PlanarLaw) else self.torque
        return PlanarAutomaton(self.robot, self.robot.resolve(values), torque, engine=self.engine)


def name_rollouts(rollouts: list[PlanarRollout]) -> str:
    """Return the contact sequences of periods, each with the outcome of its last impact."""
    return "; ".join(f"{rollout.motion.sequence} {_name_outcome(rollout)}".removesuffix(" ") for rollout in rollouts)


def _name_outcome(rollout: PlanarRollout) -> str:
    outcome = rollout.motion.events[-1].outcome
    if outcome is None:
        return ""
    return ", ".join(f"{name} {mode.value}" for name, mode in outcome.modes if name in outcome.closed)


def _closed_contacts(sample: MapSample) -> list[frozenset[str]]:
    """Return the contacts that are closed after the section of each period."""
    return [frozenset(rollout.motion.events[-1].after.closed) for rollout in sample.passage]


def _sticks(sample: MapSample) -> bool:
    """Return whether no contact slips in the impacts on the section."""
    outcomes = [rollout.motion.events[-1].outcome for rollout in sample.passage]
    return all(outcome is not None and not any(mode.slips for _, mode in outcome.modes) for outcome in outcomes)


def _reason(stop: Stop) -> str:
    return Stop.NO_TOUCHDOWN.key if stop is Stop.DURATION_DONE else stop.key


def make_planar_family(
    robot: PlanarRobot,
    cycle: PlanarCycle,
    parameter: str,
    ends: tuple[float, float],
    *,
    torque: ca.Function | PlanarLaw | None = None,
    values: Mapping[str, float],
    engine: PlanarEngine = REFERENCE,
) -> PlanarFamily:
    """Return the family to which a periodic gait belongs.

    Parameters
    ----------
    robot : PlanarRobot
    cycle : PlanarCycle
    parameter : str
    ends : (float, float)
        Ends of the range of the parameter.
    torque : Function or PlanarLaw, optional
        Zero by default.
    values : mapping of str to float
        All parameters and gains of the gait.
    engine : PlanarEngine
        By default the reference engine.
    """
    law = set_gains(robot, torque, values) if isinstance(torque, PlanarLaw) else torque
    automaton = PlanarAutomaton(robot, robot.resolve(cycle.parameters), law, engine=engine)
    y, n = np.array([*cycle.state.values()]), robot.n_q
    start = PlanarState(0.0, y[:n], y[n:], cycle.motion.segments[0].state, (False,) * len(robot.switches))
    rollout = follow(
        automaton,
        automaton.events.choose(automaton.restart(start), start.closed, start.latched, {}),
        duration=LONGEST * cycle.period,
        until=cycle.section,
    )
    section = PlanarSection(automaton, rollout.arcs[-1], rollout.motion.events[-1], robot.mirror)
    slips = bool(np.isfinite(automaton.values["friction"])) or parameter == "friction"
    if robot.travel is not None:
        y[robot.coordinates.index(robot.travel)] = 0.0
    chart = PlanarChart(robot, section.rows, y, automaton.p(start.extended), slips=slips)
    return PlanarFamily(
        robot=robot,
        parameters=dict(values),
        parameter=parameter,
        torque=torque,
        section=cycle.section,
        start_state=start,
        chart=chart,
        longest=LONGEST * cycle.period,
        steps=1,
        scale=_find_scale(chart, cycle),
        value_scale=abs(ends[1] - ends[0]),
        engine=engine,
    )


def _find_scale(chart: PlanarChart, cycle: PlanarCycle) -> Array:
    """Return the range of each coordinate over the period, shape (n,); of a slip speed, that of all speeds."""
    states = np.vstack([cycle.motion.channel("q"), cycle.motion.channel("v")])
    ranges = np.ptp(states, axis=1)
    fastest = float(np.max(ranges[chart.robot.n_q :]))
    entries = np.maximum(ranges[list(chart.entries)], 1e-3 * np.max(ranges))
    return np.append(entries, np.full(len(chart.speeds), fastest))
