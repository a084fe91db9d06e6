"""Colours, line styles and settings every drawing shares; nothing here touches matplotlib's global settings."""

import re
from typing import Any

from gaitopt.model.modes import Mode

SETTINGS: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.titlesize": 8.5,
    "axes.labelsize": 8.5,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "figure.titlesize": 9.5,
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "axes.edgecolor": "0.3",
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.unicode_minus": True,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.5,
    "hatch.linewidth": 0.5,
    "pdf.fonttype": 42,
    "svg.fonttype": "path",
}
"""For ``matplotlib.rc_context``, whose type differs between versions of matplotlib."""

# Okabe and Ito's palette, which colour-blind readers can tell apart; dashes tell the lines apart in grey print.
LINES = (("#0072B2", "-"), ("#D55E00", (0, (5, 1.5))), ("#009E73", (0, (5, 1.5, 1, 1.5))), ("#CC79A7", (0, (1, 1))))
LIMIT: dict[str, Any] = {"color": "0.35", "linewidth": 0.9, "linestyle": (0, (2, 2))}

# Two legs: dark and thick against light and thin, so that they differ in grey as well.
FIRST_LEG, SECOND_LEG, BODY = "#12355B", "#D98A2B", "0.45"
GROUND = "0.25"
FORCE = "#B3123F"
CONE = "#DCE6C8"
WARNING = "#B00020"

MODE_FILL = {
    Mode.SLIP_FORWARD: "#E69F00",
    Mode.SLIP_BACKWARD: "#56B4E9",
    Mode.STICK: "0.85",
    Mode.FREE: "0.95",
}
"""For areas and marks."""

MODE_INK = {Mode.SLIP_FORWARD: "#8F4A00", Mode.SLIP_BACKWARD: "#00598C", Mode.STICK: "0.25", Mode.FREE: "0.25"}
"""For text: the same hues, dark enough to read on white."""

MODE_HATCH = {Mode.SLIP_FORWARD: "///", Mode.SLIP_BACKWARD: "\\\\\\", Mode.STICK: "", Mode.FREE: ""}


def line_style(number: int) -> dict[str, Any]:
    """Return colour and dashes of the n-th line of a panel, from 0.

    Examples
    --------
    >>> line_style(0)
    {'color': '#0072B2', 'linestyle': '-'}
    """
    color, dashes = LINES[number % len(LINES)]
    return {"color": color, "linestyle": dashes}


def angle_symbol(name: str) -> str:
    r"""Return how an angle is written in a figure: Greek for ``th1`` or ``theta``, else its name.

    Examples
    --------
    >>> angle_symbol("th2"), angle_symbol("knee")
    ('$\\theta_{2}$', 'knee')
    """
    match = re.fullmatch(r"th(?:eta)?_?(\w*)", name)
    if not match:
        return name
    return rf"$\theta_{{{match[1]}}}$" if match[1] else r"$\theta$"


def spell(mode: Mode) -> str:
    """Return a mode with a true minus sign, which is easier to see than a hyphen.

    Examples
    --------
    >>> spell(Mode.SLIP_FORWARD)
    'slip+'
    """
    return mode.value.replace("-", "\N{MINUS SIGN}")
