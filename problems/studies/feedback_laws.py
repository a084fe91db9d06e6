"""Compass biped: recovery of three gaits from pushes, in open loop and under four laws.

The gaits are planned with at most 5 N m at ankle and hip and, if optimised, with margins from the boundaries of the
contact cone and the impact cone; feedback may use at most 6 N m. The laws are tuned for the smallest spectral radius.
Pushes are uniformly distributed in a ball. The size of a push [rad/s] is the root of the sum of squares of the changes
of the rates, of sqrt(g / l) times those of the angles, and of that of the foot speed divided by the leg length l.

The tuned gains are in parentheses: stiffness and damping in N m/rad and N m s/rad (joint PD) or 1/s^2 and 1/s (computed
torque); for LQR and step-to-step LQR ("step to step"), the torque [N m] and the deviation of a rate [rad/s] that each
cost 1.
"""

from typing import NamedTuple

import numpy as np
from drawing import STYLE, format_sequence
from feedback_setup import (
    FEEDBACK_LIMIT,
    IMITATED,
    LABEL,
    LAW_STYLE,
    LAWS,
    OPEN_LOOP,
    SLIP,
    STICK,
    assess_open_loop,
    largest_ball,
    plan,
    recovery_rate,
    tune_law,
)

from gaitopt import Law
from gaitopt.stability import Cycle, Recovery
from gaitopt.study import PublishedValue, Reproduction

RADIUS, LARGER = 0.5, 3.0
"""Spectral radius that at least two laws should reach, and the factor by which their balls should be larger."""
TITLES = {SLIP: "slipping optimum", STICK: "sticking optimum", IMITATED: "Gait C imitated"}


class Row(NamedTuple):
    """A gait under a law: its cycle, the ball of pushes from which all walks return, and the gains."""

    law: Law
    cycle: Cycle
    ball: Recovery
    gains: dict[str, float]


def study(names=(SLIP, STICK, IMITATED), laws=LAWS, evaluations=60, starts=200, sizes=8, most=0.4):  # ball [rad/s]
    """Return the study; each law is verified with `starts` starts, and the recovery rates use a quarter of them."""
    rows = {name: _rows(name, laws, evaluations, starts) for name in names}
    radii = np.geomspace(most / 100, most, sizes)
    with STYLE.figure(3.4) as figure:
        panels = figure.subplots(1, len(names), sharey=True, squeeze=False)[0]
        for axes, (name, by_law) in zip(panels, rows.items(), strict=True):
            for law, row in by_law.items():
                rates = [recovery_rate(name, row.law, row.cycle, radius, max(starts // 4, 1)) for radius in radii]
                axes.semilogx(radii, np.multiply(rates, 100), label=LABEL.get(law, law), markersize=4, **LAW_STYLE[law])
            axes.set(xlabel="pushes up to [rad/s]", title=TITLES[name], ylim=(-4, 104))
        panels[0].set_ylabel("starts that return [%]")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return Reproduction(figure, tuple(_numbers(rows)), tuple(_remarks(rows)))


def _rows(name, laws, evaluations, starts):
    """Return the rows of a gait by law, the open loop first; laws that do not stabilise it are omitted."""
    law, cycle = assess_open_loop(name)
    rows = {OPEN_LOOP: Row(law, cycle, largest_ball(name, law, cycle, starts), {})}
    for each in laws:
        tuning = tune_law(name, each, evaluations, starts)
        if tuning.stable:
            rows[each] = Row(tuning.law, tuning.cycle, tuning.verified, tuning.gains)
    return rows


def _numbers(rows):
    """Return whether the claims on feedback are true for each gait."""
    for name, by_law in rows.items():
        before, *laws = by_law.values()
        fast = sum(row.cycle.radius < RADIUS for row in laws)
        wide = sum(row.ball.complete and row.ball.radius >= LARGER * before.ball.radius for row in laws)
        required = min(2, len(laws))
        for count, claim in (
            (fast, f"at least two laws with a spectral radius below {RADIUS:g}"),
            (wide, f"at least two laws with a ball at least {LARGER:g} times that of the open loop"),
        ):
            yield PublishedValue(f"{TITLES[name]}: {claim} (1 = yes)", float(count >= required), 1.0, 0.0, "claim")


def _remarks(rows):
    for name, by_law in rows.items():
        cost = plan(name).cost_of_transport
        sequence = format_sequence(plan(name).sequence)
        limit = f"{FEEDBACK_LIMIT:g} N m"
        yield f"{TITLES[name]}, {sequence}: cost of transport {cost:.5f}, stabilised with at most {limit}."
        for law, row in by_law.items():
            gains = ", ".join(f"{gain} {value:.3g}" for gain, value in row.gains.items())
            yield (
                f"{TITLES[name]}, {LABEL.get(law, law)}{f' ({gains})' if gains else ''}: spectral radius "
                f"{row.cycle.radius:.4f}; {_describe_recovery(row.ball)}."
            )


def _describe_recovery(ball):
    if not ball.returned:
        return "no ball of pushes with full recovery"
    return (
        f"{ball.returned} of {ball.starts} starts within {ball.radius:.4f} rad/s return "
        f"(median {np.median(ball.settling):.0f} steps, at most {max(ball.settling)})"
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
