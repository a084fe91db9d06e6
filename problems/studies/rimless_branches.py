"""Rimless wheel: speed and multiplier of its gaits as functions of friction, with the branches A, B, C, D+ and D-.

D+ and D- denote the sign of the change of the foot speed per step.
"""

import math

import numpy as np
from drawing import GAIT_STYLE, STYLE
from published import OWN, check_value
from rimless_setup import RATE, SLOPE, TYPES, gait

from gaitopt import WalkProblem, rimless_wheel, trace
from gaitopt.study import Reproduction

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


def study(most_friction=1.0, least_friction=0.05):
    """Return the study; Types A, B and C are one branch, and Type D is another that begins at the end of Type C."""
    start = gait("A", most_friction)
    problem = WalkProblem(robot=rimless_wheel(), parameters=start.parameters)
    branches = trace(problem, {"friction": (most_friction, least_friction)}, start=start).branches
    lines = _lines(branches)
    with STYLE.figure(4.8) as figure:
        rows = figure.subplots(2, 2, sharex="col", width_ratios=[1.6, 1])
        for axes in rows.flat:
            for kind, (friction, speed, multiplier) in lines.items():
                axes.plot(friction, speed if axes in rows[0] else multiplier, label=kind, **GAIT_STYLE[kind])
        _label(rows)
    return Reproduction(figure, _numbers(*branches), REMARKS)


def _numbers(sticking, sliding):
    """Return the ends of the types, and the friction at which the foot speed of Type D is constant."""
    sticks, slips = "Type B, stick slip+ | stick", "Type B, slip+ stick slip+ | stick"
    greatest, least = (point.value for point in sticking.special_of("slip_onset"))
    (meeting,), (end,) = (sticking.special_of(kind) for kind in ("impact_cone", "loss_of_stick"))
    (rolls,), (lifts,), (still,) = (sliding.special_of(kind) for kind in ("roll_over", "lift_off", "drift_reversal"))
    return (
        check_value(f"{sticks}: least friction", least, "0.2676", source=OWN),
        check_value(f"{sticks}: greatest friction", greatest, "0.9141", source=OWN),
        check_value(f"{slips}: least friction", meeting.value, "0.2450", source=OWN),
        check_value("Type B: least friction, rounded", meeting.value, "0.25"),
        check_value("Type B: greatest friction, rounded", greatest, "0.91"),
        check_value("Type C: least friction (tan alpha)", end.value, "0.23087", source=OWN),
        check_value("Type C: greatest friction", meeting.value, "0.2450", source=OWN),
        check_value("Type C: least friction, rounded", end.value, "0.24"),
        check_value("Type C: greatest friction, rounded", meeting.value, "0.25"),
        check_value("Type D: least friction", rolls.value, "0.10"),
        check_value("Type D: greatest friction (lifts off)", lifts.value, "0.32"),
        check_value("Type D: friction at which the foot speed is constant (tan alpha)", still.value, "0.23087"),
    )


def _lines(branches):
    """Return (friction, speed, multiplier) along each type, shape (3, K), in order of friction."""
    limit = math.tan(math.radians(SLOPE))
    rows = {kind: [] for kind in GAIT_STYLE}
    for branch in branches:
        rates = branch.states[:, branch.names.index("theta_rate")]
        for row in zip(branch.values, rates, branch.radii, branch.sequences, strict=True):
            friction, kind = row[0], TYPES[row[3]]
            kinds = {_branch(kind, friction < limit)}
            if kind == "D" and abs(friction - limit) < 1e-9:
                kinds = {_branch(kind, rising) for rising in (True, False)}
            for each in kinds:
                rows[each].append(row[:3])
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
