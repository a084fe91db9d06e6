"""Metrics of the gaits of robots with several contacts: scalars, and numbers by contact."""

from collections.abc import Callable

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.stability.planar_gaits.planar_friction import impact_ratios


@dataclass(frozen=True)
class PlanarMetric:
    """A number or an array computed from a gait of a robot with several contacts.

    Attributes
    ----------
    name, unit, meaning : str
        As of :class:`gaitopt.study.gait_metrics.GaitMetric`.
    read : callable
        Returns the number of a gait, or one for each contact, shape (n_c,).
    """

    name: str
    unit: str
    meaning: str
    read: Callable[[PlanarGait], float | Array]


def largest_forces(gait: PlanarGait) -> Array:
    """Return the largest normal force of each contact [N; of a joint stop, its generalized force], shape (n_c,)."""
    return np.asarray(np.max(gait.motion.channel("force")[:, 1], axis=-1, initial=0.0), dtype=float)


def largest_ratios(gait: PlanarGait) -> Array:
    """Return the largest ratio of tangential to normal force of each contact at the samples, shape (n_c,).

    Samples at which the force vanishes, as at lift-off, are left out; nan for a contact without force.
    """
    force = gait.motion.channel("force")
    ratios = []
    for tangential, normal in force.transpose(0, 1, 2):
        loaded = normal > 1e-6 * max(float(np.max(force[:, 1])), 1e-300)
        ratios.append(float(np.max(np.abs(tangential[loaded]) / normal[loaded])) if loaded.any() else np.nan)
    return np.array(ratios)


def largest_foot_ratio(gait: PlanarGait) -> float:
    """Return the largest ratio of tangential to normal force of a body on the ground at the samples.

    The forces of the contacts of a body, such as heel and toe, are added.  Samples at which the force vanishes, as at
    lift-off, are left out; nan for a gait without contact.
    """
    bodies: dict[str, list[int]] = {}
    for i, contact in enumerate(gait.robot.contacts):
        if contact.slides:
            bodies.setdefault(contact.body, []).append(i)
    force = gait.motion.channel("force")
    least, largest = 1e-6 * float(np.max(force[:, 1], initial=0.0)), np.nan
    for members in bodies.values():
        tangential, normal = force[members].sum(axis=0)
        loaded = normal > least
        if loaded.any():
            largest = np.fmax(largest, np.max(np.abs(tangential[loaded]) / normal[loaded]))
    return float(largest)


def slides(gait: PlanarGait) -> Array:
    """Return the forward slide of each contact in a period [m], shape (n_c,)."""
    return np.asarray(np.sum(_slides_by_phase(gait), axis=0), dtype=float)


def slip_distances(gait: PlanarGait) -> Array:
    """Return the distance over which each contact slips in a period, in both directions [m], shape (n_c,)."""
    return np.asarray(np.sum(np.abs(_slides_by_phase(gait)), axis=0), dtype=float)


def _slides_by_phase(gait: PlanarGait) -> list[Array]:
    """Return the forward slide of each contact in each phase [m]; 0 for a contact that does not slip."""
    robot, p = gait.robot, gait.robot.vector(gait.motion.parameters)
    phases = []
    for segment in gait.motion.segments:
        begin, end = (np.array(robot.gaps(segment.q[:, k], p)[1]).ravel() for k in (0, -1))
        phases.append((end - begin) * [mode.slips for _, mode in segment.state.modes])
    return phases


def slip_duties(gait: PlanarGait) -> Array:
    """Return the share of the period in which each contact slips, shape (n_c,)."""
    durations = [
        (segment.time[-1] - segment.time[0]) * np.array([mode.slips for _, mode in segment.state.modes])
        for segment in gait.motion.segments
    ]
    return np.asarray(np.sum(durations, axis=0) / gait.period, dtype=float)


def impulses(gait: PlanarGait, direction: int) -> Array:
    """Return the sum of each contact's impulses in a period [N s]: tangential (0) or normal (1), shape (n_c,)."""
    return np.asarray(np.sum([event.impulse[:, direction] for event in gait.motion.events], axis=0), dtype=float)


def largest_impulse_ratio(gait: PlanarGait) -> float:
    """Return the largest ratio of tangential to normal impulse in an impact, signed; nan without impact."""
    ratios = [ratio for event in gait.motion.events for ratio in impact_ratios(event).values()]
    return max(ratios, key=abs, default=float("nan"))


def _shortest_phase(gait: PlanarGait) -> float:
    return float(min(segment.time[-1] - segment.time[0] for segment in gait.motion.segments))


PLANAR_MEASURES = (
    PlanarMetric("cost_of_transport", "1", "absolute joint work over weight and travel", lambda g: g.cost_of_transport),
    PlanarMetric("objective", "", "the minimised objective, in its unit", lambda gait: gait.solver.objective),
    PlanarMetric("achieved_speed", "m/s", "average forward speed", lambda gait: gait.speed),
    PlanarMetric("travel", "m", "forward travel in a period", lambda gait: gait.step_length),
    PlanarMetric("period", "s", "duration of a period", lambda gait: gait.period),
    PlanarMetric("shortest_phase", "s", "duration of the shortest phase", _shortest_phase),
    PlanarMetric("actuator_work", "J", "work of the actuators in a period, signed", lambda gait: gait.energy.actuator),
    PlanarMetric("gravity_work", "J", "work of gravity in a period", lambda gait: gait.energy.gravity),
    PlanarMetric("impact_loss", "J", "energy lost in impacts", lambda gait: gait.energy.impact_loss),
    PlanarMetric("friction_loss", "J", "energy lost by sliding in a period", lambda gait: gait.energy.friction_loss),
)
"""Scalars of a gait, with the names of :data:`gaitopt.study.gait_metrics.MEASURES` where they mean the same."""

CONTACT_MEASURES = (
    PlanarMetric("foot_slide", "m", "net forward slide of the contact in a period", slides),
    PlanarMetric("slip_distance", "m", "distance of slip of the contact, in both directions", slip_distances),
    PlanarMetric("slip_duty", "1", "share of the period in which the contact slips", slip_duties),
    PlanarMetric("peak_force", "N", "largest normal force of the contact", largest_forces),
    PlanarMetric("force_ratio", "1", "largest tangential over normal force of the contact", largest_ratios),
    PlanarMetric("tangential_impulse", "N s", "tangential impulses of the contact", lambda g: impulses(g, 0)),
    PlanarMetric("normal_impulse", "N s", "normal impulses of the contact", lambda gait: impulses(gait, 1)),
)
"""Numbers of a gait by contact."""
