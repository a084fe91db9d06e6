"""The panels of the figure of a gait that share a time axis, and their enlargements over short slip phases."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.model.coordinate_entries import ANGLES, SLIDE
from gaitopt.motion.gait import Gait
from gaitopt.motion.joint_numbers import number_joints
from gaitopt.motion.motion import Array, Motion, Segment
from gaitopt.plot.style import LIMIT, MODE_FILL, MODE_HATCH, MODE_INK, angle_symbol, line_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHORT = 0.15
"""A slip phase is enlarged when it lasts less than this share of the step."""

SINGLE = {"color": "black"}
"""Style of the line of a panel that has only one."""

_LETTER = 0.016
"""Width of a letter of a phase label, as a share of the time axis."""


def short_slips(motion: Motion) -> list[Segment]:
    """Return the slip phases too short to be read on the time axis of the whole step.

    Examples
    --------
    >>> from gaitopt import load
    >>> [phase.mode.value for phase in short_slips(load("docs/examples/compass_slip.h5").motion)]
    ['slip+']
    """
    return [part for part in motion.segments if part.mode.slips and part.duration < SHORT * motion.period]


def draw_angles(axes: "Axes", gait: Gait) -> None:
    """Draw the angles of a step over time [deg]."""
    degrees = [np.rad2deg(segment.q[ANGLES]) for segment in gait.motion.segments]
    _draw_joints(axes, gait.motion, degrees, gait.motion.angles)
    axes.set_ylabel("angle [deg]")


def draw_torques(axes: "Axes", gait: Gait) -> None:
    """Draw the joint torques of a step over time, with their limits [N m]."""
    motion = gait.motion
    _draw_joints(axes, motion, [segment.torque for segment in motion.segments], motion.actuators)
    axes.set_ylabel("torque [N m]")
    if not motion.actuators:
        axes.text(0.5, 0.5, "no actuators", transform=axes.transAxes, ha="center", va="center")
        axes.set_yticks([])
    limits = gait.problem.get("torque_limit") or {}
    finite = sorted({float(limit) for limit in limits.values() if np.isfinite(limit)})
    for number, limit in enumerate(finite):
        label = "limit" if number == 0 else None
        axes.axhline(limit, label=label, **LIMIT)
        axes.axhline(-limit, **LIMIT)


def draw_force_ratio(axes: "Axes", gait: Gait) -> None:
    """Draw the ratio of tangential to normal contact force over time, with the friction cone."""
    from matplotlib.ticker import MaxNLocator

    motion = gait.motion
    friction = motion.parameters["friction"]
    _draw_line(axes, motion, [sample_force_ratio(segment) for segment in motion.segments], **SINGLE)
    for jump in motion.jumps:
        if jump.impulse[1] > 0:
            style: dict[str, Any] = {
                "color": "black",
                "markersize": 5,
                "linestyle": "none",
                "clip_on": False,
                "zorder": 6,
            }
            axes.plot([jump.time], [jump.ratio], "D", label="touchdown impulse", **style)
    axes.set_ylabel(r"force ratio $f_t/f_n$")
    reach = float(np.max(np.abs(axes.dataLim.intervaly), initial=0.01))
    if np.isfinite(friction) and friction > 0:
        axes.axhline(friction, label=rf"cone $\pm\mu=\pm{friction:g}$", **LIMIT)
        axes.axhline(-friction, **LIMIT)
        reach = max(reach, friction)
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    # No line is drawn below the cone, which leaves room for the legend.
    axes.set_ylim(-1.75 * reach, 1.25 * reach)


def draw_foot_speed(axes: "Axes", gait: Gait) -> None:
    """Draw the tangential speed of the stance foot over time [m/s]."""
    motion = gait.motion
    _draw_line(axes, motion, [segment.v[SLIDE] for segment in motion.segments], **SINGLE)
    axes.set_ylabel("foot speed [m/s]")
    if not any(segment.mode.slips for segment in motion.segments):
        axes.set_ylim(-0.1, 0.1)


def sample_force_ratio(segment: Segment) -> Array:
    """Return f_t / f_n of a segment, shape (K,); nan where the normal force is not positive."""
    f_t, f_n = segment.force
    return np.where(f_n > 0, f_t / np.where(f_n > 0, f_n, 1.0), np.nan)


def shade_slips(axes: "Axes", motion: Motion, *, hatched: bool = True) -> None:
    """Shade the slip phases of a motion over the height of an axes; an edge keeps the shortest visible."""
    for segment in motion.segments:
        if segment.mode.slips:
            color = MODE_FILL[segment.mode]
            hatch = MODE_HATCH[segment.mode] if hatched else ""
            span = (float(segment.time[0]), float(segment.time[-1]))
            axes.axvspan(*span, facecolor=color, alpha=0.25, linewidth=0, zorder=0, gid=segment.mode.value)
            axes.axvspan(*span, facecolor="none", edgecolor=color, hatch=hatch, linewidth=0.8, zorder=0.5)


def name_enlargement(axes: "Axes", phase: Segment) -> None:
    """Write above an axes which phase it enlarges, where the legend of the panel above leaves space."""
    text = f"{phase.mode.label} enlarged\n{1e3 * phase.duration:.3g} ms"
    style: dict[str, Any] = {"color": MODE_INK[phase.mode], "ha": "right", "va": "bottom"}
    axes.annotate(text, (1, 1), (0, 3), "axes fraction", "offset points", **style).set_in_layout(False)


def name_phases(axes: "Axes", motion: Motion) -> None:
    """Write the mode of every phase above an axes; names that would collide move up a line."""
    start, period = float(motion.segments[0].time[0]), motion.period
    rows: list[float] = []
    for segment in motion.segments:
        name = segment.mode.label
        half = _LETTER * len(name) / 2
        middle = ((segment.time[0] + segment.time[-1]) / 2 - start) / period
        middle = float(np.clip(middle, half, 1 - half))
        row = next((number for number, end in enumerate(rows) if end < middle - half), len(rows))
        rows[row : row + 1] = [middle + half]
        style: dict[str, Any] = {"color": MODE_INK[segment.mode], "weight": "bold" if segment.mode.slips else "normal"}
        axes.annotate(
            name, (middle, 1), (0, 3 + 10 * row), "axes fraction", "offset points", ha="center", va="bottom", **style
        )


def enlarge(axes: "Axes", gait: Gait, phase: Segment, draw: Callable[["Axes", Gait], None]) -> None:
    """Draw a panel again over a short slip phase only, with its time in ms.

    The shading is plain here, where a hatch would be coarser than what is to be read.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    gait : Gait
    phase : Segment
        One of the gait's segments.
    draw : callable
        What draws the panel over the whole step.
    """
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    draw(axes, gait)
    for line in axes.lines:
        line.set_clip_on(True)  # the touchdown lies far outside
    shade_slips(axes, gait.motion, hatched=False)
    axes.set_ylabel("")
    axes.set_xlim(phase.time[0] - 0.25 * phase.duration, phase.time[-1] + 0.25 * phase.duration)
    axes.xaxis.set_major_locator(MaxNLocator(3, steps=[1, 2, 5, 10]))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda time, _: f"{1e3 * time:g}"))


def _draw_joints(axes: "Axes", motion: Motion, parts: list[Array], names: Sequence[str]) -> None:
    """Draw a line for each joint, in the style that the joint has in all panels.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    motion : Motion
    parts : list of (n, K) arrays
        One array a segment, with a row for each name.
    names : n angles or actuators
    """
    numbers = number_joints(motion.angles, motion.actuators)
    for row, name in enumerate(names):
        style = line_style(numbers[name])
        _draw_line(axes, motion, [part[row] for part in parts], label=angle_symbol(name), **style)


def _draw_line(axes: "Axes", motion: Motion, parts: list[Array], **style: Any) -> None:
    """Draw a line; gaps between segments leave jumps open instead of drawing them as ramps."""
    time, values = join_segments([segment.time for segment in motion.segments]), join_segments(parts)
    axes.plot(time, values, **style)


def join_segments(parts: Sequence[Array]) -> Array:
    """Return arrays of shape (K,) joined into one, with nan after each, which leaves a gap in a line."""
    return np.concatenate([np.append(part, np.nan) for part in parts])
