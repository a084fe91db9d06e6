"""Motion of a planar robot with any contacts: segments between events, with the force of each contact."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.lazy import LazyField, LazyRecord
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.contact_entry import ContactEntry
from gaitopt.model.terrain import Terrain
from gaitopt.motion.actuator_impulses import ActuatorImpulses
from gaitopt.motion.contact_trajectories import ContactTrajectories
from gaitopt.motion.energy import Ledger, find_largest_kinetic
from gaitopt.motion.motion import Array
from gaitopt.motion.printable import format_count

if TYPE_CHECKING:
    from gaitopt.model.planar.planar_robot import PlanarRobot


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanarSegment(LazyRecord):
    """A smooth part of a motion in one contact state, sampled at K instants.

    Attributes
    ----------
    state : ContactState
    time : (K,) array [s]
    q, v : (n_q, K) arrays
        Coordinates [m or rad] and their rates.
    torque : (n_u, K) array [N m or N]
    force : (n_c, 2, K) array [N]
        Force (f_t, f_n) of each contact; of a joint stop, the generalised force f_n, which may be a torque.
    work : (n_u, K) array [J]
        Work of each actuator since the start of the segment.
    friction_work : (n_c, K) array [J]
        Energy dissipated by the sliding of each contact since the start of the segment.
    damping_work : (K,) array [J]
    kinetic, potential, elastic : (K,) arrays [J]
        The potential energy includes the elastic energy.
    points : (2, n_points, K) array [m]
    kinematics : ContactTrajectories
        Gap, slide coordinate, slip speed and rim of each contact.

    Notes
    -----
    Torque, force, energies, points and kinematics may be evaluated when they are first read.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> from gaitopt.simulation import simulate_planar
    >>> motion = simulate_planar(monopod(), [0, 0.7, 0, 0, 0.6], [0, 0, 0, 0, 0], {}, until="foot closes").motion
    >>> flight = motion.segments[0]
    >>> flight.state.mode("foot").value, flight.force.shape == (2, 2, flight.time.size)
    ('free', True)
    """

    state: ContactState
    time: Array
    q: Array
    v: Array
    work: Array
    friction_work: Array
    damping_work: Array
    torque: LazyField[Array] = LazyField()
    force: LazyField[Array] = LazyField()
    kinetic: LazyField[Array] = LazyField()
    potential: LazyField[Array] = LazyField()
    elastic: LazyField[Array] = LazyField()
    points: LazyField[Array] = LazyField()
    kinematics: LazyField[ContactTrajectories] = LazyField()

    def __repr__(self) -> str:
        return f"PlanarSegment({self.state}; {self.time[0]:.6g} to {self.time[-1]:.6g} s)"


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanarEvent:
    """Everything that changes at one instant: impacts, contact modes, latches and switched springs.

    Attributes
    ----------
    time : float [s]
    names : tuple of str
        For example ``("foot B closes", "foot A opens")``; also ``X stick``, ``X slip+``, ``X slip-``, ``X released``
        (a latched contact) and ``X extends``.
    before, after : ContactState
    q, v_minus, v_plus : (n_q,) arrays
    impulse : (n_c, 2) array [N s]
        (Lambda_t, Lambda_n) of each contact in the impact; zero without an impact.
    outcome : ContactState or None
        Mode of each contact in the impact, free if it has no impulse; None without an impact.
    energy_lost : float [J]
        Energy lost in the impact: kinetic energy before minus after it, plus the work of the impulses of actuators.
    switch_work : float [J]
        Elastic energy added by switched springs.
    actuator_impulses : tuple of ActuatorImpulses
        Impulses of actuators just before and just after the impact; v_minus is the velocity before and v_plus that
        after all of them.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> from gaitopt.simulation import simulate_planar
    >>> motion = simulate_planar(monopod(), [0, 0.7, 0, 0, 0.6], [0, 0, 0, 0, 0], {}, until="foot closes").motion
    >>> motion.events[0].names, motion.events[0].outcome.mode("foot").value
    (('foot closes',), 'stick')
    """

    time: float
    names: tuple[str, ...]
    before: ContactState
    after: ContactState
    q: Array
    v_minus: Array
    v_plus: Array
    impulse: Array
    outcome: ContactState | None = None
    energy_lost: float = 0.0
    switch_work: float = 0.0
    actuator_impulses: tuple[ActuatorImpulses, ...] = ()

    def __repr__(self) -> str:
        return f"PlanarEvent({self.time:.6g} s, {' & '.join(self.names)})"

    @property
    def is_impact(self) -> bool:
        """Whether a contact closes with an impulse."""
        return self.outcome is not None

    def includes(self, name: str) -> bool:
        """Return whether a change is one of this event; a latched contact that is released and open then also opens."""
        contact, _, kind = name.rpartition(" ")
        opens = kind == "opens" and f"{contact} released" in self.names and self.after.mode(contact) is Mode.FREE
        return name in self.names or opens

    @property
    def impulse_work(self) -> tuple[float, float]:
        """Work that the impulses of actuators generate and absorb [J], both >= 0."""
        stages = self.actuator_impulses
        return float(sum(one.generated.sum() for one in stages)), float(sum(one.absorbed.sum() for one in stages))


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanarMotion:
    """Segments of a planar robot's motion and the events that end them.

    Attributes
    ----------
    coordinates, actuators, points : tuple of str
    units, actuator_units : tuple of str
        Unit of each coordinate, ``"m"`` or ``"rad"``, and of each actuator, ``"N"`` or ``"N m"``.
    contact_entries : tuple of ContactEntry
        The contacts in the order of all arrays with one row per contact.
    travel : str or None
        Coordinate along the ground.
    exchange : tuple of int or None
        Contact i is in the next period what contact ``exchange[i]`` is in this one; None without an exchange of legs.
    links : tuple of pairs of int
    parameters : dict of str to float
    total_mass : float [kg]
    segments : tuple of PlanarSegment
    events : tuple of PlanarEvent
        Event k ends segment k; one fewer than the segments if the last segment ends without an event.  The motion of
        a robot with one foot on the ground has :class:`gaitopt.motion.motion.Jump` objects instead, in ``jumps``.
    terrain : Terrain or None
        None on a plane.

    Examples
    --------
    >>> from gaitopt.model.robots.vertical_hopper import vertical_hopper
    >>> from gaitopt.simulation import simulate_planar
    >>> motion = simulate_planar(vertical_hopper(), [0.7, 0.2], [0, 0], {}, duration=0.5).motion
    >>> [event.names for event in motion.events][:2]
    [('sole closes', 'full length released'), ('sole extends',)]
    """

    coordinates: tuple[str, ...]
    units: tuple[str, ...]
    contact_entries: tuple[ContactEntry, ...]
    actuators: tuple[str, ...]
    actuator_units: tuple[str, ...]
    travel: str | None
    exchange: tuple[int, ...] | None
    points: tuple[str, ...]
    links: tuple[tuple[int, int], ...]
    parameters: dict[str, float]
    total_mass: float
    segments: tuple[PlanarSegment, ...]
    events: tuple[PlanarEvent, ...]
    terrain: Terrain | None = None

    def __repr__(self) -> str:
        return f"PlanarMotion({format_count(len(self.segments), 'segment')}, {self.period:.6g} s, '{self.sequence}')"

    @staticmethod
    def of(
        robot: "PlanarRobot",
        values: dict[str, float],
        segments: Iterable[PlanarSegment],
        events: Iterable[PlanarEvent],
        terrain: Terrain | None = None,
    ) -> "PlanarMotion":
        """Return a motion of a robot with these parameter values."""
        return PlanarMotion(
            coordinates=robot.coordinates,
            units=robot.units,
            contact_entries=robot.contacts,
            actuators=robot.actuators,
            actuator_units=robot.actuator_units,
            travel=robot.travel,
            exchange=None if robot.mirror is None else robot.mirror.contacts,
            points=robot.points,
            links=robot.links,
            parameters=dict(values),
            total_mass=float(robot.mass(robot.vector(values))),
            segments=tuple(segments),
            events=tuple(events),
            terrain=terrain,
        )

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of the contacts."""
        return tuple(entry.name for entry in self.contact_entries)

    @property
    def distance(self) -> float:
        """Forward travel from the first sample to the last [m]; 0 for a robot that does not travel."""
        if self.travel is None or not self.segments:
            return 0.0
        row = self.coordinates.index(self.travel)
        return float(self.segments[-1].q[row, -1] - self.segments[0].q[row, 0])

    @property
    def period(self) -> float:
        """Time from the first sample to the last [s]."""
        return float(self.segments[-1].time[-1] - self.segments[0].time[0]) if self.segments else 0.0

    @property
    def sequence(self) -> str:
        """Modes of the closed contacts of each segment, separated by ``>``, or by ``|`` where an impact occurs."""
        parts = []
        for place, segment in enumerate(self.segments):
            closed = [f"{name} {mode.value}" for name, mode in segment.state.modes if name in segment.state.closed]
            parts.append(", ".join(closed) or "flight")
            if place < len(self.events):
                parts.append("|" if self.events[place].is_impact else ">")
        return " ".join(parts).removesuffix(" >")

    def force(self, contact: str) -> tuple[Array, Array]:
        """Return the times [s], shape (K,), and the force (f_t, f_n) of a contact [N], shape (2, K)."""
        if contact not in self.contacts:
            raise InputError(f"The motion has no contact {contact!r}. {suggest(contact, self.contacts)}")
        place = self.contacts.index(contact)
        time = np.concatenate([segment.time for segment in self.segments])
        return time, np.concatenate([segment.force[place] for segment in self.segments], axis=-1)

    def channel(self, name: str) -> Array:
        """Return an array of the segments, such as ``"q"``, joined along time."""
        return np.concatenate([getattr(segment, name) for segment in self.segments], axis=-1)

    @property
    def impulse_work(self) -> tuple[float, float]:
        """Work that the impulses of actuators generate and absorb in all events [J], both >= 0."""
        works = [event.impulse_work for event in self.events]
        return sum(work[0] for work in works), sum(work[1] for work in works)

    def ledger(self) -> Ledger:
        """Return sources and losses of the energy [J]; the work of switched springs counts as that of an actuator."""
        if not self.segments:
            return Ledger(0.0, 0.0, 0.0, 0.0, 0.0)
        lost = [event.energy_lost for event in self.events]
        generated, absorbed = self.impulse_work
        last = 0.0
        if len(self.events) == len(self.segments):  # nothing follows the last event
            last = lost[-1] - (self.events[-1].impulse_work[0] - self.events[-1].impulse_work[1])
        switched = sum(event.switch_work for event in self.events)
        gravity = [segment.potential - segment.elastic for segment in self.segments]
        return Ledger(
            actuator=float(sum(segment.work[:, -1].sum() for segment in self.segments) + switched),
            gravity=0.0 - float(sum(values[-1] - values[0] for values in gravity)),
            impact_loss=float(sum(lost)),
            friction_loss=float(sum(segment.friction_work[:, -1].sum() for segment in self.segments)),
            kinetic_change=float(self.segments[-1].kinetic[-1] - last - self.segments[0].kinetic[0]),
            damping_loss=float(sum(segment.damping_work[-1] for segment in self.segments)),
            elastic_change=float(sum(segment.elastic[-1] - segment.elastic[0] for segment in self.segments) + switched),
            impulse_generated=generated,
            impulse_absorbed=absorbed,
            largest_kinetic=find_largest_kinetic(segment.kinetic for segment in self.segments),
        )
