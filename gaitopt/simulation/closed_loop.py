"""A robot under a law, and its equations in each contact mode as numerical functions.

The state is y = (q, v, latched values of the law).  The Functions that the optimiser uses are composed with the law's
Function once per robot, contact mode and form of law.
"""

import functools
from dataclasses import field

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.signature import torque_in_state
from gaitopt.dataclass import dataclass
from gaitopt.locks import one_at_a_time
from gaitopt.model.contacts.event import FALL, TOUCHDOWN, HybridEvent, law_event, law_switch
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.model.contacts.touchdown import Touchdown
from gaitopt.model.contacts.transition import ContactQuantities
from gaitopt.model.coordinate_entries import SLIDE
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """A robot with given parameters under a law.

    Attributes
    ----------
    robot : Robot
    law : Law
    p : (n_p,) array
        Parameter vector.
    size : int
        Entries of the state y = (q, v, latched).
    key : bytes
        The parameter vector, for caches.

    Examples
    --------
    >>> from gaitopt import passive, rimless_wheel
    >>> wheel = rimless_wheel()
    >>> ClosedLoop(wheel, passive(wheel), wheel.vector(wheel.resolve({}))).equations(Mode.STICK).events[0].label
    'lift-off'
    """

    robot: Robot
    law: Law
    p: Array
    size: int = field(init=False)
    key: bytes = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", 2 * self.robot.n_q + len(self.law.memory.values))
        object.__setattr__(self, "key", self.p.tobytes())

    def equations(self, mode: Mode) -> "ModeEquations":
        """Return the equations of a contact mode under the law with its limits."""
        return mode_equations(self.robot, mode, self.law.torque)

    def data(self, clock: float, y: Array) -> Array:
        """Return the active column of the law's table at a clock time in a state, shape (n_d,)."""
        return self.law.data(clock, y)

    def piece_shift(self, rate: Array) -> Array:
        """Return d (instant at which the law changes its piece) / d y, shape (n_y,).

        The shift is zero if the clock decides the piece; otherwise it is that of the instant at which the deciding
        entry of the state reaches the bound of the piece.

        Parameters
        ----------
        rate : (n_y,) array
            dy/dt before the change.
        """
        shift, index = np.zeros(rate.size), self.law.index
        if index is not None:
            shift[index] = -1 / rate[index]
        return shift


@dataclass(frozen=True, eq=False)
class ModeEquations:
    """The flow and the guards of one contact mode under one form of law.

    Attributes
    ----------
    mode : Mode
    events : tuple of HybridEvent
        Event of each guard; the mode lasts while every guard is positive.  If several guards fall through zero
        simultaneously, the first one counts.
    active : tuple of int
        Entries of y that change in this mode; the others (a sticking foot, the height of a foot on the ground) are
        constant.
    size : int
        Number of entries of y.
    flow : (t, y, p, data) -> dy/dt (size)
    energy : (t, y, p, data) -> rates of the works of :meth:`gaitopt.model.robot.Robot.work_rates` (n_works) [W]
    guards : (t, y, p, data) -> values, armed
        A touchdown is an event only while `armed` is positive.
    """

    mode: Mode
    events: tuple[HybridEvent, ...]
    active: tuple[int, ...]
    size: int
    flow: ca.Function
    energy: ca.Function
    guards: ca.Function


@functools.lru_cache(maxsize=128)
@one_at_a_time
def mode_equations(robot: Robot, mode: Mode, control: ca.Function) -> ModeEquations:
    """Return the equations of a robot in a contact mode under a law's Function; they are composed once and cached."""
    n, latched = robot.n_q, control.size1_in(3)
    t, y = ca.SX.sym("t"), ca.SX.sym("y", 2 * n + latched)
    p, data = ca.SX.sym("p", len(robot.parameters)), ca.SX.sym("data", control.size1_in(5))
    q, v = y[:n], y[n : 2 * n]
    u, bounds, events = control(t, q, v, y[2 * n :], mode.sign, data)
    acceleration, force = robot.acceleration[mode](q, v, u, p)
    sliding = force if mode.slips else ca.SX.zeros(2)
    guard, armed = Touchdown(robot).guard(q, v, p)
    resistance = robot.wellposed(q, p) if mode.slips else ca.SX.ones(2)
    contact = ContactQuantities(force, v[SLIDE], robot.static_friction(p), resistance, acceleration[SLIDE])
    transitions = robot.contact_model.leaving(mode)
    leaving = [transition.guard(mode, contact) for transition in transitions]
    guards = ca.vertcat(*leaving, guard, robot.upright(q, p), bounds, events)
    moving = PhaseDynamics(robot, mode).entries

    def function(name: str, *outputs: ca.SX) -> ca.Function:
        return ca.Function(name, [t, y, p, data], ca.cse([ca.densify(ca.SX(e)) for e in outputs]))

    return ModeEquations(
        mode=mode,
        events=(
            *(transition.event for transition in transitions),
            TOUCHDOWN,
            FALL,
            *map(law_switch, range(bounds.numel())),
            *map(law_event, range(events.numel())),
        ),
        active=(*moving, *(n + i for i in moving)),
        size=2 * n + latched,
        flow=function("flow", ca.vertcat(v, acceleration, ca.SX.zeros(latched))),
        energy=function("energy", robot.work_rates(q, v, u, sliding, p)),
        guards=function("guards", guards, armed),
    )


@functools.lru_cache(maxsize=128)
@one_at_a_time
def torque_of(control: ca.Function, mode: Mode) -> ca.Function:
    """Return (clock, y, data) -> torque of a law in a contact mode."""
    torque, clock, y, data = torque_in_state(control, mode.sign)
    return ca.Function("torque", [clock, y, data], [ca.densify(torque)])
