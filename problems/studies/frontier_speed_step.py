"""Cost of transport over speed and step length at one friction, and what slipping at touchdown saves there.

The colour is the cost of the cheaper of two words. The numbers say by how many percent the gait that slips at touchdown
is cheaper than the one that always sticks; the dot marks the gait of the other studies.
"""

import numpy as np
from drawing import STYLE
from frontier_setup import FRICTION, SPEED, STEP, standard_numbers, walker

from gaitopt import Study, sweep

SLIP, STICK = "slip+ stick | slip+", "stick | stick"


def study(speeds=(0.5, 0.7, 5), steps=(0.38, 0.54, 5), friction=FRICTION, workers=2, path=None):
    """Return the study; axes are (least, most, count) in m/s and m, to which the standard gait is added."""
    speed = np.union1d(np.round(np.linspace(*speeds), 6), [SPEED])
    step = np.union1d(np.round(np.linspace(*steps), 6), [STEP])
    problem = walker(friction=friction)
    table = sweep(problem, speed=speed, step_length=step, words=[STICK, SLIP], workers=workers, path=path)
    cost = table.cost_of_transport
    cheapest, saving = cost.min("word"), 100 * (1 - cost.sel(word=SLIP) / cost.sel(word=STICK))
    with STYLE.figure(3.6) as figure:
        axes = figure.subplots()
        shading = axes.pcolormesh(speed, step, cheapest.T, shading="nearest", cmap="viridis")
        figure.colorbar(shading, label="cost of transport of the cheaper word")
        for i, j in np.ndindex(*saving.shape):
            if np.isfinite(saving.values[i, j]):
                axes.text(speed[i], step[j], f"{saving.values[i, j]:+.1f}", color="white", ha="center", va="bottom")
        axes.plot(SPEED, STEP, "o", markersize=4, color="white")
        axes.set(xlabel="speed [m/s]", ylabel="step length [m]")
        axes.grid(visible=False)
    standard = cost.sel(speed=SPEED, step_length=STEP)
    at = {word: standard.sel(word=word) for word in (STICK, SLIP)}
    return Study(figure, tuple(standard_numbers(at)), tuple(_remarks(table, saving)))


def _remarks(table, saving):
    """Say how large the saving is and how many gaits were found."""
    low, high = float(saving.min()), float(saving.max())
    yield f"Slipping at touchdown saves between {low:.1f} and {high:.1f} % over these speeds and step lengths."
    solved = int((table.status == "solved").sum())
    yield f"{solved} of {table.status.size} gaits were found, and {int(table.verified.sum())} passed their replay."


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
