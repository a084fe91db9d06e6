"""Rimless wheel: outcome of walks with the foot initially at rest, as a function of initial rate and friction.

Slip delays lift-off: the basin extends beyond the dashed line, at which a foot that never slips would lift off.
"""

import math

import numpy as np
from basin_map import draw_map
from drawing import STYLE
from published import check_value
from rimless_closed_forms import fastest_speed, slowest_speed
from rimless_setup import INERTIA_RATIO, RATE, SLOPE, SPOKES, wheel

from gaitopt import Execution, SettlingCriterion, basin, rimless_wheel
from gaitopt.study import Reproduction, locate_basin_edges

SETTLING = SettlingCriterion(steps=150, tolerance=1e-6)


def study(frictions=100, rates=120, least=0.02, most=1.1, fastest=1.3, workers=2):  # grid of frictions and rates
    """Return the study."""
    across, speeds = np.linspace(least, most, frictions), np.linspace(0.01, fastest, rates)
    starts = {"friction": across, "theta_rate": speeds}
    outcome = basin(rimless_wheel(), wheel(), starts, criterion=SETTLING, execution=Execution(workers=workers))
    slope = math.radians(SLOPE)
    with STYLE.figure(3.8) as figure:
        axes = figure.subplots()
        handles = draw_map(axes, outcome, across, speeds)
        limits = {
            "keeps contact below, without slip": (fastest_speed(SPOKES, INERTIA_RATIO, slope), (0, (5, 1.5))),
            "rolls over above, without slip": (slowest_speed(SPOKES, slope), (0, (1, 1))),
        }
        for name, (rate, dashes) in limits.items():
            handles.append(axes.axhline(rate, color="black", linestyle=dashes, label=name))
        axes.set(xlabel=r"friction $\mu$", ylabel=rf"initial rate $\dot\theta$ [{RATE}]")
        figure.legend(handles=handles, loc="outside right upper")
    numbers = tuple(
        check_value(f"basin of Type {kind}, mu = {friction:g}: upper end", _upper_end(friction), printed, "rad/tau_c")
        for kind, friction, printed in (("B", 0.3, "1.142"), ("A", 1.0, "1.137"))
    )
    return Reproduction(figure, numbers)


def _upper_end(friction):
    """Return the initial rate above which the foot lifts off."""
    rates = {"theta_rate": [0.8, 1.0, 1.2]}
    edges = locate_basin_edges(rimless_wheel(), wheel(friction), rates, tolerance=1e-6, criterion=SETTLING)
    return next(value for value, _, above in edges if above == "lift_off")


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
