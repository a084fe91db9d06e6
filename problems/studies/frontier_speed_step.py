"""Cost of transport over speed and step length at one friction coefficient, and the saving by slip at touchdown.

Left: cost of transport of the better of two contact sequences. Right: saving of the gait that slips at touchdown
relative to the one that always sticks, in percent; a saving in parentheses is that of a gait whose slip phase has the
minimum permitted duration. The frame marks the standard gait.
"""

import numpy as np
from drawing import STYLE
from frontier_setup import FRICTION, SPEED, STEP, at_minimum_duration, standard_numbers, walker
from matplotlib.colors import LogNorm
from matplotlib.patches import Rectangle

from gaitopt import Execution, sweep
from gaitopt.study import Reproduction

SLIP, STICK = "slip+ stick | slip+", "stick | stick"


def study(speeds=(0.5, 0.7, 5), steps=(0.38, 0.54, 5), friction=FRICTION, workers=2, path=None):
    """Return the study; axes are (least, most, count) in m/s and m, to which those of the standard gait are added."""
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
        bar = figure.colorbar(shading, location="top", label="lower cost of transport of the two sequences")
        bar.ax.minorticks_off()
        bar.set_ticks([0.01, 0.015, 0.02, 0.03], labels=["0.01", "0.015", "0.02", "0.03"])
        shading = right.pcolormesh(saving.values.T, cmap="RdBu", vmin=-15, vmax=15)
        figure.colorbar(shading, location="top", extend="both", label="saving by slip at touchdown [%]")
        _write(right, saving.values, at_minimum_duration(table.sel(sequence=SLIP)))
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
    """Write numbers into cells, in parentheses where `hollow`, in a legible colour."""
    for i, j in np.argwhere(np.isfinite(saving)):
        text = f"{saving[i, j]:z.1f}".replace("-", "\N{MINUS SIGN}")
        color = "white" if abs(saving[i, j]) > 10 else "black"
        axes.text(i + 0.5, j + 0.5, f"({text})" if hollow[i, j] else text, color=color, ha="center", va="center")


def _remarks(table, saving):
    """Yield the range of the saving and the number of gaits that were found and verified."""
    best, worst = (saving.isel(index) for index in (saving.argmax(...), saving.argmin(...)))
    yield (
        f"Slip at touchdown reduces the cost at {int((saving > 0).sum())} of {saving.size} points. The largest saving "
        f"is {float(best):.1f} % ({float(best.speed):g} m/s, steps of {float(best.step_length):g} m), the smallest "
        f"{float(worst):.1f} % ({float(worst.speed):g} m/s, steps of {float(worst.step_length):g} m)."
    )
    solved = int((table.status == "solved").sum())
    yield f"{solved} of {table.status.size} gaits were found, and {int(table.verified.sum())} passed the replay."


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
