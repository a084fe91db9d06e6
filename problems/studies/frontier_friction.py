"""Cost of transport over friction for four words, and where the cheapest of them changes.

Each word is swept over friction in both directions, and every gait is replayed. The less friction, the more it pays to
let the foot slip: forward at touchdown, and backward at the end of the step.
"""

import numpy as np
from drawing import STYLE, spelled
from frontier_setup import FRICTION, WORD_STYLE, standard_numbers, walker

from gaitopt import Study, sweep


def study(least=0.1, most=0.25, step=0.005, words=tuple(WORD_STYLE), workers=2, path=None):
    """Return the study; `path` keeps the sweep, so that it can be gone on with."""
    friction = np.round(np.arange(least, most + step / 2, step), 6)
    table = sweep(walker(), friction=friction, words=words, workers=workers, path=path)
    cost = table.cost_of_transport
    with STYLE.figure(4.6) as figure:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        reference = cost.sel(word="stick | stick").values
        for word in words:
            style = WORD_STYLE[word] | {"markersize": 3, "linewidth": 1.2}
            above.plot(friction, cost.sel(word=word), label=spelled(word), **style)
            below.plot(friction, 100 * (cost.sel(word=word).values / reference - 1), **style)
        changes = crossovers(friction, cost.values)
        for axes in (above, below):
            for at, _, _ in changes:
                axes.axvline(at, color="0.4", linewidth=0.8, linestyle=(0, (2, 2)))
        for at, _, _ in changes:
            above.annotate(f"{at:.3f}", (at, 1), (0, 2), ("data", "axes fraction"), "offset points", ha="center")
        above.set(ylabel="cost of transport", ylim=(None, 1.03 * np.nanmax(reference)))
        above.legend(loc="upper center")
        below.set(xlabel=r"friction $\mu$", ylabel="dearer than sticking [%]", ylim=(-8, 4))
    at = table.cost_of_transport.sel(friction=FRICTION, method="nearest")
    numbers = standard_numbers({word: at.sel(word=word) for word in words})
    return Study(figure, tuple(numbers), tuple(_remarks(table, words, changes)))


def crossovers(friction, cost):
    """Return where the cheapest word changes: (friction, word number below, word number above).

    Between neighbouring points with different winners the costs of both are interpolated linearly.
    """
    found = []
    winners = np.nanargmin(cost, axis=0)
    for i in np.flatnonzero(np.diff(winners)):
        one, other = winners[i], winners[i + 1]
        gaps = (cost[other] - cost[one])[i : i + 2]
        found.append((float(friction[i] + (friction[i + 1] - friction[i]) * gaps[0] / (gaps[0] - gaps[1])), one, other))
    return found


def _remarks(table, words, changes):
    """Say which word is cheapest where, where slipping at touchdown pays, and whether all gaits passed."""
    friction = table.friction.values
    borders = [friction[0], *(at for at, _, _ in changes), friction[-1]]
    cheapest = [int(np.nanargmin(table.cost_of_transport.values[:, 0])), *(above for _, _, above in changes)]
    for number, low, high in zip(cheapest, borders, borders[1:], strict=False):
        yield f"From friction {low:.3f} to {high:.3f} `{words[number]}` is the cheapest of these words."
    cost = table.cost_of_transport
    pays = friction[(cost.sel(word="slip+ stick | slip+") < cost.sel(word="stick | stick")).values]
    yield f"`slip+ stick | slip+` costs less than `stick | stick` from friction {pays.min():.3f} to {pays.max():.3f}."
    solved = int((table.status == "solved").sum())
    yield f"{solved} of {table.status.size} gaits were found, and {int(table.verified.sum())} passed their replay."


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
