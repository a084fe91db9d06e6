"""Cost of transport of four contact sequences as a function of friction, and the crossovers between them.

Each contact sequence is swept over friction in both directions, and every gait is replayed. At low friction, forward
slip at touchdown and backward slip at the end of the step reduce the cost; at high friction, neither does. The band at
the top has the colour of the sequence of lowest cost. A hollow marker denotes a gait whose slip phase has the minimum
permitted duration.
"""

import numpy as np
from drawing import STYLE, format_sequence
from frontier_setup import FRICTION, SEQUENCE_STYLE, at_minimum_duration, standard_numbers, walker
from matplotlib.lines import Line2D

from gaitopt import Execution, sweep
from gaitopt.study import Reproduction

SLIP, STICK = "slip+ stick | slip+", "stick | stick"


def study(least=0.1, most=0.25, step=0.005, sequences=tuple(SEQUENCE_STYLE), workers=2, path=None):
    """Return the study; `path` is the file of the sweep, from which an interrupted sweep is resumed."""
    friction = np.round(np.arange(least, most + step / 2, step), 6)
    table = sweep(
        walker(), {"friction": friction}, sequences=sequences, path=path, execution=Execution(workers=workers)
    )
    changes = crossovers(friction, table.cost_of_transport.values)
    at = table.cost_of_transport.sel(friction=FRICTION, method="nearest")
    numbers = standard_numbers({sequence: at.sel(sequence=sequence) for sequence in sequences})
    return Reproduction(_draw(table, sequences, changes), tuple(numbers), tuple(_remarks(table, sequences, changes)))


def _draw(table, sequences, changes):
    """Return the figure: costs above, their difference from sticking below."""
    friction, cost = table.friction.values, table.cost_of_transport
    reference = cost.sel(sequence=STICK).values
    with STYLE.figure(4.8) as figure:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        for sequence in sequences:
            values = cost.sel(sequence=sequence).values
            shown = np.where(values < 1.1 * reference, values, np.nan)
            hollow = at_minimum_duration(table.sel(sequence=sequence))
            style = dict(SEQUENCE_STYLE[sequence])
            mark = {"color": style["color"], "linestyle": "", "markersize": 4, "marker": style.pop("marker")}
            for axes, curve in ((above, shown), (below, 100 * (shown / reference - 1))):
                axes.plot(friction, curve, linewidth=1.2, **style)
                axes.plot(friction[~hollow], curve[~hollow], **mark)
                axes.plot(friction[hollow], curve[hollow], markerfacecolor="white", markeredgewidth=0.8, **mark)
        for at, _, _ in changes:
            for axes in (above, below):
                axes.axvline(at, color="0.4", linewidth=0.8, linestyle=(0, (2, 2)))
            above.annotate(f"{at:.3f}", (at, 1), (0, 2), ("data", "axes fraction"), "offset points", ha="center")
        for sequence, low, high in _winners(table, sequences, changes):
            above.axvspan(low, high, 0.97, 1, color=SEQUENCE_STYLE[sequence]["color"], linewidth=0)
        above.set(ylabel="cost of transport", ylim=(None, 1.05 * np.nanmax(reference)))
        keys = [
            Line2D([], [], label=format_sequence(sequence), markersize=4, **SEQUENCE_STYLE[sequence])
            for sequence in sequences
        ]
        above.legend(handles=keys, loc="upper center", bbox_to_anchor=(0.5, 0.95))
        below.set(xlabel=r"friction $\mu$", ylabel="extra cost over sticking [%]", ylim=(-7.5, 4.5))
    return figure


def crossovers(friction, cost):
    """Return the crossovers of lowest cost: (friction, sequence number below, sequence number above).

    Between neighbouring points with different optimal sequences the costs of both are interpolated linearly.
    """
    changes = []
    winners = np.nanargmin(cost, axis=0)
    for i in np.flatnonzero(np.diff(winners)):
        one, other = winners[i], winners[i + 1]
        gaps = (cost[other] - cost[one])[i : i + 2]
        changes.append(
            (float(friction[i] + (friction[i + 1] - friction[i]) * gaps[0] / (gaps[0] - gaps[1])), one, other)
        )
    return changes


def _winners(table, sequences, changes):
    """Yield the sequence of lowest cost with the lower and upper end of its range of friction."""
    friction = table.friction.values
    borders = [friction[0], *(at for at, _, _ in changes), friction[-1]]
    optimal = [int(np.nanargmin(table.cost_of_transport.values[:, 0])), *(above for _, _, above in changes)]
    for number, low, high in zip(optimal, borders, borders[1:], strict=False):
        yield sequences[number], low, high


def _remarks(table, sequences, changes):
    """Yield the ranges of the optimal sequences, the saving by slip at touchdown, and the number of verified gaits."""
    for sequence, low, high in _winners(table, sequences, changes):
        yield f"From friction {low:.3f} to {high:.3f} `{sequence}` has the lowest cost of these sequences."
    friction, pair = table.friction.values, table.cost_of_transport.sel(sequence=[STICK, SLIP]).values
    ends = [at for at, below, _ in crossovers(friction, pair) if below == 1]
    saved = 100 * (1 - pair[1] / pair[0])
    most = int(np.nanargmax(saved))
    yield (
        f"`{SLIP}` costs less than `{STICK}` from friction {friction[0]:.3f}, the lowest value of the sweep, to "
        f"{ends[-1] if ends else friction[-1]:.3f}; the largest saving is {saved[most]:.1f} %, at {friction[most]:.3f}."
    )
    shortest = friction[at_minimum_duration(table.sel(sequence=SLIP))]
    if shortest.size:
        yield f"From friction {shortest[0]:.3f} upwards, the slip phase of `{SLIP}` has the minimum duration."
    solved = int((table.status == "solved").sum())
    yield f"{solved} of {table.status.size} gaits were found, and {int(table.verified.sum())} passed the replay."
    for sequence, at, reason in _missing(table):
        yield f"`{sequence}` at friction {at:.3f}: {reason}."


def _missing(table):
    """Yield contact sequences, frictions and failure reasons of the gaits that were not found."""
    for sequence, number in zip(*np.nonzero(table.status.values != "solved"), strict=True):
        yield table.sequence.values[sequence], table.friction.values[number], table.reason.values[sequence, number]


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
