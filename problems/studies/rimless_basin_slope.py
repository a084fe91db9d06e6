"""Rimless wheel: outcome of walks as a function of initial rate and slope, with unlimited friction.

The lines are closed-form limits: below the lower one the wheel does not roll over, above the upper one the foot lifts
off.
"""

import math

import numpy as np
from basin_map import draw_map
from drawing import STYLE
from published import CLOSED_FORM, check_value
from rimless_closed_forms import fastest_speed, gait_speed, slope_range, slowest_speed
from rimless_setup import INERTIA_RATIO, RATE, SLOPE, SPOKES, wheel

from gaitopt import Execution, SettlingCriterion, basin, rimless_wheel
from gaitopt.study import PublishedValue, Reproduction, locate_basin_edges

SETTLING = SettlingCriterion(steps=150, tolerance=1e-6)


def study(slopes=100, rates=120, greatest_slope=18.0, fastest=1.3, workers=2):  # grid up to [deg], [rad/tau_c]
    """Return the study."""
    degrees, speeds = np.linspace(0.25, greatest_slope, slopes), np.linspace(0.01, fastest, rates)
    starts = {"slope": np.deg2rad(degrees), "theta_rate": speeds}
    outcome = basin(rimless_wheel(), wheel(), starts, criterion=SETTLING, execution=Execution(workers=workers))
    with STYLE.figure(3.8) as figure:
        axes = figure.subplots()
        handles = draw_map(axes, outcome, degrees, speeds)
        handles += _draw_closed_forms(axes, greatest_slope)
        axes.set(xlabel=r"slope $\alpha$ [deg]", ylabel=rf"initial rate $\dot\theta$ [{RATE}]")
        figure.legend(handles=handles, loc="outside right upper")
    exact = slowest_speed(SPOKES, math.radians(SLOPE))
    remark = (
        f"The closed-form lower end of the basin is {exact:.6f}; walks that start less than 1e-5 above it remain near "
        "the upright position for more than 10 tau_c and are counted as failed."
    )
    return Reproduction(figure, _numbers(), (remark,))


def _draw_closed_forms(axes, greatest_slope):
    """Plot the boundaries of the basin and the gait; return their handles."""
    least, most = slope_range(SPOKES, INERTIA_RATIO)
    inside, wide = np.linspace(least, most, 101), np.linspace(0, math.radians(greatest_slope), 101)
    slow = [slowest_speed(SPOKES, slope) for slope in wide]
    fast = [fastest_speed(SPOKES, INERTIA_RATIO, slope) for slope in wide]
    gait = [gait_speed(SPOKES, INERTIA_RATIO, slope) for slope in inside]
    lines = (
        (wide, fast, {"linestyle": (0, (5, 1.5)), "label": "keeps contact below"}),
        (inside, gait, {"linestyle": "-", "linewidth": 1.8, "label": "gait of Type A"}),
        (wide, slow, {"linestyle": (0, (1, 1)), "label": "rolls over above"}),
    )
    return [axes.plot(np.rad2deg(slope), rate, color="black", **style)[0] for slope, rate, style in lines]


def _numbers():
    """Return the ends of the basin on the slope of the study."""
    rates = {"theta_rate": np.linspace(0.03, 1.2, 8)}
    edges = locate_basin_edges(rimless_wheel(), wheel(), rates, tolerance=1e-9, criterion=SETTLING)
    lower, upper = edges[0][0], edges[-1][0]
    place = f"basin of Type A, alpha = {SLOPE:g} deg, unlimited friction"
    exact = fastest_speed(SPOKES, INERTIA_RATIO, math.radians(SLOPE))
    return (
        check_value(f"{place}: lower end", lower, "0.0872", "rad/tau_c"),
        check_value(f"{place}: upper end", upper, "0.9595", "rad/tau_c"),
        PublishedValue(f"{place}: upper end, closed form", upper, exact, 1e-8, CLOSED_FORM, "rad/tau_c"),
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
