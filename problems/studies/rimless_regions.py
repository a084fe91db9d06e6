"""Rimless wheel: inertia ratios and slopes for which the gait without slip (Type A) exists, for 4 to 8 and 10 spokes.

Below a region the wheel does not roll over; above it the foot lifts off.  The regions are closed-form results; the
markers are simulations just inside and outside of them.
"""

import math

import numpy as np
from drawing import STYLE
from published import check_value
from rimless_closed_forms import gait_speed, slope_range
from rimless_setup import INERTIA_RATIO, SPOKES, walk

from gaitopt import Stop
from gaitopt.study import Reproduction

MARKS = {
    Stop.STEPS_DONE: ("walks", "o", "#0072B2"),
    Stop.FELL: ("does not roll over", "v", "#D55E00"),
    Stop.LIFT_OFF: ("lifts off", "^", "#009E73"),
}


def study(
    spokes=(4, 5, 6, 7, 8, SPOKES),
    points=101,  # inertia ratios per region
    checked=(0.15, 0.5, 0.85),  # inertia ratios at which walks are simulated
    beside=1.0,  # distance of the simulated slopes from the limits of a region [deg]
    steps=3,
):
    """Return the study."""
    ratios = np.linspace(0, 1, points)
    with STYLE.figure(5.4) as figure:
        grid = figure.subplots(2, -(-len(spokes) // 2), sharex=True, sharey=True, squeeze=False)
        wrong = []
        for axes, n in zip(grid.flat, spokes, strict=False):
            _draw_region(axes, n, ratios)
            wrong += _draw_checks(axes, n, checked, beside, steps)
            axes.set_title(rf"$n$ = {n} spokes")
        for axes in grid[-1]:
            axes.set_xlabel(r"inertia ratio $\kappa = I_c/(m\,l^2)$")
        for axes in grid[:, 0]:
            axes.set_ylabel(r"slope $\alpha$ [deg]")
        grid[0, 0].set(xlim=(0, 1), ylim=(0, None))
        handles = dict(zip(*reversed(grid[0, 0].get_legend_handles_labels()), strict=True))
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=len(handles))
    lower, upper = np.rad2deg(slope_range(SPOKES, INERTIA_RATIO))
    place = f"n = {SPOKES}, kappa = 1/3"
    numbers = (
        check_value(f"least slope of Type A, {place} (rolls over)", lower, "1.40", "deg"),
        check_value(f"greatest slope of Type A, {place} (keeps contact)", upper, "14.71", "deg"),
    )
    return Reproduction(figure, numbers, tuple(wrong))


def _draw_region(axes, n, ratios):
    """Draw the region between rolling over and lifting off, for n spokes."""
    limits = []
    for ratio in ratios:
        if math.cos(2 * math.pi / n) + ratio > 1e-9:
            limits.append((ratio, *np.rad2deg(slope_range(n, ratio))))
    kappa, lower, upper = np.array(limits).T
    axes.fill_between(kappa, lower, upper, where=upper >= lower, color="#0072B2", alpha=0.15, linewidth=0)
    exists = upper >= lower
    axes.plot(kappa[exists], lower[exists], color="#D55E00", linestyle=(0, (5, 1.5)), label="rolls over above")
    axes.plot(kappa[exists], upper[exists], color="#009E73", label="keeps contact below")


def _draw_checks(axes, n, ratios, beside, steps):
    """Mark the outcomes of simulated walks just inside and outside; return contradictions to the closed forms."""
    wrong = []
    for ratio in ratios:
        lower, upper = np.rad2deg(slope_range(n, ratio))
        if upper - lower < 2 * beside:
            continue
        expected = {
            lower - beside: Stop.FELL,
            lower + beside: Stop.STEPS_DONE,
            upper - beside: Stop.STEPS_DONE,
            upper + beside: Stop.LIFT_OFF,
        }
        for slope, stop in expected.items():
            if slope <= 0:
                continue
            rate = gait_speed(n, ratio, math.radians(slope))
            outcome = walk(rate, slope=slope, spokes=n, inertia_ratio=ratio, steps=steps).stop
            label, marker, color = MARKS.get(outcome, (outcome.key, "x", "black"))
            axes.plot(
                [ratio], [slope], marker, color=color, markersize=4.5, linestyle="none", label=label, clip_on=False
            )
            if outcome is not stop:
                wrong.append(
                    f"n = {n}, kappa = {ratio:g}, {slope:.2f} deg: expected {stop.key}, simulated {outcome.key}."
                )
    return wrong


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
