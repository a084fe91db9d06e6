"""Unknowns of the derivative of the return map: deviations of the motion, and shifts of its events.

A deviation is the derivative of the motion at a constant time with respect to one coordinate of the section after the
touchdown.  It contains angles, rates and, while the foot slips, its speed; the slide of the foot has no effect.
"""

import functools
from collections.abc import Sequence

import casadi as ca

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.model.robot import Robot
from gaitopt.model.section_coordinate import dependent_coordinate
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.ocp.nlp.keys import STEP, TOUCHDOWN, Key, Kind, Unknown
from gaitopt.ocp.nlp.layout import Layout
from gaitopt.ocp.transcription.collocation import Lobatto
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.scheme import Scheme

MOST_MULTIPLIERS = 3
"""Largest number of multipliers whose modulus is bounded by smooth conditions on the characteristic polynomial."""

DEVIATIONS = (
    Unknown.DEVIATION,
    Unknown.DEVIATION_RATE,
    Unknown.INNER_DEVIATION_RATE,
    Unknown.EVENT_SHIFT,
    Unknown.JERK,
    Unknown.RETURN,
    Unknown.DEVIATION_OF_IMPULSE,
)
"""Tables of unknowns that the deviation equations determine."""


@dataclass(frozen=True)
class SectionNames:
    """Coordinates of the section after the touchdown.

    Attributes
    ----------
    angles, rates : tuple of str
        All angles of the robot and their rates.
    dependent : int
        Number of the angle that the touchdown condition determines.
    sliding : bool
        Whether the speed of the foot is a coordinate.
    vanishing : int
        Number of multipliers that are zero in every gait of the sequence.
    """

    angles: tuple[str, ...]
    dependent: int
    sliding: bool
    vanishing: int

    @property
    def rates(self) -> tuple[str, ...]:
        """Names of the rates."""
        return tuple(f"{angle} rate" for angle in self.angles)

    @property
    def state(self) -> tuple[str, ...]:
        """Names of a deviation after the touchdown: angles, rates, foot speed if the foot slips."""
        return (*self.angles, *self.rates, *(("foot speed",) if self.sliding else ()))

    @property
    def kept(self) -> list[int]:
        """Indices of the coordinates of the section in `state`."""
        return [i for i in range(len(self.state)) if i != self.dependent]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates of the section."""
        return tuple(self.state[i] for i in self.kept)


@functools.lru_cache(maxsize=32)
def section_names(robot: Robot, sequence: ContactSequence) -> SectionNames:
    """Return the coordinates of the section of a gait.

    Raises
    ------
    InputError
        If the foot never sticks, or slips until an impact that slips, or the gait has too many multipliers.
    """
    sliding = sequence.impact.slips
    if all(mode.slips for mode in sequence.phases):
        raise InputError(f"StabilityBound needs a phase in which the foot sticks, got the sequence '{sequence}'.")
    if sliding and sequence.phases[-1].slips:  # the foot speed before the impact would add a multiplier
        raise InputError(
            f"StabilityBound needs a last phase that sticks if the impact slips, got the sequence '{sequence}'."
        )
    names = SectionNames(robot.angles, dependent_coordinate(robot), sliding, int(sliding))
    count = len(names.names) - names.vanishing
    if count > MOST_MULTIPLIERS:
        raise InputError(
            f"StabilityBound needs a robot with at most {MOST_MULTIPLIERS} multipliers that are not zero, such as one "
            f"with two angles; robot {robot.name!r} has {count}."
        )
    return names


def check_scheme(scheme: Scheme) -> Lobatto:
    """Return a scheme; raise InputError unless it is that of Collocation."""
    if not isinstance(scheme, Lobatto):
        raise InputError(f"StabilityBound needs the transcription Collocation(), got {type(scheme).__name__}.")
    return scheme


def lay_out_deviations(
    layout: Layout,
    section: SectionNames,
    phases: Sequence[Phase],
    dynamics_of_phases: Sequence[PhaseDynamics],
    scheme: Scheme,
) -> None:
    """Add the tables of deviations and of the return map to the unknowns."""
    inner = range(1, check_scheme(scheme).points - 1)

    def keys(names: Sequence[str]) -> list[Key]:
        return [Key(Kind.DEVIATION, f"{name} by {cause}") for cause in section.names for name in names]

    for phase, dynamics in zip(phases, dynamics_of_phases, strict=True):
        number, end = phase.number, phase.place(phase.count)
        places = [phase.place(k) for k in range(phase.count + 1)]
        between = [phase.place(k, between=True) for k in range(phase.count)]
        rates = [f"acceleration of {name}" for name in dynamics.moving]
        layout.add((Unknown.DEVIATION, number), keys(deviation_names(dynamics)), places)
        layout.add((Unknown.DEVIATION_RATE, number), keys(rates), places)
        within = [key.at(i) for i in inner for key in keys(rates)]
        layout.add((Unknown.INNER_DEVIATION_RATE, number), within, between)
        layout.add((Unknown.EVENT_SHIFT, number), keys(["event"]), [end])
        if phase.following is not None:
            layout.add((Unknown.JERK, number), [Key(Kind.JERK, name) for name in dynamics.moving], [end])
    layout.add(Unknown.RETURN, keys(section.state), [STEP])
    layout.add(Unknown.DEVIATION_OF_IMPULSE, keys(["tangential impulse", "normal impulse"]), [TOUCHDOWN])
    layout.add(Unknown.RADIUS, [Key(Kind.RADIUS)], [STEP])


def lay_out_gains(layout: Layout, robot: Robot) -> None:
    """Add the table of feedback gains, by actuator and then by angle, foot speed and rate."""
    states = (*robot.angles, "foot speed", *(f"{angle} rate" for angle in robot.angles))
    layout.add(Unknown.GAIN, [Key(Kind.GAIN, f"{u} by {x}") for u in robot.actuators for x in states], [STEP])


def deviation_names(dynamics: PhaseDynamics) -> tuple[str, ...]:
    """Return the names of the entries of a deviation in a phase."""
    return tuple(name for name in dynamics.state_names if name != "foot slide")


def widen_deviation(dynamics: PhaseDynamics, deviation: ca.SX) -> ca.SX:
    """Return a deviation as a change of the reduced state of a phase, shape (n_x, 1); the slide does not change."""
    n = dynamics.n_angles
    foot = (ca.SX(1, 1), deviation[2 * n]) if dynamics.slides else ()
    return ca.vertcat(deviation[: 2 * n], *foot)


def narrow_deviation(dynamics: PhaseDynamics, change: ca.SX) -> ca.SX:
    """Return a change of the reduced state as a deviation, the inverse of :func:`widen_deviation`."""
    n = dynamics.n_angles
    return ca.vertcat(change[: 2 * n], change[dynamics.speed_entry]) if dynamics.slides else change[: 2 * n]


def state_rate(dynamics: PhaseDynamics, state: ca.SX, acceleration: ca.SX) -> ca.SX:
    """Return the rate of a reduced state, shape (n_x, 1)."""
    return dynamics.join(dynamics.parts(state)[1], acceleration)


@functools.lru_cache(maxsize=32)
def balance_slope(dynamics: PhaseDynamics) -> ca.Function:
    """Return the directional derivative of the equations of motion of a phase.

    The inputs are state, acceleration, torque and p, then the changes of the first three.
    """
    point, changes = _symbols(dynamics), _symbols(dynamics)
    p = ca.SX.sym("p", len(dynamics.robot.parameters))
    residual, _ = dynamics.balance(point[0], point[1], point[2], p)
    slope = ca.jtimes(residual, ca.vertcat(*point), ca.vertcat(*changes))
    return ca.Function("balance_slope", [*point, p, *changes], [slope])


@functools.lru_cache(maxsize=32)
def guard_slope(dynamics: PhaseDynamics, following: Mode) -> ca.Function:
    """Return the directional derivative of the guard of the transition to the next phase, inputs as of the balance."""
    point, changes = _symbols(dynamics), _symbols(dynamics)
    p = ca.SX.sym("p", len(dynamics.robot.parameters))
    state, acceleration, torque = point
    contact = dynamics.contact(state, acceleration, dynamics.balance(state, acceleration, torque, p)[1], p)
    conditions = dynamics.robot.contact_model.between(dynamics.mode, following).conditions(dynamics.mode, contact)
    guard = next(one.value for one in conditions if one.equality)
    slope = ca.jtimes(ca.SX(guard), ca.vertcat(*point), ca.vertcat(*changes))
    return ca.Function("guard_slope", [*point, p, *changes], [slope])


def _symbols(dynamics: PhaseDynamics) -> list[ca.SX]:
    sizes = {"state": dynamics.n_x, "acceleration": dynamics.n_a, "torque": dynamics.robot.n_u}
    return [ca.SX.sym(name, size) for name, size in sizes.items()]
