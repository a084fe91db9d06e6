"""Compass biped of Goswami et al.: cascade of period doublings over the slope.

Each branch of doubled period is followed up to its own period doubling.  The ratios of the distances between successive
doublings tend to Feigenbaum's constant, 4.669.
"""

import math

from drawing import STYLE
from published import OWN, check_value

from gaitopt import WalkProblem, compass_biped, plot_branches, trace
from gaitopt.continuation import TraceOptions
from gaitopt.study import PublishedValue, Reproduction

BIPED = {"leg_mass": 5, "hip_mass": 10, "leg_length": 1, "leg_com": 0.5, "gravity": 9.81, "friction": math.inf}


def study(least=3.0, most=5.2, doublings=4):  # range of the slope [deg]; branches of doubled period
    """Return the study."""
    problem = WalkProblem(robot=compass_biped(), parameters=BIPED)
    ends = {"slope": (math.radians(least), math.radians(most))}
    diagram = trace(problem, ends, options=TraceOptions(doublings=doublings))
    slopes = [math.degrees(branch.special_of("period_doubling")[0].value) for branch in diagram.branches]
    numbers = [check_value("first period doubling", slopes[0], "4.390898", "deg", OWN)]
    if len(diagram.ratios) > 2:
        numbers.append(PublishedValue("last ratio", diagram.ratios[-1], 4.669, 0.01, "Feigenbaum 1978"))
    remarks = [
        f"The gait of {branch.steps} step{'s' * (branch.steps > 1)} doubles its period at {slope:.8f} deg."
        for branch, slope in zip(diagram.branches, slopes, strict=True)
    ]
    ratios = ", ".join(f"{ratio:.4f}" for ratio in diagram.ratios)
    return Reproduction(
        plot_branches(diagram, style=STYLE), tuple(numbers), (*remarks, *([f"Ratios: {ratios}."] * bool(ratios)))
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
