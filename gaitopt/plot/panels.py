"""The panels of the figure of a gait that share a time axis, and their enlargements over short slip phases."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.force_ratio import find_force_ratio
from gaitopt.motion.joint_numbers import number_joints
from gaitopt.motion.motion import Array
from gaitopt.motion.motion_view import MotionView, PhaseView
from gaitopt.motion.shown_limits import select_near_limits
from gaitopt.motion.view_motion import AnyMotion, view_motion
from gaitopt.plot.impulse_marks import draw_actuator_impulses
from gaitopt.plot.interpolation import interpolate_samples
from gaitopt.plot.legends import NO_BREAK
from gaitopt.plot.slip_shading import shade_slips
from gaitopt.plot.style import (
    LIMIT,
    MODE_INK,
    NARROW,
    angle_symbol,
    foot_line_style,
    line_style,
    panel_styles,
    root_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Annotation

SHORTEST, SHORT = 1e-5, 0.15
"""A slip phase is enlarged when it lasts less than the second share of the step, and more than a rounding error."""

SINGLE = {"color": "black"}
"""Style of the line of a panel that has only one."""

MARK_SPACE = 0.015
"""Space beside the mark of an impulse at the end of a motion, as a share of its duration."""

ROUNDING = 1e-5
"""Range of the values of a panel, in its unit or over their size, below which a curve shows errors of the plan only."""

NAME_GAP, MOST_NAME_ROWS = 0.05, 2
"""Least distance of the names of phases above an axis [inch], and lines beyond which only the shading names them."""


def short_slips(motion: AnyMotion) -> list[PhaseView]:
    """Return the slip phases too short to be read on the time axis of the whole step.

    Examples
    --------
    >>> from gaitopt import load
    >>> [phase.mode.value for phase in short_slips(load("docs/examples/compass_slip.h5").motion)]
    ['slip+']
    """
    view = view_motion(motion)
    longest = SHORT * view.period
    return [part for part in view.segments if part.slipping and SHORTEST * view.period < part.duration < longest]


def draw_angles(axes: "Axes", view: MotionView) -> None:
    """Draw the angles of a step over time [deg], with the joint stops."""
    _draw_coordinates(axes, view, "rad", float(np.rad2deg(1.0)))
    axes.set_ylabel("angle [deg]")


def draw_lengths(axes: "Axes", view: MotionView) -> None:
    """Draw the coordinates that are lengths over time [m], with the stops."""
    _draw_coordinates(axes, view, "m", 1.0)
    axes.set_ylabel("length [m]")


def draw_torques(axes: "Axes", view: MotionView) -> None:
    """Draw the joint torques of a step over time, with their limits [N m]."""
    _draw_actuators(axes, view, "N m")
    axes.set_ylabel("torque [N m]")
    if not view.actuators:
        box = {"boxstyle": "square,pad=0.2", "facecolor": "white", "edgecolor": "none"}
        axes.text(0.5, 0.5, "no actuators", transform=axes.transAxes, ha="center", va="center", bbox=box)
        axes.set_yticks([])


def draw_actuator_forces(axes: "Axes", view: MotionView) -> None:
    """Draw the forces of linear actuators over time, with their limits [N]."""
    _draw_actuators(axes, view, "N")
    axes.set_ylabel("force [N]")


def draw_normal_forces(axes: "Axes", view: MotionView) -> None:
    """Draw the normal force on each foot that touches the ground over time, over the weight."""
    for foot in view.loaded:
        values = [hide_open(part, foot, part.forces[foot, 1]) / view.weight for part in view.segments]
        _draw_line(axes, view, values, label=view.contacts[foot].name, **foot_style(view, foot))
    axes.set_ylabel("$f_n$ / weight")
    axes.update_datalim([(0, 0)], updatex=False)  # the margin above the line is relative to the whole axis
    axes.autoscale_view(scalex=False)
    axes.set_ylim(bottom=0)


def draw_force_ratio(axes: "Axes", view: MotionView) -> None:
    """Draw the ratio of tangential to normal contact force of each foot over time, with the friction cone."""
    from matplotlib.ticker import MaxNLocator

    friction = view.parameters["friction"]
    for foot in view.sliding:
        largest = float(np.max(view.channel("forces")[foot, 1]))
        ratios = [hide_open(part, foot, find_force_ratio(part.forces[foot], largest)) for part in view.segments]
        _draw_line(axes, view, ratios, **foot_style(view, foot))
    _draw_impulses(axes, view)
    axes.set_ylabel(r"force ratio $f_t/f_n$")
    reach = float(np.max(np.abs(axes.dataLim.intervaly), initial=0.01))
    if np.isfinite(friction) and friction > 0:
        axes.axhline(friction, label=rf"cone $\pm\mu=\pm{friction:g}$", **LIMIT)
        axes.axhline(-friction, **LIMIT)
        reach = max(reach, friction)
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    figure = root_figure(axes)
    wide = figure is not None and figure.get_figwidth() >= NARROW
    # No line is drawn below the cone, which leaves room for the legend; that of a column is above the panel.
    axes.set_ylim((-1.75 if wide else -1.25) * reach, 1.25 * reach)


def draw_foot_speed(axes: "Axes", view: MotionView) -> None:
    """Draw the tangential speed of each foot on the ground over time [m/s]."""
    for foot in view.sliding:
        speeds = [hide_open(part, foot, part.slip_speeds[foot]) for part in view.segments]
        _draw_line(axes, view, speeds, **foot_style(view, foot))
    axes.set_ylabel("foot speed [m/s]")


def foot_style(view: MotionView, foot: int) -> dict[str, Any]:
    """Return the style of the line of a foot: black if it is the only one that touches the ground."""
    return SINGLE if view.is_single_support else foot_line_style(view.feet.index(foot), view.leg_of(foot))


def hide_open(part: PhaseView, contact: int, values: Array) -> Array:
    """Return samples of a contact, nan while it is open."""
    return np.full_like(values, np.nan) if part.modes[contact] is Mode.FREE else values


def name_phases(axes: "Axes", motion: MotionView) -> None:
    """Write the mode of every phase above an axes; names that would collide move up a line, or all are omitted."""
    start, period = float(motion.segments[0].time[0]), motion.period
    figure = root_figure(axes)
    width = axes.get_position().width * figure.get_figwidth() if figure else 1.0
    rows: list[float] = []
    names: list[Annotation] = []
    for segment in motion.segments:
        style: dict[str, Any] = {"color": MODE_INK[segment.mode], "weight": "bold" if segment.mode.slips else "normal"}
        style |= {"ha": "center", "va": "bottom"}
        name = axes.annotate(segment.mode.label, (0.5, 1), (0, 3), "axes fraction", "offset points", **style)
        size = name.get_window_extent().width / figure.dpi if figure else 0.0
        half = (size + NAME_GAP) / width / 2
        middle = ((segment.time[0] + segment.time[-1]) / 2 - start) / period
        middle = float(np.clip(middle, half, 1 - half))
        row = next((number for number, end in enumerate(rows) if end < middle - half), len(rows))
        rows[row : row + 1] = [middle + half]
        name.xy = (middle, 1)
        name.set_position((0, 3 + 10 * row))
        names.append(name)
    for name in names if len(rows) > MOST_NAME_ROWS else ():
        name.remove()


def enlarge(
    axes: "Axes", view: MotionView, phase: PhaseView, draw: Callable[["Axes", MotionView], None], *, beside: int
) -> None:
    """Draw a panel again over a short slip phase only, with its time in ms.

    The shading is plain here, where a hatch would be coarser than what is to be read.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    view : MotionView
    phase : PhaseView
        One of the motion's phases.
    draw : callable
        What draws the panel over the whole step.
    beside : int
        Number of enlargements side by side, which limits the number of ticks.
    """
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    draw(axes, view)
    for line in axes.lines:
        line.set_clip_on(True)  # the touchdown lies far outside
    shade_slips(axes, view, hatched=False)
    axes.set_ylabel("")
    axes.set_xlim(phase.time[0] - 0.25 * phase.duration, phase.time[-1] + 0.25 * phase.duration)
    few = phase.time[-1] >= (1.0 if beside == 1 else 0.1)  # labels of four or three digits
    axes.xaxis.set_major_locator(MaxNLocator(2 if few else 3, steps=[1, 2, 5, 10], min_n_ticks=1 if few else 2))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda time, _: f"{1e3 * time:g}"))


def _draw_coordinates(axes: "Axes", view: MotionView, unit: str, factor: float) -> None:
    """Draw the coordinates of a unit, and the joint stops that have it: levels, or gaps that fall to zero."""
    numbers, rows = _number_channels(view), view.channels(unit)
    styles = panel_styles([numbers[channel.name] for _, channel in rows])
    for (row, channel), style in zip(rows, styles, strict=True):
        parts = [interpolate_samples(part.time, factor * part.q[row], factor * part.v[row]) for part in view.segments]
        time, values = (join_segments(each) for each in zip(*parts, strict=True))
        axes.plot(time, values, label=angle_symbol(channel.name), **style)
    stops = [(i, contact) for i, contact in enumerate(view.contacts) if contact.is_stop and contact.unit == unit]
    levels = set()
    for number, (i, contact) in enumerate(stops):
        levels.add(0.0 if contact.level is None else round(factor * contact.level[1], 9))
        if contact.level is None and any(np.any(part.gaps[i]) for part in view.segments):
            style = line_style(len(numbers) + number)
            _draw_line(
                axes, view, [factor * part.gaps[i] for part in view.segments], label=f"{contact.name}, gap", **style
            )
    for number, level in enumerate(sorted(levels)):
        axes.axhline(level, label=None if number else "joint stop", **LIMIT)


def _draw_actuators(axes: "Axes", view: MotionView, unit: str) -> None:
    """Draw the torques or forces of actuators with their limits, and the impulses of these actuators at impacts."""
    numbers = _number_channels(view)
    chosen = [(row, channel.name) for row, channel in enumerate(view.actuators) if channel.unit == unit]
    for (row, name), style in zip(chosen, panel_styles([numbers[name] for _, name in chosen]), strict=True):
        values = [part.torque[row] for part in view.segments]
        _draw_line(axes, view, values, label=angle_symbol(name), **style)
    _draw_limits(axes, view, chosen, unit)
    draw_actuator_impulses(axes, view, {row: numbers[name] for row, name in chosen}, unit)


def _draw_limits(axes: "Axes", view: MotionView, chosen: Sequence[tuple[int, str]], unit: str) -> None:
    """Draw the limits near the values: one of all actuators in grey, others in the colours of their actuators.

    The legend states a common limit that is outside the panel, or that some limits are.  A limit of zero is that of an
    idle actuator, whose line is its limit.
    """
    numbers, limits = _number_channels(view), {name: float(view.limits.get(name, np.inf)) for _, name in chosen}
    values = np.concatenate([part.torque[row] for part in view.segments for row, _ in chosen] or [np.zeros(1)])
    common = len(set(limits.values())) == 1
    finite = {name: limit for name, limit in limits.items() if np.isfinite(limit) and limit > 0}
    near = {name: select_near_limits(values, (limit, -limit)) for name, limit in finite.items()}
    for number, (name, levels) in enumerate(near.items()):
        color = {} if common else {"color": line_style(numbers[name])["color"]}
        label = "limit" if common else f"limit, {angle_symbol(name)}"
        for place, level in enumerate(levels if number == 0 or not common else []):
            axes.axhline(level, label=None if place else label, **(LIMIT | color))
    if not all(near.values()):
        label = "other limits off scale" if any(near.values()) else "limits off scale"
        if common:
            value = f"{next(iter(finite.values())):g} {unit}".replace(" ", NO_BREAK)
            label = f"limit \N{PLUS-MINUS SIGN}{value}, off{NO_BREAK}scale"
        axes.plot([], [], label=label, **LIMIT)


def _draw_impulses(axes: "Axes", view: MotionView) -> None:
    """Draw the impulse ratio of each foot at impacts, in the colour of the foot; the key of several feet is white."""
    label: str | None = "touchdown impulse"
    style: dict[str, Any] = {"markersize": 5, "linestyle": "none", "clip_on": False, "zorder": 6}
    marked = [(event, foot) for event in view.events for foot in view.feet if event.impulses[foot][1] > 0]
    colors = [foot_style(view, foot)["color"] for _, foot in marked]
    if len(set(colors)) > 1:
        key: dict[str, Any] = {"markerfacecolor": "white", "markeredgecolor": "0.3", "clip_on": True}
        axes.plot([], [], "D", label=label, **(style | key))  # clipped, so that it takes no space in the layout
        label = None
    for (event, foot), color in zip(marked, colors, strict=True):
        tangential, normal = event.impulses[foot]
        axes.plot([event.time], [tangential / normal], "D", label=label, color=color, **style)
        label = None


def widen_constant(axes: "Axes") -> None:
    """Set a range of one unit, or of the size of the values, for values that are constant within errors of the plan."""
    low, high = axes.dataLim.intervaly
    size = max(abs(low), abs(high), 1.0)
    if np.isfinite(high - low) and high - low < ROUNDING * size:
        middle = round((low + high) / 2, 6)
        axes.set_ylim(middle - size / 2, middle + size / 2)


def limit_time(axes: "Axes", view: MotionView) -> None:
    """Limit the time axis to a motion, with space for the mark of an impulse at its end."""
    begin, end = view.segments[0].time[0], view.segments[-1].time[-1]
    last = [event for event in view.events if event.time == end]
    marked = any(event.actuator_impulses or event.impulses[foot][1] > 0 for event in last for foot in view.feet)
    axes.set_xlim(begin, end + marked * MARK_SPACE * (end - begin))


def _number_channels(view: MotionView) -> dict[str, int]:
    """Return the number of each coordinate and actuator, which determines its colour."""
    coordinates = [channel.name for unit in ("rad", "m") for _, channel in view.channels(unit)]
    return number_joints(coordinates, [channel.name for channel in view.actuators])


def _draw_line(axes: "Axes", view: MotionView, parts: list[Array], **style: Any) -> None:
    """Draw a line; gaps between segments leave jumps open instead of drawing them as ramps."""
    time, values = join_segments([segment.time for segment in view.segments]), join_segments(parts)
    axes.plot(time, values, **style)


def join_segments(parts: Sequence[Array]) -> Array:
    """Return arrays of shape (K,) joined into one, with nan after each, which leaves a gap in a line."""
    return np.concatenate([np.append(part, np.nan) for part in parts])
