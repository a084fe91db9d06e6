"""The law of a robot with several contacts as a Python module that needs NumPy only."""

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.export.c_controller import list_law_functions
from gaitopt.export.planar_impulses import write_python_impulses
from gaitopt.export.python_code import write_array, write_function, write_literal
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.stated_changes import find_closing
from gaitopt.version import __version__


def list_sections(robot: PlanarRobot, law: PlanarLaw) -> tuple[str, str]:
    """Return the contacts whose impact ends a period: with the legs of the plan, and with exchanged legs."""
    (contact,) = find_closing([law.section])
    if robot.mirror is None:
        return contact, contact
    return contact, robot.contact_names[robot.mirror.contacts[robot.contact_names.index(contact)]]


def list_matrices(robot: PlanarRobot) -> tuple[ca.DM, ca.DM]:
    """Return the matrices of the exchange of legs: of q and v to those of the plan, and of its torques back."""
    mirror = robot.mirror
    if mirror is None:
        return ca.DM.eye(robot.n_q), ca.DM.eye(robot.n_u)
    return ca.DM(mirror.coordinates), ca.DM(mirror.actuators.T)


def list_endings(robot: PlanarRobot, law: PlanarLaw) -> list[tuple[str, str] | None]:
    """Return the event without impact that ends each part, with the legs of the plan and with exchanged legs.

    It is None for a part that ends with an impact.
    """
    names, mirror, endings = robot.contact_names, robot.mirror, list[tuple[str, str] | None]()
    for part in range(len(law.parts)):
        ending = law.ending(part)
        if ending is None:
            endings.append(None)
            continue
        contact, _, happens = ending.rpartition(" ")
        other = contact if mirror is None else names[mirror.contacts[names.index(contact)]]
        endings.append((ending, f"{other} {happens}"))
    return endings


def write_planar_module(robot: PlanarRobot, law: PlanarLaw) -> str:
    """Return the text of the module."""
    coordinates, actuators = (np.array(matrix) for matrix in list_matrices(robot))
    tables = [part.table.T for part in law.parts]
    impulses, method = write_python_impulses(robot, law)
    parts = [
        _MODULE.format(
            robot=write_literal(robot.name),
            law=write_literal(law.name),
            version=__version__,
            coordinates=write_literal(join_units(robot.coordinates, robot.units)),
            actuators=write_literal(join_units(robot.actuators, robot.actuator_units)),
            latched=write_literal(", ".join(law.latched) or "none"),
        ),
        f"SECTIONS = {list_sections(robot, law)!r}",
        f"ENDINGS = {list_endings(robot, law)!r}",
        f"HAS_EXCHANGE = {robot.mirror is not None}",
        f"EXCHANGE_Q = {write_array(coordinates)}.reshape({robot.n_q}, {robot.n_q})",
        f"EXCHANGE_U = {write_array(actuators)}.reshape({robot.n_u}, {robot.n_u})",
        f"BREAKPOINTS = [{', '.join(write_array(part.breakpoints) for part in law.parts)}]",
        f"TABLES = [{', '.join(f'{write_array(table)}.reshape{table.shape}' for table in tables)}]",
        *([impulses] if impulses else []),
        *(f"\n\n{write_function(function, f'_{function.name()}')}" for function in list_law_functions(law)),
        f"\n\nTORQUES = [{', '.join(f'_torque_{number}' for number in range(len(law.parts)))}]",
        f"PHASES = [{', '.join(_name_phase(number, part) for number, part in enumerate(law.parts))}]",
        _CONTROLLER.format(
            values=len(law.latched),
            latch="self.latched = _latch(*self._exchange(q, v), TABLES[0][0].tolist())[0]"
            if law.latched
            else "del q, v  # nothing is latched",
            impulses=method,
        ),
    ]
    return "\n".join(parts)


def _name_phase(number: int, part: Law) -> str:
    return "None" if part.phase_variable is None else f"_phase_{number}"


def join_units(names: tuple[str, ...], units: tuple[str, ...]) -> str:
    """Return names with their units."""
    return ", ".join(f"{name} [{unit}]" for name, unit in zip(names, units, strict=True))


_MODULE = '''"""Written by gaitopt {version}: controller of the robot {robot}, law {law}.  It needs NumPy only.

q: {coordinates}; v: their rates.
Torques and forces: {actuators}.  Latched values: {latched}.
"""

import math

import numpy as np
'''

_CONTROLLER = '''

class Controller:
    """The controller and its state between samples: part of the period, exchange of the legs, and latched values.

    States and torques are those of the robot; the controller exchanges its legs in every second period, if it has a
    pair of them.
    """

    def __init__(self):
        self.latched, self.part, self.exchanged = [0.0] * {values}, 0, None

    @property
    def section(self):
        """Contact whose impact ends the current period."""
        return SECTIONS[bool(self.exchanged)]

    def begin(self, q, v):
        """Begin a period: call it with the first state (n_q arrays), and with that after every impact of `section`."""
        self.exchanged = HAS_EXCHANGE and self.exchanged is False
        self.part = 0
        {latch}

    def impact(self):
        """Continue with the next part of the period: call it after every other impact of a contact."""
        if ENDINGS[self.part] is None:
            self.part = min(self.part + 1, len(TABLES) - 1)

    @property
    def ending(self):
        """Event that ends the current part without impact, such as a contact that opens; None if an impact ends it."""
        events = ENDINGS[self.part]
        return None if events is None else events[bool(self.exchanged)]

    def pass_ending(self):
        """Continue with the next part of the period: call it at the event `ending`."""
        if ENDINGS[self.part] is not None:
            self.part = min(self.part + 1, len(TABLES) - 1)

    def step(self, clock, q, v):
        """Return the torques, shape (n_u,), at the time since the last call of `begin` [s].

        A part of the law with a phase variable does not depend on the time.
        """
        clock, state, phase = float(clock), self._exchange(q, v), PHASES[self.part]
        measure = clock if phase is None else phase(*state)[0][0]
        piece = max(int(np.searchsorted(BREAKPOINTS[self.part], measure, side="right")) - 1, 0)
        data = TABLES[self.part][piece].tolist()
        torque = np.array(TORQUES[self.part]([clock], *state, self.latched, [0.0], data)[0])
        return EXCHANGE_U @ torque if self.exchanged else torque
{impulses}
    def _exchange(self, q, v):
        """Return the state in the coordinates of the plan."""
        q, v = np.asarray(q, dtype=float), np.asarray(v, dtype=float)
        if self.exchanged:
            q, v = EXCHANGE_Q @ q, EXCHANGE_Q @ v
        return q.tolist(), v.tolist()
'''
