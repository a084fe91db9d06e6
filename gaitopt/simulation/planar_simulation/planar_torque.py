"""The torque of a planar robot's simulation: a Function of time and state, or a law with a clock and latched values."""

from collections.abc import Iterable

import casadi as ca
import numpy as np

from gaitopt.control.planar_laws.law_slopes import latch_slope, law_slope
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.control.planar_laws.torque_formula import function_formula
from gaitopt.errors import InputError
from gaitopt.model.fast_call import FastCall
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.planar.torque_function import check_torque, passive_torque, torque_slope
from gaitopt.motion.actuator_impulses import EventImpulses
from gaitopt.motion.motion import Array
from gaitopt.motion.stated_changes import find_closing
from gaitopt.simulation.planar_simulation.law_torque import LawTorque, Measure, PartEquations
from gaitopt.simulation.planar_simulation.phase_torque import LawState, PhaseTorque, TorqueSlope, TorqueSource


def make_torque(robot: PlanarRobot, torque: ca.Function | PlanarLaw | TorqueSource | None) -> TorqueSource:
    """Return the torque of a simulation from a Function (t, q, v) -> u, a law or a source; zero by default.

    Raises
    ------
    InputError
        If the Function or the law belongs to another robot.
    """
    if isinstance(torque, TorqueSource):
        return torque
    return _LawSource(robot, torque) if isinstance(torque, PlanarLaw) else _FunctionSource(robot, torque)


class _FunctionSource(TorqueSource):
    """A torque that depends on time and state only."""

    def __init__(self, robot: PlanarRobot, torque: ca.Function | None) -> None:
        function = torque or passive_torque(robot)
        check_torque(robot, function)
        self._torque = _FunctionTorque(function)

    def start(self, time: float, q: Array, v: Array) -> None:
        return None

    def pass_impact(self, memory: LawState | None, closing: Iterable[str], time: float, q: Array, v: Array) -> None:
        return None

    def phase_torque(self, memory: LawState | None) -> PhaseTorque:
        return self._torque


class _FunctionTorque(PhaseTorque):
    def __init__(self, function: ca.Function) -> None:
        self._function = function
        self._value, slope = FastCall(function), torque_slope(function)
        self._slope = None if slope is None else FastCall(slope)
        n, n_u = function.size1_in(1), function.size1_out(0)
        self._zero = TorqueSlope(np.zeros((n_u, 2 * n)), np.zeros(n_u), np.zeros((n_u, 0)))

    @property
    def formula(self) -> ca.Function | None:
        """The torque as an expression."""
        return function_formula(self._function)

    def value(self, t: float, q: Array, v: Array) -> Array:
        return self._value(t, q, v)[0]

    def slope(self, t: float, q: Array, v: Array) -> TorqueSlope:
        if self._slope is None:
            return self._zero
        by_t, by_q, by_v = self._slope(t, q, v)
        n = len(q)
        by_state = np.vstack([by_q.reshape(n, -1), by_v.reshape(n, -1)]).T
        return TorqueSlope(by_state, by_t.copy(), self._zero.by_latched)


class _LawSource(TorqueSource):
    """The torque of a law."""

    def __init__(self, robot: PlanarRobot, law: PlanarLaw) -> None:
        sizes = {(part.control.size1_in(1), part.control.size1_out(0)) for part in law.parts}
        closing = find_closing([law.section])
        if sizes != {(robot.n_q, robot.n_u)} or not set(closing) & set(robot.contact_names):
            raise InputError(
                f"The law {law.name!r} with section {law.section!r} does not belong to robot {robot.name!r}, which has "
                f"{robot.n_q} coordinates, {robot.n_u} actuators and the contacts {robot.contact_names}."
            )
        self._robot, self._law, self.n_latched = robot, law, len(law.latched)
        place = robot.contact_names.index(closing[0])
        partner = place if robot.mirror is None else robot.mirror.contacts[place]
        self._ends = {False: robot.contact_names[place], True: robot.contact_names[partner]}
        self._functions = [part.torque for part in law.parts]
        self._calls = [(FastCall(torque), FastCall(law_slope(torque))) for torque in self._functions]
        self._measures = [None if part.phase_variable is None else Measure(part) for part in law.parts]
        self._columns = [np.ascontiguousarray(part.table.T) for part in law.parts]
        self._latch = FastCall(law.parts[0].memory.latch)

    def start(self, time: float, q: Array, v: Array) -> LawState:
        return self._restart(time, q, v, mirrored=False)

    def pass_impact(self, memory: LawState | None, closing: Iterable[str], time: float, q: Array, v: Array) -> LawState:
        if memory is None:
            return self.start(time, q, v)
        if self._ends[memory.mirrored] in closing:
            mirrored = memory.mirrored ^ (self._robot.mirror is not None)
            return self._restart(time, q, v, mirrored=mirrored)
        return memory if self._law.ending(memory.part) is not None else self._next_part(memory)

    def pass_event(self, memory: LawState | None, names: Iterable[str]) -> LawState | None:
        ending = None if memory is None else self._law.ending(memory.part)
        if memory is None or ending is None:
            return memory
        contact, _, happens = ending.rpartition(" ")
        return self._next_part(memory) if f"{self._exchange(contact, memory)} {happens}" in names else memory

    def _next_part(self, memory: LawState) -> LawState:
        return memory._replace(part=min(memory.part + 1, len(self._law.parts) - 1))

    def _exchange(self, contact: str, memory: LawState) -> str:
        """Return a contact of the plan in the robot, whose legs may be exchanged."""
        mirror, names = self._robot.mirror, self._robot.contact_names
        return names[mirror.contacts[names.index(contact)]] if memory.mirrored and mirror is not None else contact

    def impulses(self, memory: LawState | None, closing: Iterable[str]) -> EventImpulses | None:
        if memory is None or memory.part >= len(self._law.impulses):
            return None
        planned = self._law.impulses[memory.part]
        if planned is None:
            return None
        mirror = self._robot.mirror if memory.mirrored else None
        if self._exchange(planned.contact, memory) not in closing:
            return None
        matrix = np.eye(self._robot.n_u) if mirror is None else mirror.actuators.T
        return EventImpulses(*(matrix @ values for values in planned.values))

    def phase_torque(self, memory: LawState | None) -> PhaseTorque:
        if memory is None:
            raise ValueError("the torque of a law depends on its memory")
        part = memory.part
        equations = PartEquations(
            self._law.parts[part], self._functions[part], *self._calls[part], self._columns[part], self._measures[part]
        )
        return LawTorque(equations, memory, self._robot.mirror if memory.mirrored else None)

    def latched_slope(self, q: Array, v: Array) -> Array:
        memory, n = self._law.parts[0].memory, len(q)
        slope = latch_slope(memory.latch)(q, v, self._law.parts[0].table[:, 0])
        return np.array(slope).reshape(self.n_latched, 2 * n)

    def _restart(self, time: float, q: Array, v: Array, *, mirrored: bool) -> LawState:
        mirror = self._robot.mirror
        if mirrored and mirror is not None:
            q, v = mirror.coordinates @ q, mirror.coordinates @ v
        latched = self._latch(q, v, self._law.parts[0].table[:, 0])[0] if self.n_latched else ()
        return LawState(0, time, tuple(float(value) for value in latched), mirrored)
