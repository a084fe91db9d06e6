"""The charts of a motion: quantities over time and phase portraits."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from gaitopt.model.coordinate_entries import ANGLES, SLIDE, angle_entry
from gaitopt.motion.joint_numbers import number_joints
from gaitopt.motion.motion import Array, Motion
from gaitopt.report.chart import Chart, Curve


def time_charts(motion: Motion, torque_limits: Mapping[str, Any]) -> list[Chart]:
    """Return angles, torques, force ratio and slide of the stance foot over time.

    Parameters
    ----------
    motion : Motion
    torque_limits : mapping of str to float
        Torque limits of the actuators [N m], or empty; inf is not drawn.
    """
    friction = motion.parameters["friction"]
    cone = (friction, -friction) if np.isfinite(friction) else ()
    limits = sorted({sign * float(limit) for limit in torque_limits.values() if np.isfinite(limit) for sign in (1, -1)})
    slides = [1e3 * (part.q[[SLIDE]] - _landing(motion, part.step)) for part in motion.segments]
    ratios = [part.force[:1] / part.force[1:] for part in motion.segments]
    angles = [np.rad2deg(part.q[ANGLES]) for part in motion.segments]
    charts = [_over_time(motion, "Angles", "angle", "deg", motion.angles, angles)]
    if motion.actuators:
        torques = [part.torque for part in motion.segments]
        charts.append(_over_time(motion, "Torques", "torque", "N m", motion.actuators, torques, tuple(limits)))
    charts.append(
        _over_time(motion, "Force ratio and friction cone", "tangential / normal", "", ("ratio",), ratios, cone)
    )
    charts.append(_over_time(motion, "Slide of the stance foot", "slide since landing", "mm", ("slide",), slides))
    return charts


def portraits(motion: Motion) -> list[Chart]:
    """Return the phase portrait of each angle; the touchdown is dashed."""
    return [
        Chart(
            title=f"Phase portrait of {name}",
            x_label=f"{name} [deg]",
            y_label=f"rate of {name} [deg/s]",
            unit="deg/s",
            lines=[
                Curve(
                    label=name,
                    x=tuple(np.rad2deg(part.q[angle_entry(joint)]) for part in motion.segments),
                    y=tuple(np.rad2deg(part.v[angle_entry(joint)]) for part in motion.segments),
                    joint=joint,
                )
            ],
            closed=True,
        )
        for joint, name in enumerate(motion.angles)
    ]


def _over_time(
    motion: Motion,
    title: str,
    quantity: str,
    unit: str,
    labels: tuple[str, ...],
    rows: list[Array],
    limits: tuple[float, ...] = (),
) -> Chart:
    """Return a chart with one line per label; `rows` has an (n, K) array for each segment."""
    time = tuple(part.time for part in motion.segments)
    joints = number_joints(motion.angles, motion.actuators)
    return Chart(
        title=title,
        x_label="time [s]",
        y_label=f"{quantity} [{unit}]" if unit else quantity,
        unit=unit,
        lines=[
            Curve(label=label, x=time, y=tuple(part[row] for part in rows), joint=joints.get(label))
            for row, label in enumerate(labels)
        ],
        bands=[(float(p.time[0]), float(p.time[-1]), p.mode) for p in motion.segments if p.mode.slips],
        limits=limits,
    )


def _landing(motion: Motion, step: int) -> float:
    """Return the landing position of the stance foot of a step [m]."""
    return float(next(part.q[SLIDE, 0] for part in motion.segments if part.step == step))
