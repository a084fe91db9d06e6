"""Contact forces in stick figures: each force as a line from its foot, in the friction cone of the ground."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.link_roles import tilt
from gaitopt.motion.motion import Array
from gaitopt.motion.motion_view import MotionView, PhaseView
from gaitopt.plot.style import CONE, FORCE

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

LENGTH = 0.3
"""Length of a force equal to the weight, over the height of the walker."""

FLAT = 0.5
"""Least height of a walker over its length; that of a flat robot, whose points are all on the ground, would be zero."""

FORCE_LABEL = "_force"
"""Label of the line of a force, which no legend shows."""

LABELS = ("contact force", "friction cone")
FORCE_LINE: dict[str, Any] = {"color": FORCE, "linewidth": 1.6, "solid_capstyle": "butt"}
CONE_FACE: dict[str, Any] = {"facecolor": CONE, "edgecolor": "0.6", "linewidth": 0.5}


def draw_contact_forces(
    axes: "Axes", view: MotionView, phase: PhaseView, sample: int, *, shift: float, height: float
) -> None:
    """Draw the nonzero contact forces at a sample of a phase, each in its friction cone.

    A force equal to the weight has a length of 0.3 times the height of the walker; cones are as high as that.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    view : MotionView
    phase : PhaseView
    sample : int
    shift : float [m]
        Displacement of the stick figure along the ground.
    height : float [m]
        Height of the walker.
    """
    friction, slope, unit = view.parameters["friction"], view.parameters["slope"], LENGTH * height
    for foot in view.feet:
        if foot not in view.loaded or phase.modes[foot] is Mode.FREE:
            continue
        place = phase.places[:, foot, sample] + np.array([shift, 0.0])
        if foot in view.cone_feet:
            edge = _cone_edge(friction, unit)
            corners = np.column_stack([place, place + edge * [-1, 1], place + edge])
            axes.fill(*tilt(corners, slope), zorder=1, **CONE_FACE)
        tip = place + unit * phase.forces[foot, :, sample] / view.weight
        axes.plot(*tilt(np.column_stack([place, tip]), slope), zorder=5.5, label=FORCE_LABEL, **FORCE_LINE)


def find_cone_ends(view: MotionView, phase: PhaseView, sample: int, *, height: float) -> tuple[float, float]:
    """Return the left and right ends of the friction cones of `draw_contact_forces` along the ground [m].

    They are infinite, the left end above the right one, if there is no cone.
    """
    feet = [foot for foot in view.cone_feet if phase.modes[foot] is not Mode.FREE]
    if not feet:
        return np.inf, -np.inf
    places, width = phase.places[0, feet, sample], _cone_edge(view.parameters["friction"], LENGTH * height)[0]
    return float(np.min(places - width, initial=np.inf)), float(np.max(places + width, initial=-np.inf))


def find_force_top(view: MotionView, phase: PhaseView, sample: int, *, height: float) -> float:
    """Return the height of the tips of the forces of `draw_contact_forces` above the ground [m]; 0 without any."""
    feet = [foot for foot in view.loaded if phase.modes[foot] is not Mode.FREE]
    tips = phase.places[1, feet, sample] + LENGTH * height * phase.forces[feet, 1, sample] / view.weight
    return float(np.max(tips, initial=0.0))


def _cone_edge(friction: float, unit: float) -> Array:
    """Return the edge of a friction cone from its foot to the right, which has the length of a unit."""
    edge: Array = np.array([friction, 1.0]) * unit / np.hypot(friction, 1.0)
    return edge


def force_handles() -> "list[Artist]":
    """Return the handles of the legend for a contact force and a friction cone, as in `LABELS`."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    return [Line2D([], [], **FORCE_LINE), Patch(**CONE_FACE)]


def walker_height(figures: Sequence[Array]) -> float:
    """Return the height of the tallest of some stick figures, each a (2, n_points) array [m].

    A flat robot has the height of a box of its length.
    """
    heights, lengths = (max(float(np.ptp(figure[axis])) for figure in figures) for axis in (1, 0))
    return max(heights, FLAT * lengths)
