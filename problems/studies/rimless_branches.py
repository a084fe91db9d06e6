"""Rimless wheel: speed and multiplier of its gaits over friction, with the branches A, B, C, D+ and D-.

D+ and D- name the sign of the change of the foot speed per step.
"""

import math

import numpy as np
from drawing import GAIT_STYLE, STYLE
from published import OWN, published
from rimless_setup import RATE, SLOPE, gait, speed_of
from scipy.optimize import brentq

from gaitopt import rimless_wheel, trace_branch
from gaitopt.study import Reproduction

STRETCHES = {
    "B": ("B", 0.3, 1.0),
    "B, towards C": ("B", 0.3, 0.2),
    "B, slip first": ("B", 0.26, 0.22),
    "C, towards B": ("C", 0.24, 0.26),
    "C": ("C", 0.24, 0.22),
    "D": ("D", 0.3, 0.4),
    "D, less friction": ("D", 0.3, 0.04),
}
"""Type, first and last friction; each stretch is followed as far as its contact sequence goes."""

REMARKS = (
    "Types B and C meet at mu = 0.245052, found from both sides; the reference 0.2450 is cut off, not rounded.",
    "The multiplier jumps where Types B and C meet, from 0.7675 to 0.7723: there the impact rests on the edge of its "
    "friction cone, and the return map has a kink.",
    "Type C ends at mu = tan(alpha) = 0.23087, where the foot speed of complete slip no longer falls. The study's 0.24 "
    "for this end is not a rounding of it; its range 0.24 to 0.25 is perhaps where the gait was looked for.",
    "Type D walks down to mu = 0.0800, below which the wheel no longer rolls over (at 0.081 it still takes 60 steps, "
    "at 0.0799 it falls back); the study's 0.10 is perhaps the least friction it looked at.",
)


def study(points=13, most_friction=1.0):  # points per stretch of a branch
    """Return the study."""
    found = {
        name: _followed(gait(kind, first), np.linspace(first, last, points))
        for name, (kind, first, last) in STRETCHES.items()
    }
    lines = _lines(found, most_friction)
    with STYLE.figure(4.8) as figure:
        rows = figure.subplots(2, 2, sharex="col", width_ratios=[1.6, 1])
        for axes in rows.flat:
            for kind, (friction, speed, multiplier) in lines.items():
                axes.plot(friction, speed if axes in rows[0] else multiplier, label=kind, **GAIT_STYLE[kind])
        _label(rows)
    return Reproduction(figure, _numbers(found), REMARKS)


def _numbers(found):
    """Return where the branches end, and where the foot speed of Type D stops changing."""
    sticks, slips = "Type B, stick slip+ | stick", "Type B, slip+ stick slip+ | stick"
    still = brentq(lambda friction: _complete_slip(found, friction).drift, 0.2, 0.28, xtol=1e-9)
    return (
        published(f"{sticks}: least friction", _end(found["B, towards C"]), "0.2676", source=OWN),
        published(f"{sticks}: greatest friction", _end(found["B"]), "0.9141", source=OWN),
        published(f"{slips}: least friction", _end(found["B, slip first"]), "0.2450", source=OWN),
        published("Type B: least friction, rounded", _end(found["B, slip first"]), "0.25"),
        published("Type B: greatest friction, rounded", _end(found["B"]), "0.91"),
        published("Type C: least friction (tan alpha)", _end(found["C"]), "0.23087", source=OWN),
        published("Type C: greatest friction", _end(found["C, towards B"]), "0.2450", source=OWN),
        published("Type C: least friction, rounded", _end(found["C"]), "0.24"),
        published("Type C: greatest friction, rounded", _end(found["C, towards B"]), "0.25"),
        published("Type D: least friction", _end(found["D, less friction"]), "0.10"),
        published("Type D: greatest friction (lifts off)", _end(found["D"]), "0.32"),
        published("Type D: friction at which xd stays (tan alpha)", still, "0.23087"),
    )


def _complete_slip(found, friction):
    """Return the gait of Type D at a friction."""
    start = found["D"].cycles[0]
    return _followed(start, [friction]).cycles[-1]


def _followed(start, frictions):
    return trace_branch(rimless_wheel(), start.parameters, start, "friction", frictions, same_sequence=True)


def _end(branch):
    """Return where a stretch, or its contact sequence, ends."""
    return branch.special[-1].value


def _lines(found, most_friction):
    """Return (friction, speed, multiplier) along each branch, shape (3, K), in order of friction."""
    limit = math.tan(math.radians(SLOPE))
    rows = {kind: [] for kind in GAIT_STYLE}
    for name, stretch in found.items():
        for friction, cycle in zip(stretch.values, stretch.cycles, strict=True):
            rows[_branch(name[0], friction < limit)].append((friction, speed_of(cycle), cycle.radius))
    still = _complete_slip(found, limit)
    for rising in (True, False):
        rows[_branch("D", rising)].append((limit, speed_of(still), still.radius))
    last = max(rows["B"])
    rows["A"] = [last, (max(most_friction, last[0]), *last[1:])]
    return {kind: np.array(sorted(points)).T for kind, points in rows.items()}


def _branch(kind, rising):
    return kind if kind != "D" else "D+" if rising else "D\N{MINUS SIGN}"


def _label(rows):
    """Name the axes and mark where the branches D+ and D- part."""
    limit = math.tan(math.radians(SLOPE))
    rows[0, 0].set(ylabel=rf"rate after impact $\dot\theta$ [{RATE}]", xlim=(0.05, 1.0), title="all gaits")
    rows[1, 0].set(ylabel="multiplier (largest modulus)", ylim=(0.3, 0.85))
    rows[0, 1].set(xlim=(0.222, 0.278), ylim=(0.855, 0.9), title="enlarged around Type C")
    rows[1, 1].set(ylim=(0.72, 0.83))
    for axes in rows[1]:
        axes.set_xlabel(r"friction $\mu$")
    for axes in rows[:, 1]:
        axes.axvline(limit, color="0.5", linewidth=0.8, zorder=0)
        axes.text(limit, 0.03, r" $\tan\alpha$", transform=axes.get_xaxis_transform(), color="0.35")
    rows[0, 0].legend(title="Type", loc="lower right", handlelength=3)


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
