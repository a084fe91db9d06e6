"""Slip phases in figures: their shading, its legend, and their names."""

from typing import TYPE_CHECKING, Any, NamedTuple

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion_view import MotionView, PhaseView
from gaitopt.plot.style import MODE_FILL, MODE_HATCH, MODE_INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import Patch

BOTH_FILL, BOTH_HATCH, BOTH_INK = "0.6", "xx", "0.25"
"""Look of a phase in which one contact slips forward and another one backward: neither colour, and both hatches."""


class SlipLook(NamedTuple):
    """The look of slip phases: colours of areas and of text, hatch, and name."""

    fill: str
    ink: str
    hatch: str
    label: str


def list_slip_modes(part: PhaseView) -> tuple[Mode, ...]:
    """Return the slip modes of the contacts in a phase, each once.

    Examples
    --------
    >>> from gaitopt import load
    >>> from gaitopt.motion.view_motion import view_motion
    >>> [list_slip_modes(part) for part in view_motion(load("docs/examples/compass_slip.h5").motion).segments]
    [(<Mode.SLIP_FORWARD: 'slip+'>,), ()]
    """
    modes = {part.modes[contact] for contact in part.slipping}
    return tuple(mode for mode in (Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD) if mode in modes)


def look_of(modes: tuple[Mode, ...]) -> SlipLook:
    """Return the look of phases with one or two slip modes.

    Examples
    --------
    >>> look_of((Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD)).label
    'slip+ and slip−'
    """
    label = " and ".join(mode.label for mode in modes)
    if len(modes) > 1:
        return SlipLook(BOTH_FILL, BOTH_INK, BOTH_HATCH, label)
    return SlipLook(MODE_FILL[modes[0]], MODE_INK[modes[0]], MODE_HATCH[modes[0]], label)


def shade_slips(axes: "Axes", view: MotionView, *, hatched: bool = True) -> None:
    """Shade the slip phases of a motion over the height of an axes; an edge keeps the shortest visible."""
    for segment in view.segments:
        modes = list_slip_modes(segment)
        if not modes:
            continue
        look, span = look_of(modes), (float(segment.time[0]), float(segment.time[-1]))
        hatch, name = look.hatch if hatched else "", " ".join(mode.value for mode in modes)
        axes.axvspan(*span, facecolor=look.fill, alpha=0.25, linewidth=0, zorder=0, gid=name)
        axes.axvspan(*span, facecolor="none", edgecolor=look.fill, hatch=hatch, linewidth=0.8, zorder=0.5)


def slip_handles(view: MotionView) -> "list[Patch]":
    """Return a handle of the legend, with its label, for each kind of slip phases of a motion."""
    from matplotlib.patches import Patch

    looks = [look_of(modes) for modes in dict.fromkeys(map(list_slip_modes, view.segments)) if modes]
    return [
        Patch(facecolor=(look.fill, 0.3), edgecolor=look.fill, hatch=look.hatch, label=f"{look.label} phase")
        for look in looks
    ]


def name_enlargement(axes: "Axes", phase: PhaseView) -> None:
    """Write above an axes which slip phase it enlarges, in one line: a legend may end just above it."""
    look = look_of(list_slip_modes(phase))
    text = f"{look.label}, {1e3 * phase.duration:.3g} ms"
    style: dict[str, Any] = {"color": look.ink, "ha": "right", "va": "bottom"}
    axes.annotate(text, (1, 1), (0, 3), "axes fraction", "offset points", **style).set_in_layout(False)
