"""Cost of transport over speed and step length at one friction, and what slipping at touchdown saves there.

On the left the cost of the cheaper of two sequences; on the right by how many percent the gait that slips at touchdown is
cheaper than the one that always sticks, in brackets where its slide lasts as short as it may. The frame marks the gait
of the other studies.
"""

import numpy as np
from drawing import STYLE
from frontier_setup import FRICTION, SPEED, STEP, resting, standard_numbers, walker
from matplotlib.colors import LogNorm
from matplotlib.patches import Rectangle

from gaitopt import Execution, Reproduction, sweep

SLIP, STICK = "slip+ stick | slip+", "stick | stick"


def study(speeds=(0.5, 0.7, 5), steps=(0.38, 0.54, 5), friction=FRICTION, workers=2, path=None):
    """Return the study; axes are (least, most, count) in m/s and m, to which the standard gait is added."""
    speed = np.union1d(np.round(np.linspace(*speeds), 6), [SPEED])
    step = np.union1d(np.round(np.linspace(*steps), 6), [STEP])
    problem = walker(friction=friction)
    table = sweep(
        problem,
        {"speed": speed, "step_length": step},
        sequences=[STICK, SLIP],
        path=path,
        execution=Execution(workers=workers),
    )
    cost = table.cost_of_transport
    saving = 100 * (1 - cost.sel(sequence=SLIP) / cost.sel(sequence=STICK))
    with STYLE.figure(3.4) as figure:
        left, right = figure.subplots(1, 2, sharey=True)
        shading = left.pcolormesh(cost.min("sequence").values.T, cmap="viridis_r", norm=LogNorm())
        bar = figure.colorbar(shading, location="top", label="cost of transport of the cheaper contact sequence")
        bar.ax.minorticks_off()
        bar.set_ticks([0.01, 0.015, 0.02, 0.03], labels=["0.01", "0.015", "0.02", "0.03"])
        shading = right.pcolormesh(saving.values.T, cmap="RdBu", vmin=-15, vmax=15)
        figure.colorbar(shading, location="top", extend="both", label="slipping at touchdown is cheaper by [%]")
        _write(right, saving.values, resting(table.sel(sequence=SLIP)))
        for axes in (left, right):
            corner = int(np.searchsorted(speed, SPEED)), int(np.searchsorted(step, STEP))
            axes.add_patch(Rectangle(corner, 1, 1, fill=False, edgecolor="black", linewidth=1.5))
            axes.set_xticks(np.arange(speed.size) + 0.5, [f"{value:.3g}" for value in speed])
            axes.set_yticks(np.arange(step.size) + 0.5, [f"{value:.3g}" for value in step])
            axes.set(xlabel="speed [m/s]")
            axes.grid(visible=False)
        left.set(ylabel="step length [m]")
    standard = cost.sel(speed=SPEED, step_length=STEP)
    at = {sequence: standard.sel(sequence=sequence) for sequence in (STICK, SLIP)}
    return Reproduction(figure, tuple(standard_numbers(at)), tuple(_remarks(table, saving)))


def _write(axes, saving, hollow):
    """Write numbers into cells, in brackets where `hollow`, in a colour that can be read there."""
    for i, j in np.argwhere(np.isfinite(saving)):
        text = f"{saving[i, j]:.1f}".replace("-", "\N{MINUS SIGN}")
        color = "white" if abs(saving[i, j]) > 10 else "black"
        axes.text(i + 0.5, j + 0.5, f"({text})" if hollow[i, j] else text, color=color, ha="center", va="center")


def _remarks(table, saving):
    """Say where slipping saves, how much, and how many gaits were found."""
    best, worst = (saving.isel(found) for found in (saving.argmax(...), saving.argmin(...)))
    yield (
        f"Slipping at touchdown is cheaper at {int((saving > 0).sum())} of {saving.size} points: most at "
        f"{float(best.speed):g} m/s with steps of {float(best.step_length):g} m, by {float(best):.1f} %. Least it pays "
        f"at {float(worst.speed):g} m/s and {float(worst.step_length):g} m: {float(worst):+.1f} %."
    )
    solved = int((table.status == "solved").sum())
    yield f"{solved} of {table.status.size} gaits were found, and {int(table.verified.sum())} passed their replay."


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
