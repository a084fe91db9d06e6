"""The charts of a motion: quantities over time and phase portraits."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.force_ratio import find_force_ratio
from gaitopt.motion.joint_numbers import number_joints
from gaitopt.motion.motion import Array
from gaitopt.motion.motion_view import MotionView
from gaitopt.motion.shown_limits import select_near_limits
from gaitopt.motion.view_motion import AnyMotion, view_motion
from gaitopt.report.chart import Chart, Curve, Stem
from gaitopt.report.walker_drawing import role_of

Named = tuple[str, list[Array]]
"""Name and samples, phase by phase, of a line."""


def time_charts(motion: AnyMotion, torque_limits: Mapping[str, Any]) -> list[Chart]:
    """Return coordinates, torques, force ratio and slide of the feet over time; of several feet normal forces, too.

    The slide of a motion that never slips is not drawn.

    Parameters
    ----------
    motion : Motion, PlanarMotion or MotionView
    torque_limits : mapping of str to float
        Limits of the actuators [N m or N], or empty; those far from the values are not drawn.
    """
    view = view_motion(motion)
    several = not view.is_single_support
    charts = [
        _coordinate_chart(view, "rad", "Angles", "angle", "deg", np.rad2deg),
        _coordinate_chart(view, "m", "Lengths", "length", "m", np.asarray),
        _actuator_chart(view, "N m", "Torques", "torque", torque_limits),
        _impulse_chart(view, "N m", "Impulses of torques at impacts"),
        _actuator_chart(view, "N", "Forces of actuators", "force", torque_limits),
        _impulse_chart(view, "N", "Impulses of actuator forces at impacts"),
    ]
    if several and view.loaded:
        title = "Normal forces over the weight"
        charts.append(_foot_chart(view, title, "normal force / weight", view.loaded, _normal_force, ()))
    charts.append(force_ratio_chart(view))
    if any(part.slipping for part in view.segments):  # the slide of a gait that never slips is rounding noise
        title = "Slide of the feet" if several else "Slide of the stance foot"
        charts.append(_foot_chart(view, title, "slide since landing", view.sliding, _slide, (), "mm"))
    return [chart for chart in charts if chart is not None]


def force_ratio_chart(motion: AnyMotion) -> Chart | None:
    """Return the force ratio of the feet over time with the friction cone; None if no foot has a tangential force."""
    view = view_motion(motion)
    friction = view.parameters["friction"]
    cone = (friction, -friction) if np.isfinite(friction) else ()
    title = "Force ratio and friction cone" if view.cone_feet else "Force ratio"
    return _foot_chart(view, title, "tangential / normal", view.sliding, _ratio, cone) if view.sliding else None


def portraits(motion: AnyMotion) -> list[Chart]:
    """Return the phase portrait of each angle; the touchdown is dashed."""
    view = view_motion(motion)
    return [
        Chart(
            title=f"Phase portrait of {channel.name}",
            x_label=f"{channel.name} [deg]",
            y_label=f"rate of {channel.name} [deg/s]",
            unit="deg/s",
            lines=[
                Curve(
                    label=channel.name,
                    x=tuple(np.rad2deg(part.q[row]) for part in view.segments),
                    y=tuple(np.rad2deg(part.v[row]) for part in view.segments),
                    joint=joint,
                )
            ],
            closed=True,
        )
        for joint, (row, channel) in enumerate(view.channels("rad"))
    ]


def _coordinate_chart(
    view: MotionView, unit: str, title: str, quantity: str, shown: str, convert: Callable[[Array], Array]
) -> Chart | None:
    """Return the chart of the coordinates of a unit, if there are any."""
    rows = view.channels(unit)
    curves = [(channel.name, [convert(part.q[row]) for part in view.segments]) for row, channel in rows]
    levels = [contact.level[1] for contact in view.contacts if contact.level is not None and contact.unit == unit]
    limits = tuple(sorted({round(float(convert(np.array(level))), 9) for level in levels}))
    return _joint_chart(view, title, f"{quantity} [{shown}]", shown, curves, limits)


def _actuator_chart(view: MotionView, unit: str, title: str, quantity: str, every: Mapping[str, Any]) -> Chart | None:
    """Return the chart of the actuators of a unit with the limits near their values, if there are any actuators."""
    rows = [(row, channel.name) for row, channel in enumerate(view.actuators) if channel.unit == unit]
    curves = [(name, [part.torque[row] for part in view.segments]) for row, name in rows]
    known = [float(every[name]) for _, name in rows if name in every]
    values = np.concatenate([part for _, parts in curves for part in parts] or [np.zeros(1)])
    limits = tuple(select_near_limits(values, sorted({sign * limit for limit in known for sign in (1, -1)})))
    return _joint_chart(view, title, f"{quantity} [{unit}]", unit, curves, limits)


def _impulse_chart(view: MotionView, unit: str, title: str) -> Chart | None:
    """Return the chart of the impulses of the actuators of a unit at impacts, if there are any."""
    joints = _number_channels(view)
    stems = [
        Stem(
            label=f"{channel.name} {stage.moment} impact",
            x=event.time,
            y=float(stage.impulse[row]),
            joint=joints[channel.name],
            side=-1 if stage.moment == "before" else 1,
        )
        for event in view.events
        for stage in event.actuator_impulses
        for row, channel in enumerate(view.actuators)
        if channel.unit == unit and stage.impulse[row]
    ]
    if not stems:
        return None
    return replace(_make_chart(view, title, f"impulse [{unit} s]", f"{unit} s", (), ()), stems=stems)


def _number_channels(view: MotionView) -> dict[str, int]:
    """Return the number of each coordinate and actuator, which determines its colour."""
    coordinates = [channel.name for each in ("rad", "m") for _, channel in view.channels(each)]
    return number_joints(coordinates, [channel.name for channel in view.actuators])


def _joint_chart(
    view: MotionView, title: str, label: str, unit: str, curves: Sequence[Named], limits: tuple[float, ...]
) -> Chart | None:
    time, joints = tuple(part.time for part in view.segments), _number_channels(view)
    lines = [Curve(label=name, x=time, y=tuple(parts), joint=joints.get(name)) for name, parts in curves]
    return _make_chart(view, title, label, unit, lines, limits) if lines else None


def _foot_chart(
    view: MotionView,
    title: str,
    label: str,
    feet: Sequence[int],
    sample: Callable[[MotionView, int, int], Array],
    limits: tuple[float, ...],
    unit: str = "",
) -> Chart:
    """Return a chart with a line for each foot while it is on the ground."""
    lines = []
    for foot in feet:
        values = [sample(view, phase, foot) for phase in range(len(view.segments))]
        loaded = [part.modes[foot] is not Mode.FREE for part in view.segments]
        kept = [np.isfinite(each) & closed for each, closed in zip(values, loaded, strict=True)]
        time = tuple(part.time[keep] for part, keep in zip(view.segments, kept, strict=True))
        y = tuple(each[keep] for each, keep in zip(values, kept, strict=True))
        single: dict[str, Any] = {"label": "slide" if unit else "ratio"}
        named: dict[str, Any] = {"label": view.contacts[foot].name, "role": role_of(view, foot)}
        lines.append(Curve(x=time, y=y, time=time, **(single if view.is_single_support else named)))
    return _make_chart(view, title, f"{label} [{unit}]" if unit else label, unit, lines, limits)


def _make_chart(
    view: MotionView, title: str, label: str, unit: str, lines: Sequence[Curve], limits: tuple[float, ...]
) -> Chart:
    return Chart(
        title=title,
        x_label="time [s]",
        y_label=label,
        unit=unit,
        lines=lines,
        bands=[(float(p.time[0]), float(p.time[-1]), p.mode) for p in view.segments if p.slipping],
        limits=limits,
        span=(float(view.segments[0].time[0]), float(view.segments[-1].time[-1])),
    )


def _normal_force(view: MotionView, phase: int, foot: int) -> Array:
    return view.segments[phase].forces[foot, 1] / view.weight


def _ratio(view: MotionView, phase: int, foot: int) -> Array:
    """Return f_t / f_n; nan where the normal force is negative or negligible, as at lift-off."""
    return find_force_ratio(view.segments[phase].forces[foot], float(np.max(view.channel("forces")[foot, 1])))


def _slide(view: MotionView, phase: int, foot: int) -> Array:
    """Return the slide since the foot landed [mm]."""
    part = view.segments[phase]
    start = phase
    while start > 0 and view.segments[start - 1].step == part.step:
        if view.segments[start - 1].modes[foot] is Mode.FREE:
            break
        start -= 1
    return 1e3 * (part.slides[foot] - view.segments[start].slides[foot, 0])
