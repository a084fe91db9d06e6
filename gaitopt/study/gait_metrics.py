"""Metrics of a gait: names, units and meanings, the same in every table and file."""

from collections.abc import Callable

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.motion.energy import positive_work
from gaitopt.motion.gait import Gait
from gaitopt.motion.planar_gait import AnyGait


@check_arguments
@dataclass(frozen=True)
class GaitMetric:
    """A scalar computed from a gait.

    Attributes
    ----------
    name : str
        Identifier, the same in Python, files and JSON.
    unit : str
        ``"1"`` if it is dimensionless.
    meaning : str
        Meaning as a phrase, for legends and tables.
    read : callable
        Returns the number of a gait; defined in a module, so that other processes can call it.

    Examples
    --------
    >>> GaitMetric("steps_per_minute", "1/min", "number of steps in a minute", lambda gait: 60 / gait.period).unit
    '1/min'
    """

    name: str
    unit: str
    meaning: str
    read: Callable[[Gait], float]


def force_ratio(gait: Gait) -> float:
    """Return the largest ratio of tangential to normal contact force at the samples of a gait.

    Examples
    --------
    >>> from gaitopt import load
    >>> round(force_ratio(load("docs/examples/compass_slip.h5")), 4)
    0.14
    """
    force = gait.motion.channel("force")
    return float(np.max(np.abs(force[0]) / force[1]))


def shortest_phase(gait: Gait) -> float:
    """Return the duration of the shortest phase of a gait [s].

    Examples
    --------
    >>> from gaitopt import load
    >>> round(shortest_phase(load("docs/examples/compass_slip.h5")), 4)
    0.0196
    """
    return float(np.min([segment.duration for segment in gait.motion.segments]))


def friction_demand(gait: Gait) -> float:
    """Return the largest ratio of tangential to normal force while the foot sticks; nan for a foot that always slips.

    Examples
    --------
    >>> from gaitopt import load
    >>> friction_demand(load("docs/examples/compass_slip.h5")) < 0.14
    True
    """
    ratios = [np.max(np.abs(s.force[0]) / s.force[1]) for s in gait.motion.segments if not s.mode.slips]
    return float(np.max(ratios)) if ratios else float("nan")


def slip_duty(gait: Gait) -> float:
    """Return the share of the step in which the stance foot slips.

    Examples
    --------
    >>> from gaitopt import load
    >>> round(slip_duty(load("docs/examples/compass_slip.h5")), 4)
    0.0264
    """
    return sum(segment.duration for segment in gait.motion.segments if segment.mode.slips) / gait.period


def slip_distance(gait: Gait) -> float:
    """Return the distance over which the stance foot slips in a step, forward and backward added up [m].

    Examples
    --------
    >>> from gaitopt import load
    >>> round(1e3 * slip_distance(load("docs/examples/compass_slip.h5")), 3)
    1.362
    """
    return sum(abs(segment.slide) for segment in gait.motion.segments if segment.mode.slips)


def peak_torques(gait: AnyGait) -> dict[str, float]:
    """Return the largest absolute torque of each actuator [N m; N of a linear one].

    Examples
    --------
    >>> from gaitopt import load
    >>> sorted(peak_torques(load("docs/examples/compass_slip.h5")))
    ['ankle', 'hip']
    """
    peaks = np.max(np.abs(gait.motion.channel("torque")), axis=1)
    return dict(zip(gait.motion.actuators, peaks.tolist(), strict=True))


def braking_work(gait: Gait) -> float:
    """Return the work the actuators take out of the motion in a step, as a positive number [J].

    Absolute work = impact loss + friction loss + damping loss - work of gravity + 2 * braking work: without braking,
    the actuators only replace the energy that is lost.

    Examples
    --------
    >>> from gaitopt import absolute_work, load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> energy = gait.energy
    >>> lost = energy.losses - energy.gravity
    >>> abs(absolute_work(gait.motion) - lost - 2 * braking_work(gait)) < 1e-5
    True
    """
    return positive_work(gait.motion) - gait.energy.actuator


MEASURES = (
    GaitMetric("cost_of_transport", "1", "absolute joint work over weight and travel", lambda g: g.cost_of_transport),
    GaitMetric("objective", "", "the minimised objective, in its unit", lambda gait: gait.solver.objective),
    GaitMetric("achieved_speed", "m/s", "average forward speed", lambda gait: gait.speed),
    GaitMetric("travel", "m", "forward travel in a step, foot slide included", lambda gait: gait.step_length),
    GaitMetric("period", "s", "duration of a step", lambda gait: gait.period),
    GaitMetric("shortest_phase", "s", "duration of the shortest phase", shortest_phase),
    GaitMetric(
        "foot_slide", "m", "net forward slide of the stance foot in a step", lambda gait: gait.motion.foot_slide
    ),
    GaitMetric("slip_distance", "m", "distance of slip in a step, in both directions", slip_distance),
    GaitMetric("slip_duty", "1", "share of the step in which the foot slips", slip_duty),
    GaitMetric("friction_demand", "1", "largest tangential over normal force while sticking", friction_demand),
    GaitMetric("force_ratio", "1", "largest tangential over normal contact force", force_ratio),
    GaitMetric("impulse_ratio", "1", "tangential over normal impulse at touchdown", lambda g: g.motion.jumps[0].ratio),
    GaitMetric("actuator_work", "J", "work of the actuators in a step, signed", lambda gait: gait.energy.actuator),
    GaitMetric("braking_work", "J", "work the actuators take out of the motion in a step", braking_work),
    GaitMetric("gravity_work", "J", "work of gravity in a step", lambda gait: gait.energy.gravity),
    GaitMetric("impact_loss", "J", "energy lost at touchdown", lambda gait: gait.energy.impact_loss),
    GaitMetric("friction_loss", "J", "energy lost by sliding in a step", lambda gait: gait.energy.friction_loss),
)
