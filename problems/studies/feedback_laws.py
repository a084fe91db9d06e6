"""Compass biped: from what pushes three gaits return, in open loop and under four laws.

The gaits are planned with 5 N m at ankle and hip and, where optimised, margins on both friction cones; feedback may use
6 N m. Laws are tuned for the least spectral radius. Pushes are drawn evenly from a ball; its radius is the root of the
sum of squares of the changes of rates, angles (over the time constant of the leg) and foot speed (over leg length).
"""

from typing import NamedTuple

import numpy as np
from drawing import STYLE, spelled
from feedback_setup import (
    HELD_WITH,
    IMITATED,
    LABEL,
    LAW_STYLE,
    LAWS,
    OPEN_LOOP,
    SLIP,
    STICK,
    largest_ball,
    plan,
    played_back,
    share_returned,
    tuned,
)

from gaitopt import Law
from gaitopt.stability import Cycle, Recovery
from gaitopt.study import PublishedValue, Reproduction

RADIUS, LARGER = 0.5, 3.0
"""Spectral radius that at least two laws should reach, and by what factor their balls should be larger."""
TITLES = {SLIP: "slipping optimum", STICK: "sticking optimum", IMITATED: "Gait C imitated"}


class Row(NamedTuple):
    """A gait under a law: its cycle, the ball of pushes from which all starts return, and the gains."""

    law: Law
    cycle: Cycle
    ball: Recovery
    gains: dict[str, float]


def study(names=(SLIP, STICK, IMITATED), laws=LAWS, evaluations=60, starts=200, sizes=8, most=0.4):  # ball [rad/s]
    """Return the study; each law is verified by so many starts, of which a quarter draw the shares."""
    rows = {name: _rows(name, laws, evaluations, starts) for name in names}
    radii = np.geomspace(most / 100, most, sizes)
    with STYLE.figure(3.4) as figure:
        panels = figure.subplots(1, len(names), sharey=True, squeeze=False)[0]
        for axes, (name, held) in zip(panels, rows.items(), strict=True):
            for law, row in held.items():
                shares = [share_returned(name, row.law, row.cycle, radius, max(starts // 4, 1)) for radius in radii]
                axes.semilogx(
                    radii, np.multiply(shares, 100), label=LABEL.get(law, law), markersize=4, **LAW_STYLE[law]
                )
            axes.set(xlabel="pushes up to [rad/s]", title=TITLES[name], ylim=(-4, 104))
        panels[0].set_ylabel("starts that return [%]")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return Reproduction(figure, tuple(_numbers(rows)), tuple(_remarks(rows)))


def _rows(name, laws, evaluations, starts):
    """Return a gait's rows by law, the open loop first; laws that do not hold it are left out."""
    law, cycle = played_back(name)
    rows = {OPEN_LOOP: Row(law, cycle, largest_ball(name, law, cycle, starts), {})}
    for each in laws:
        found = tuned(name, each, evaluations, starts)
        if found.stable:
            rows[each] = Row(found.law, found.cycle, found.verified, found.gains)
    return rows


def _numbers(rows):
    """Return whether the claims on feedback hold for each gait."""
    for name, held in rows.items():
        before, *laws = held.values()
        fast = sum(row.cycle.radius < RADIUS for row in laws)
        wide = sum(row.ball.complete and row.ball.radius >= LARGER * before.ball.radius for row in laws)
        wanted = min(2, len(laws))
        for count, claim in (
            (fast, f"two laws or more with a spectral radius below {RADIUS:g}"),
            (wide, f"two laws or more whose ball is {LARGER:g} times that of the open loop"),
        ):
            yield PublishedValue(f"{TITLES[name]}: {claim} (1 is yes)", float(count >= wanted), 1.0, 0.0, "the claim")


def _remarks(rows):
    for name, held in rows.items():
        cost = plan(name).cost_of_transport
        yield f"{TITLES[name]}, {spelled(plan(name).sequence)}: cost of transport {cost:.5f}, held with {HELD_WITH:g} N m."
        for law, row in held.items():
            gains = ", ".join(f"{gain} {value:.3g}" for gain, value in row.gains.items())
            yield (
                f"{TITLES[name]}, {LABEL.get(law, law)}{f' ({gains})' if gains else ''}: spectral radius "
                f"{row.cycle.radius:.4f}; {_told(row.ball)}."
            )


def _told(ball):
    if not ball.returned:
        return "returns from no ball of pushes"
    return (
        f"{ball.returned} of {ball.starts} starts within {ball.radius:.4f} rad/s return, in "
        f"{np.median(ball.settling):.0f} steps by the median and {max(ball.settling)} at most"
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
