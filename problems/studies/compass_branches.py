"""Compass biped: passive gaits over friction, with Gaits A, B and C and all special points.

One trace follows Gait A, which becomes Gait B, over the range of friction.  Further gaits at the ends and in the middle
of the range are found by deflation; one of them is the unstable sticking gait that Gait C joins.
"""

import math

from compass_setup import SEQUENCES, biped
from drawing import STYLE
from published import check_value

from gaitopt import WalkProblem, compass_biped, plot_branches, trace
from gaitopt.continuation import TraceOptions
from gaitopt.study import Reproduction


def study(most=0.33, least=0.06, deflate=True):  # range of friction; whether further gaits are searched for
    """Return the study."""
    starts = 100  # fewer miss the gait whose spectral radius is 26
    problem = WalkProblem(robot=compass_biped(), parameters=biped(most))
    diagram = trace(problem, {"friction": (most, least)}, options=TraceOptions(deflate=deflate, starts=starts))
    figure = plot_branches(diagram, coordinate="th1_rate", style=STYLE)
    return Reproduction(figure, tuple(_numbers(diagram.branches)), tuple(_remarks(diagram.branches)))


def _numbers(branches):
    """Yield the friction coefficients of the special points of Gaits A and B, and of the start of Gait C."""
    first, *others = branches
    names = ("Gait B appears", "Gait B changes its contact sequence")
    for name, printed, point in zip(names, ("0.17492", "0.1731"), first.special_of("slip_onset"), strict=True):
        yield check_value(name, point.value, printed)
    for point in first.special_of("neimark_sacker"):
        yield check_value("Gait B loses its stability", point.value, "0.1103")
    for point in first.special_of("impact_cone"):
        yield check_value("Gait B ends", point.value, "0.0698")
    for branch in others:
        for point in branch.special_of("impact_cone"):
            if {point.before, point.after} == {SEQUENCES["A"], SEQUENCES["C"]}:
                yield check_value("Gait C joins the second sticking gait", point.value, "0.3044")


def _remarks(branches):
    """Yield the contact sequences and the multipliers on both sides of each special point."""
    for branch in branches:
        for point in branch.special:
            radii = [max(abs(sides), default=math.nan) for sides in (point.multipliers_before, point.multipliers_after)]
            if len(point.multipliers_after):
                gaits = f"`{point.before}` before and `{point.after}` beyond, "
                gaits += f"with spectral radii of {radii[0]:.4f} and {radii[1]:.4f}"
            else:
                gaits = f"`{point.before}` before, with a spectral radius of {radii[0]:.4f}; {point.after}"
            yield f"{point.kind.label} at mu = {point.value:.10f}, located within {point.width:.0e}: {gaits}."


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
