"""Draw the figure of the page on physics: the compass biped in the frame of the slope, and its friction cone."""

import math

import numpy as np

from gaitopt import FigureStyle, compass_biped, find_cycles
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.link_roles import tilt
from gaitopt.motion.view_motion import view_motion
from gaitopt.plot.contact_forces import CONE_FACE, FORCE_LINE, draw_contact_forces
from gaitopt.plot.ground_line import draw_ground
from gaitopt.plot.stick_figures import draw_links, leg_look
from gaitopt.plot.style import FORCE, MODE_INK

SLOPE, FRICTION = math.radians(8), 0.6
INSTANT = 0.95
"""Fraction of the step at which the walker is drawn."""

ORIGIN = -0.95
"""Place of the axes of the frame on the ground [m]."""

ARROW = {"arrowstyle": "-|>", "shrinkA": 0, "shrinkB": 0, "mutation_scale": 9, "linewidth": 1.0, "color": "black"}
AUXILIARY = {"color": "0.35", "linewidth": 0.8, "linestyle": (0, (3, 2))}


def draw_frame():
    """Return the figure: frame, angles and contact force of a gait on the left, the friction cone on the right."""
    gait = find_cycles(compass_biped(), {"slope": SLOPE, "friction": FRICTION})[0]
    with FigureStyle(width=5, font_size=9).figure(2.5) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1.25, 1))
        draw_walker(left, view_motion(gait.motion))
        draw_cone(right)
        for axes in (left, right):
            axes.set_aspect("equal")
            axes.axis("off")
    return figure


def draw_walker(axes, view):
    """Draw the compass biped at an instant of its step, with the axes of the frame, the angles and the force."""
    phase = view.segments[0]
    sample = int(INSTANT * (len(phase.time) - 1))
    points = phase.points[:, :, sample]
    foot, swing, hip = (points[:, number] for number in number_points(view))
    draw_ground(axes, None, (ORIGIN - 0.1, swing[0] + 0.2), SLOPE)
    draw_contact_forces(axes, view, phase, sample, shift=0.0, height=1.3)
    for link, contact in zip(view.links, view.link_contacts, strict=True):
        color, width, layer = leg_look(view, contact)
        draw_links(axes, tilt(points, SLOPE), (link,), color=color, linewidth=width, zorder=layer)
    axes.plot(*tilt(hip, SLOPE), "o", color="black", markerfacecolor="white", markersize=5, zorder=6)
    draw_angle(axes, foot, (0, 1), hip - foot, r"$\theta_1$", radius=0.78, length=1.15)
    draw_angle(axes, hip, (0, -1), swing - hip, r"$\theta_2$", radius=0.5)
    origin = np.array([ORIGIN, 0.0])
    draw_arrow(axes, origin, origin + np.array([0.4, 0.0]), "$x$", aside=(-0.02, -0.09))
    draw_arrow(axes, origin, origin + np.array([0.0, 0.4]), "$y$", aside=(0, 0.07))
    level = [math.cos(SLOPE), math.sin(SLOPE)]
    draw_angle(axes, origin, level, (1, 0), r"$\alpha$", radius=0.56, length=0.65)
    top, down = origin + np.array([0.2, 0.95]), np.array([math.sin(SLOPE), -math.cos(SLOPE)])
    draw_arrow(axes, top, top + 0.3 * down, "$g$", aside=0.08 * down)
    axes.text(*tilt(foot + np.array([0.3, 0.27]), SLOPE), "$(f_t, f_n)$", color=FORCE, va="center")


def number_points(view):
    """Return the numbers of the stance foot, the swing foot and the hip among the drawn points."""
    (hip,) = view.joints
    return view.foot_points[0], view.foot_points[1], hip


def draw_angle(axes, corner, begin, end, text, *, radius, length=1.0):
    """Draw the angle between two directions at a corner: a dashed line along the first one, an arc and a symbol."""
    begin, end = np.array(begin, dtype=float), np.array(end, dtype=float)
    axes.plot(*tilt(np.column_stack([corner, corner + length * begin]), SLOPE), zorder=1.5, **AUXILIARY)
    first, last = math.atan2(begin[1], begin[0]), math.atan2(end[1], end[0])
    turns = np.linspace(first, last, 30)
    arc = corner[:, None] + radius * np.array([np.cos(turns), np.sin(turns)])
    axes.plot(*tilt(arc, SLOPE), color="black", linewidth=0.8, zorder=6)
    middle = (first + last) / 2
    axes.text(
        *tilt(corner + (radius + 0.11) * np.array([math.cos(middle), math.sin(middle)]), SLOPE),
        text,
        ha="center",
        va="center",
    )


def draw_arrow(axes, begin, end, text, *, aside):
    """Draw an arrow, and its symbol aside of its tip."""
    axes.annotate("", tilt(end, SLOPE), tilt(begin, SLOPE), arrowprops=ARROW)
    axes.text(*tilt(end + np.array(aside), SLOPE), text, ha="center", va="center")


def draw_cone(axes):
    """Draw the friction cone with the forces of a sticking foot and of feet that slip forward and backward."""
    edge = np.array([FRICTION, 1.0])
    corners = np.column_stack([(0, 0), edge * [-1, 1], edge])
    axes.fill(*tilt(corners, SLOPE), zorder=1, **CONE_FACE)
    draw_ground(axes, None, (-0.9, 0.9), SLOPE)
    axes.plot(*tilt(np.array([[0, 0], [0, 1.12]]), SLOPE), zorder=1.5, **AUXILIARY)
    for share, mode, text in (
        (-1.0, Mode.SLIP_FORWARD, "slip+\n$f_t = -\\mu f_n$"),
        (0.45, Mode.STICK, "stick\n$|f_t| \\leq \\mu f_n$"),
        (1.0, Mode.SLIP_BACKWARD, "slip\N{MINUS SIGN}\n$f_t = +\\mu f_n$"),
    ):
        tip = np.array([share * FRICTION, 1.0]) * 0.86
        axes.plot(*tilt(np.column_stack([(0, 0), tip]), SLOPE), **FORCE_LINE)
        place = np.array([1.3 * share * FRICTION, 1.22]) if mode is not Mode.STICK else np.array([0.0, 1.32])
        axes.text(*tilt(place, SLOPE), text, color=MODE_INK[mode], ha="center", va="center")
