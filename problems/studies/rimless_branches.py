"""Rimless wheel: speed and multiplier of its gaits as functions of friction, with the branches A, B, C, D+ and D-.

D+ and D- denote the sign of the change of the foot speed per step.
"""

import math

import numpy as np
from drawing import GAIT_STYLE, STYLE
from published import OWN, check_value
from rimless_setup import RATE, SLOPE, gait, speed_of
from scipy.optimize import brentq

from gaitopt import rimless_wheel, trace_branch
from gaitopt.study import Reproduction

PARTS = {
    "B": ("B", 0.3, 1.0),
    "B, towards C": ("B", 0.3, 0.2),
    "B, slip first": ("B", 0.26, 0.22),
    "C, towards B": ("C", 0.24, 0.26),
    "C": ("C", 0.24, 0.22),
    "D": ("D", 0.3, 0.4),
    "D, less friction": ("D", 0.3, 0.04),
}
"""Type, first and last friction; each part is followed as long as its contact sequence does not change."""

REMARKS = (
    "Types B and C meet at mu = 0.245052, located from both sides; the reference 0.2450 is truncated, not rounded.",
    "The multiplier jumps where Types B and C meet, from 0.7675 to 0.7723: there the impulse lies on the boundary of "
    "its friction cone, and the return map has a kink.",
    "Type C ends at mu = tan(alpha) = 0.23087, where the foot speed of complete slip no longer decreases. The "
    "published value 0.24 is not a rounding of it; the range 0.24 to 0.25 may be the range in which the gait was "
    "searched for.",
    "Type D exists down to mu = 0.0800, below which the wheel no longer rolls over (at 0.081 it still takes 60 steps, "
    "at 0.0799 it rolls back); the published value 0.10 may be the lowest friction that was considered.",
)


def study(points=13, most_friction=1.0):  # points per part of a branch
    """Return the study."""
    branches = {
        name: _follow(gait(kind, first), np.linspace(first, last, points))
        for name, (kind, first, last) in PARTS.items()
    }
    lines = _lines(branches, most_friction)
    with STYLE.figure(4.8) as figure:
        rows = figure.subplots(2, 2, sharex="col", width_ratios=[1.6, 1])
        for axes in rows.flat:
            for kind, (friction, speed, multiplier) in lines.items():
                axes.plot(friction, speed if axes in rows[0] else multiplier, label=kind, **GAIT_STYLE[kind])
        _label(rows)
    return Reproduction(figure, _numbers(branches), REMARKS)


def _numbers(branches):
    """Return the ends of the branches, and the friction at which the foot speed of Type D is constant."""
    sticks, slips = "Type B, stick slip+ | stick", "Type B, slip+ stick slip+ | stick"
    still = brentq(lambda friction: _complete_slip(branches, friction).drift, 0.2, 0.28, xtol=1e-9)
    return (
        check_value(f"{sticks}: least friction", _end(branches["B, towards C"]), "0.2676", source=OWN),
        check_value(f"{sticks}: greatest friction", _end(branches["B"]), "0.9141", source=OWN),
        check_value(f"{slips}: least friction", _end(branches["B, slip first"]), "0.2450", source=OWN),
        check_value("Type B: least friction, rounded", _end(branches["B, slip first"]), "0.25"),
        check_value("Type B: greatest friction, rounded", _end(branches["B"]), "0.91"),
        check_value("Type C: least friction (tan alpha)", _end(branches["C"]), "0.23087", source=OWN),
        check_value("Type C: greatest friction", _end(branches["C, towards B"]), "0.2450", source=OWN),
        check_value("Type C: least friction, rounded", _end(branches["C"]), "0.24"),
        check_value("Type C: greatest friction, rounded", _end(branches["C, towards B"]), "0.25"),
        check_value("Type D: least friction", _end(branches["D, less friction"]), "0.10"),
        check_value("Type D: greatest friction (lifts off)", _end(branches["D"]), "0.32"),
        check_value("Type D: friction at which xd is constant (tan alpha)", still, "0.23087"),
    )


def _complete_slip(branches, friction):
    """Return the gait of Type D at a friction."""
    start = branches["D"].cycles[0]
    return _follow(start, [friction]).cycles[-1]


def _follow(start, frictions):
    return trace_branch(rimless_wheel(), start.parameters, start, {"friction": frictions}, same_sequence=True)


def _end(branch):
    """Return the friction at which a part, or its contact sequence, ends."""
    return branch.special[-1].value


def _lines(branches, most_friction):
    """Return (friction, speed, multiplier) along each branch, shape (3, K), in order of friction."""
    limit = math.tan(math.radians(SLOPE))
    rows = {kind: [] for kind in GAIT_STYLE}
    for name, part in branches.items():
        for friction, cycle in zip(part.values, part.cycles, strict=True):
            rows[_branch(name[0], friction < limit)].append((friction, speed_of(cycle), cycle.radius))
    still = _complete_slip(branches, limit)
    for rising in (True, False):
        rows[_branch("D", rising)].append((limit, speed_of(still), still.radius))
    last = max(rows["B"])
    rows["A"] = [last, (max(most_friction, last[0]), *last[1:])]
    return {kind: np.array(sorted(points)).T for kind, points in rows.items()}


def _branch(kind, rising):
    return kind if kind != "D" else "D+" if rising else "D\N{MINUS SIGN}"


def _label(rows):
    """Label the axes and mark the friction that separates the branches D+ and D-."""
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
