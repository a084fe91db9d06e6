"""Motion: the trajectories of an optimised gait or a simulated walk, as plain arrays."""

from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.coordinate_entries import CONTACT, SLIDE
from gaitopt.model.ground_frame import NEXT_INCLINE, place_on_plane
from gaitopt.model.terrain import Terrain
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.parameters import check_type

Array = NDArray[np.float64]

LARGEST = 1e100
"""Largest magnitude of a number that counts as finite; the squares and products of larger ones overflow."""


def are_finite(numbers: Array | float) -> bool:
    """Return whether numbers can be computed with: neither nan nor beyond `LARGEST`."""
    return bool(np.all(np.abs(numbers) <= LARGEST))


@dataclass(frozen=True, eq=False, kw_only=True)
class Segment:
    """A smooth part of a motion in one contact mode, sampled at K instants.

    Attributes
    ----------
    mode : Mode
    step : int
        Number of its step, from 0.
    time : (K,) array [s]
    q, v : (n_q, K) arrays
        Slide coordinate and gap of the stance foot [m] (the position of a point foot) and angles [rad]; their rates.
    torque : (n_u, K) array [N m]
    force : (2, K) array [N]
        Contact force (f_t, f_n) on the stance foot.
    power : (n_u, K) array [W]
        Torque times joint rate, each actuator.
    work : (n_u, K) array [J]
        Work of each actuator since the start of the segment, signed.
    friction_work : (K,) array [J]
        Energy dissipated by sliding since the start of the segment.
    kinetic, potential : (K,) arrays [J]
        The potential energy includes the elastic energy.
    points : (2, n_points, K) array [m]
        Positions of the drawn points, in the slope-fixed frame.
    damping_work : (K,) array, optional [J]
        Energy dissipated by dampers since the start of the segment; zero by default.
    elastic : (K,) array, optional [J]
        Energy stored in springs and potentials; zero by default.
    rims : (4, 2, K) array, optional
        Round feet: centre [m], radius [m] and clockwise angle [rad] of the rims of the stance and the landing foot.
        None for point feet.
    positive_work : (n_u, K) array, optional
        Work of each actuator while its power is positive, since the start of the segment [J].  None if it follows from
        the samples of power and work.

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> slide = gait.motion.segments[0]
    >>> slide.mode.value, slide.q.shape == (4, slide.time.size), round(1e3 * slide.slide, 2)
    ('slip+', True, 1.36)
    """

    mode: Mode
    step: int
    time: Array
    q: Array
    v: Array
    torque: Array
    force: Array
    power: Array
    work: Array
    friction_work: Array
    kinetic: Array
    potential: Array
    points: Array
    damping_work: Array = field(default_factory=lambda: np.zeros(0))
    elastic: Array = field(default_factory=lambda: np.zeros(0))
    rims: Array | None = None
    positive_work: Array | None = None

    def __post_init__(self) -> None:
        for name in ("damping_work", "elastic"):
            if getattr(self, name).size == 0:
                object.__setattr__(self, name, np.zeros(self.time.size))

    def __repr__(self) -> str:
        span = f"{self.time[0]:.6g} to {self.time[-1]:.6g} s" if self.time.size else "no time"
        return f"Segment({self.mode.value}, step {self.step}, {span}, {self.time.size} samples)"

    @property
    def duration(self) -> float:
        """Length of the segment [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def contact(self) -> Array:
        """Point at which the stance foot touches the ground, shape (2, K) [m]."""
        if self.rims is None:
            return self.q[CONTACT]
        x, y, radius, _ = self.rims[:, 0]
        return np.stack([x, y - radius])

    @property
    def slide(self) -> float:
        """Distance by which the stance foot slips over the segment [m], forward positive; rolling is not part of it."""
        return float(self.q[SLIDE, -1] - self.q[SLIDE, 0])


@dataclass(frozen=True, eq=False, kw_only=True)
class Jump:
    """A touchdown: impact of the landing foot, then the leg exchange.

    Attributes
    ----------
    step : int
        The step it ends.
    time : float [s]
    mode : Mode
        Contact mode of the landing foot after the impact.
    impulse : (2,) array [N s]
        (Lambda_t, Lambda_n).
    q, v_minus, v_plus : (n_q,) arrays
        Configuration, and rates before and after, in the coordinates of the step that ends.
    q_next, v_next : (n_q,) arrays
        State of the next step, the landing foot being (x, y).
    energy_lost : float [J]
    separation : float [m/s]
        Upward speed of the trailing foot after the impact.

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> jump = gait.motion.jumps[0]
    >>> jump.mode.value, round(jump.ratio, 3), jump.impulse.shape
    ('slip+', -0.14, (2,))
    """

    step: int
    time: float
    mode: Mode
    impulse: Array
    q: Array
    v_minus: Array
    v_plus: Array
    q_next: Array
    v_next: Array
    energy_lost: float
    separation: float

    @property
    def ratio(self) -> float:
        """Impulse ratio Lambda_t / Lambda_n; nan without an impulse."""
        return float(self.impulse[0] / self.impulse[1]) if self.impulse[1] else float("nan")


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """Segments between jumps.

    Attributes
    ----------
    angles, actuators, points : tuple of str
        Names of the rows of `q` after the foot, of the torques, and of the points drawn.
    links : tuple of pairs of int
        Pairs of points that a line connects.
    total_mass : float [kg]
    parameters : dict of str to float
        Every parameter of robot and ground, SI units.
    segments : tuple of Segment
        Empty if a simulation stopped at its start.
    jumps : tuple of Jump
    terrain : Terrain or None
        The ground of a motion of several steps; None for a plane.

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> str(gait.motion.sequence()), gait.motion.channel("q").shape[0], round(gait.motion.travel, 4)
    ('slip+ stick | slip+', 4, 0.4713)
    """

    angles: tuple[str, ...]
    actuators: tuple[str, ...]
    points: tuple[str, ...]
    links: tuple[tuple[int, int], ...]
    total_mass: float
    parameters: dict[str, float]
    segments: tuple[Segment, ...]
    jumps: tuple[Jump, ...]
    terrain: Terrain | None = None

    def __repr__(self) -> str:
        counts = f"segments: {len(self.segments)}, touchdowns: {len(self.jumps)}"
        first = (
            f"first step '{sequence}', " if self.segments and (sequence := self.sequence(self.segments[0].step)) else ""
        )
        return f"Motion({first}{counts}, period {self.period:.6g} s, travel {self.travel:.6g} m)"

    @property
    def period(self) -> float:
        """Time from the first sample to the last [s]."""
        return float(self.segments[-1].time[-1] - self.segments[0].time[0]) if self.segments else 0.0

    @property
    def static_friction(self) -> float:
        """Coefficient of static friction."""
        return self.parameters["friction"] * self.parameters.get("static_friction_ratio", 1.0)

    @property
    def foot_slide(self) -> float:
        """Net forward displacement of stance feet while on the ground [m]."""
        return sum(segment.slide for segment in self.segments)

    @property
    def travel(self) -> float:
        """Forward travel of the stance foot from the first state to the last leg exchange, slide included [m].

        It is measured along the plane, also on inclined ground.
        """
        if not self.segments:
            return 0.0
        start = place_on_plane(self.segments[0].q[CONTACT, 0], self.parameters)
        if self.jumps:
            end = place_on_plane(self.jumps[-1].q_next[CONTACT], self.parameters, NEXT_INCLINE)
        else:
            end = place_on_plane(self.segments[-1].q[CONTACT, -1], self.parameters)
        return float(end[SLIDE] - start[SLIDE])

    def channel(self, name: str) -> Array:
        """Return an array of the segments, joined along time.

        Parameters
        ----------
        name : str
            A field of :class:`Segment` such as ``"q"`` or ``"force"``.
        """
        return np.concatenate([getattr(segment, name) for segment in self.segments], axis=-1)

    def sequence(self, step: int = 0) -> ContactSequence | None:
        """Return the contact sequence of a step, or None if the step did not reach its touchdown."""
        impacts = [jump.mode for jump in self.jumps if jump.step == step]
        phases = tuple(segment.mode for segment in self.segments if segment.step == step)
        return ContactSequence(phases, impacts[0]) if impacts and phases else None


def check_motion(motion: object) -> None:
    """Raise InputError unless an argument is a motion; a gait is not."""
    check_type("motion", motion, Motion, "a Motion such as gait.motion")
