"""A motion as figures, animations, reports and tables read it, for robots with any contacts."""

from collections.abc import Mapping
from dataclasses import field

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.lazy import LazyField, LazyRecord
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.terrain import Terrain
from gaitopt.motion.actuator_impulses import ActuatorImpulses
from gaitopt.motion.energy import Ledger
from gaitopt.motion.motion import Array

ONE_AND_OTHER = ("one leg", "the other leg")
"""Names of the legs of a robot in single support, which exchange their roles in each step, in animations."""


@dataclass(frozen=True)
class Channel:
    """A coordinate or an actuator.

    Attributes
    ----------
    name : str
    unit : str
        ``"m"`` or ``"rad"``; ``"N"`` or ``"N m"``.
    """

    name: str
    unit: str


@dataclass(frozen=True)
class ContactView:
    """A contact that is closed at some time of the motion, or is exchanged with such a one.

    Attributes
    ----------
    name : str
    column : str
        Prefix of its columns in tables; empty for the only foot that bears a force.
    is_stop : bool
        Whether it is a joint stop, which has no place on the ground.
    unit : str
        Unit of its gap, ``"m"`` or ``"rad"``.
    level : tuple of (str, float) or None
        For the stop of one coordinate: its name and the value at which the stop is closed.
    leg : str
        Name of its leg in figures.
    leg_number : int
        Number of its leg, from 0; heel and toe of a foot have the same number.  That of a joint stop is 0.
    slides : bool
        Whether it has a slide coordinate and so a tangential force.
    """

    name: str
    column: str
    is_stop: bool = False
    unit: str = "m"
    level: tuple[str, float] | None = None
    leg: str = ""
    leg_number: int = 0
    slides: bool = True


@dataclass(frozen=True, eq=False, kw_only=True)
class PhaseView:
    """A smooth part of a motion, sampled at K instants; n_c contacts in the order of the view.

    Attributes
    ----------
    step : int
    modes : tuple of Mode
    time : (K,) array [s]
    q, v : (n_q, K) arrays
        All coordinates of the view, and their rates.
    torque, work : (n_u, K) arrays
        [N m or N], [J].
    power : (n_u, K) array or None [W]
    forces : (n_c, 2, K) array [N]
    slides, slip_speeds, gaps : (n_c, K) arrays [m], [m/s], [m or rad]
    friction_works : (n_c, K) array [J]
    damping_work, kinetic, potential, elastic : (K,) arrays [J]
    points : (2, n_points, K) array [m]
    places : (2, n_c, K) array [m]
        Where each foot touches the ground, or would touch it; nan for a stop.
    rims : (4, n_c, K) array or None
        Rims of round feet: centre, radius and clockwise angle.
    """

    step: int
    modes: tuple[Mode, ...]
    time: Array
    q: Array
    v: Array
    torque: Array
    work: Array
    power: Array | None
    forces: Array
    slides: Array
    slip_speeds: Array
    gaps: Array
    friction_works: Array
    damping_work: Array
    kinetic: Array
    potential: Array
    elastic: Array
    points: Array
    places: Array
    rims: Array | None

    @property
    def duration(self) -> float:
        """Length of the phase [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def slipping(self) -> tuple[int, ...]:
        """Numbers of the contacts that slip."""
        return tuple(number for number, mode in enumerate(self.modes) if mode.slips)

    @property
    def mode(self) -> Mode:
        """Mode by which the phase is shaded: of the first contact that slips, otherwise of the first closed one."""
        closed = [mode for mode in self.modes if mode is not Mode.FREE]
        return next((mode for mode in closed if mode.slips), closed[0] if closed else Mode.FREE)

    def slide(self, contact: int) -> float:
        """Distance by which a contact slips over the phase [m], forward positive."""
        return float(self.slides[contact, -1] - self.slides[contact, 0])


@dataclass(frozen=True, eq=False, kw_only=True)
class EventView:
    """The event between two phases.

    Attributes
    ----------
    step : int
        The step in which, or at the end of which, it happens.
    time : float [s]
    label : str
    is_impact : bool
    impulses : (n_c, 2) array [N s]
        Of each contact, of the impact alone.
    modes : tuple of Mode
        Mode of each contact after the event.
    actuator_impulses : tuple of ActuatorImpulses
        Impulses of actuators just before and just after the impact, with the reactions of the contacts of the view.
    """

    step: int
    time: float
    label: str
    is_impact: bool
    impulses: Array
    modes: tuple[Mode, ...]
    actuator_impulses: tuple[ActuatorImpulses, ...] = ()


@dataclass(frozen=True)
class Token:
    """A part of a contact sequence as it is written in animations.

    Attributes
    ----------
    text : str
    mode : Mode or None
        Mode by whose colour it is marked; None for a separator.
    phase : int or None
        Number of the phase during which it is marked; None for a separator and for the outcome of the last impact.
    """

    text: str
    mode: Mode | None = None
    phase: int | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class MotionView(LazyRecord):
    """A motion of any robot.  :func:`gaitopt.motion.view_motion.view_motion` makes it.

    Attributes
    ----------
    coordinates, actuators : tuple of Channel
    contacts : tuple of ContactView
    exchange : tuple of int
        Contact i is in the next step what contact ``exchange[i]`` is in this one.
    points : tuple of str
    links : tuple of pairs of int
    link_contacts : tuple of int or None
        The contact to whose leg each link belongs; None for the body.
    foot_points : dict of int to int
        The drawn point of each foot, by the number of the contact.
    joints : tuple of int
        Points drawn as joints.
    parameters : dict of str to float
    total_mass : float [kg]
    segments : tuple of PhaseView
    events : tuple of EventView
    tokens : tuple of Token
        Contact sequence of the first step.
    travel : float [m]
        Forward travel of the motion.
    distance_row : int or None
        Row of the coordinate along the ground.
    energy : Ledger
    limits : mapping of str to float
        Limits of the actuators, if they are known.
    terrain : Terrain or None
        None on a plane.

    Examples
    --------
    >>> from gaitopt import load
    >>> from gaitopt.motion.view_motion import view_motion
    >>> view = view_motion(load("docs/examples/compass_slip.h5").motion)
    >>> [contact.name for contact in view.contacts], view.loaded, view.is_single_support
    (['stance foot', 'landing foot'], (0,), True)
    """

    coordinates: tuple[Channel, ...]
    actuators: tuple[Channel, ...]
    contacts: tuple[ContactView, ...]
    exchange: tuple[int, ...]
    points: tuple[str, ...]
    links: tuple[tuple[int, int], ...]
    link_contacts: tuple[int | None, ...]
    foot_points: dict[int, int]
    joints: tuple[int, ...]
    parameters: dict[str, float]
    total_mass: float
    segments: tuple[PhaseView, ...]
    events: tuple[EventView, ...]
    tokens: tuple[Token, ...]
    travel: float
    distance_row: int | None
    energy: LazyField[Ledger] = LazyField()
    limits: Mapping[str, float] = field(default_factory=dict)
    terrain: Terrain | None = None

    @property
    def period(self) -> float:
        """Time from the first sample to the last [s]."""
        return float(self.segments[-1].time[-1] - self.segments[0].time[0]) if self.segments else 0.0

    @property
    def weight(self) -> float:
        """Weight of the robot [N]."""
        return self.total_mass * self.parameters["gravity"]

    @property
    def feet(self) -> tuple[int, ...]:
        """Numbers of the contacts that are not joint stops."""
        return tuple(number for number, contact in enumerate(self.contacts) if not contact.is_stop)

    @property
    def loaded(self) -> tuple[int, ...]:
        """Numbers of the feet that are on the ground at some time."""
        return tuple(number for number in self.closing if not self.contacts[number].is_stop)

    @property
    def closing(self) -> tuple[int, ...]:
        """Numbers of the contacts that are closed at some time."""
        numbers = range(len(self.contacts))
        return tuple(i for i in numbers if any(part.modes[i] is not Mode.FREE for part in self.segments))

    @property
    def sliding(self) -> tuple[int, ...]:
        """Numbers of the feet with a slide coordinate that are on the ground at some time."""
        return tuple(foot for foot in self.loaded if self.contacts[foot].slides)

    @property
    def cone_feet(self) -> tuple[int, ...]:
        """Numbers of the feet whose friction cone is drawn: on ground of infinite friction it is the half plane."""
        return self.sliding if np.isfinite(self.parameters["friction"]) else ()

    def is_flight(self, phase: PhaseView) -> bool:
        """Return whether no foot is on the ground in a phase."""
        return all(phase.modes[foot] is Mode.FREE for foot in self.feet)

    @property
    def is_single_support(self) -> bool:
        """Whether the same foot is on the ground all the time and no joint stop is closed."""
        closed = {tuple(i for i, mode in enumerate(part.modes) if mode is not Mode.FREE) for part in self.segments}
        return closed == {(0,)}

    def channels(self, unit: str) -> list[tuple[int, Channel]]:
        """Return row and channel of each coordinate of a unit, without the one along the ground.

        The height of a base is left out if no other coordinate is a length.
        """
        rows = [(row, each) for row, each in enumerate(self.coordinates) if each.unit == unit]
        rows = [(row, each) for row, each in rows if row != self.distance_row]
        return [] if {each.name for _, each in rows} <= {"y"} else rows

    def leg_of(self, contact: int) -> int:
        """Return the number of the leg of a foot, from 0."""
        return self.contacts[contact].leg_number

    def owner(self, contact: int, exchanges: int) -> int:
        """Return the contact that plays the role of a contact of the first step after some leg exchanges."""
        return self.exchange[contact] if exchanges % 2 else contact

    def channel(self, name: str) -> Array:
        """Return an array of the segments, such as ``"forces"``, joined along time."""
        return np.concatenate([getattr(segment, name) for segment in self.segments], axis=-1)


def name_modes(contacts: tuple[str, ...], modes: tuple[Mode, ...]) -> str:
    """Return the closed contacts and their modes as text; ``flight`` if none is closed.

    Examples
    --------
    >>> name_modes(("foot", "knee"), (Mode.STICK, Mode.FREE)), name_modes(("foot",), (Mode.FREE,))
    ('foot stick', 'flight')
    """
    closed = zip(contacts, modes, strict=True)
    return ", ".join(f"{name} {mode.value}" for name, mode in closed if mode is not Mode.FREE) or "flight"
