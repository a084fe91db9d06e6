"""Cost of transport over friction for four contact sequences, and where the cheapest of them changes.

Each sequence is swept over friction in both directions, and every gait is replayed. The less friction, the more it pays to
let the foot slip: forward at touchdown, and backward at the end of the step. The band on top has the colour of the
cheapest sequence. Marks are hollow where a slide lasts as short as it may: the sequence would rather do without it.
"""

import numpy as np
from drawing import STYLE, spelled
from frontier_setup import FRICTION, SEQUENCE_STYLE, resting, standard_numbers, walker
from matplotlib.lines import Line2D

from gaitopt import Execution, Reproduction, sweep

SLIP, STICK = "slip+ stick | slip+", "stick | stick"


def study(least=0.1, most=0.25, step=0.005, sequences=tuple(SEQUENCE_STYLE), workers=2, path=None):
    """Return the study; `path` keeps the sweep, so that it can be gone on with."""
    friction = np.round(np.arange(least, most + step / 2, step), 6)
    table = sweep(
        walker(), {"friction": friction}, sequences=sequences, path=path, execution=Execution(workers=workers)
    )
    changes = crossovers(friction, table.cost_of_transport.values)
    at = table.cost_of_transport.sel(friction=FRICTION, method="nearest")
    numbers = standard_numbers({sequence: at.sel(sequence=sequence) for sequence in sequences})
    return Reproduction(_drawn(table, sequences, changes), tuple(numbers), tuple(_remarks(table, sequences, changes)))


def _drawn(table, sequences, changes):
    """Return the figure: costs above, their difference from sticking below."""
    friction, cost = table.friction.values, table.cost_of_transport
    reference = cost.sel(sequence=STICK).values
    with STYLE.figure(4.8) as figure:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        for sequence in sequences:
            own = cost.sel(sequence=sequence).values
            shown = np.where(own < 1.1 * reference, own, np.nan)
            hollow = resting(table.sel(sequence=sequence))
            style = dict(SEQUENCE_STYLE[sequence])
            mark = {"color": style["color"], "linestyle": "", "markersize": 4, "marker": style.pop("marker")}
            for axes, values in ((above, shown), (below, 100 * (shown / reference - 1))):
                axes.plot(friction, values, linewidth=1.2, **style)
                axes.plot(friction[~hollow], values[~hollow], **mark)
                axes.plot(friction[hollow], values[hollow], markerfacecolor="white", markeredgewidth=0.8, **mark)
        for at, _, _ in changes:
            for axes in (above, below):
                axes.axvline(at, color="0.4", linewidth=0.8, linestyle=(0, (2, 2)))
            above.annotate(f"{at:.3f}", (at, 1), (0, 2), ("data", "axes fraction"), "offset points", ha="center")
        for sequence, low, high in _winners(table, sequences, changes):
            above.axvspan(low, high, 0.97, 1, color=SEQUENCE_STYLE[sequence]["color"], linewidth=0)
        above.set(ylabel="cost of transport", ylim=(None, 1.05 * np.nanmax(reference)))
        keys = [
            Line2D([], [], label=spelled(sequence), markersize=4, **SEQUENCE_STYLE[sequence]) for sequence in sequences
        ]
        above.legend(handles=keys, loc="upper center", bbox_to_anchor=(0.5, 0.95))
        below.set(xlabel=r"friction $\mu$", ylabel="dearer than sticking [%]", ylim=(-7.5, 4.5))
    return figure


def crossovers(friction, cost):
    """Return where the cheapest sequence changes: (friction, sequence number below, sequence number above).

    Between neighbouring points with different winners the costs of both are interpolated linearly.
    """
    found = []
    winners = np.nanargmin(cost, axis=0)
    for i in np.flatnonzero(np.diff(winners)):
        one, other = winners[i], winners[i + 1]
        gaps = (cost[other] - cost[one])[i : i + 2]
        found.append((float(friction[i] + (friction[i + 1] - friction[i]) * gaps[0] / (gaps[0] - gaps[1])), one, other))
    return found


def _winners(table, sequences, changes):
    """Yield the cheapest contact sequence from one friction to another."""
    friction = table.friction.values
    borders = [friction[0], *(at for at, _, _ in changes), friction[-1]]
    cheapest = [int(np.nanargmin(table.cost_of_transport.values[:, 0])), *(above for _, _, above in changes)]
    for number, low, high in zip(cheapest, borders, borders[1:], strict=False):
        yield sequences[number], low, high


def _remarks(table, sequences, changes):
    """Say which contact sequence is cheapest where, where slipping at touchdown pays, and whether all gaits passed."""
    for sequence, low, high in _winners(table, sequences, changes):
        yield f"From friction {low:.3f} to {high:.3f} `{sequence}` is the cheapest of these contact sequences."
    friction, pair = table.friction.values, table.cost_of_transport.sel(sequence=[STICK, SLIP]).values
    ends = [at for at, below, _ in crossovers(friction, pair) if below == 1]
    saved = 100 * (1 - pair[1] / pair[0])
    most = int(np.nanargmax(saved))
    yield (
        f"`{SLIP}` beats `{STICK}` from friction {friction[0]:.3f}, the least here, to "
        f"{ends[-1] if ends else friction[-1]:.3f}; most, by {saved[most]:.1f} %, at {friction[most]:.3f}."
    )
    idle = friction[resting(table.sel(sequence=SLIP))]
    if idle.size:
        yield f"From friction {idle[0]:.3f} on its slide lasts as short as it may."
    solved = int((table.status == "solved").sum())
    yield f"{solved} of {table.status.size} gaits were found, and {int(table.verified.sum())} passed their replay."
    for sequence, at, reason in _missing(table):
        yield f"None was found for `{sequence}` at friction {at:.3f}: {reason}."


def _missing(table):
    """Yield contact sequences, frictions and reasons of the gaits that were not found."""
    for sequence, number in zip(*np.nonzero(table.status.values != "solved"), strict=True):
        yield table.sequence.values[sequence], table.friction.values[number], table.reason.values[sequence, number]


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
