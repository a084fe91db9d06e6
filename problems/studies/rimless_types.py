"""Rimless wheel: regions of its gait types A to D in the plane of slope and friction.

The borders are special points of branches over friction at three slopes, followed over the slope.  In complete slip
the wheel rotates as on another slope with scaled gravity, so that the limits of Type D do not depend on the slope.
Type A does not slip, so that its least slope does not depend on friction: it is followed from a branch over the slope.
A border consists of curves between points of codimension two, at which the contact sequence before the special point
changes. Each end of a curve is at the end of the range or at the special point of another kind that it meets.
"""

import itertools
import math
from dataclasses import replace

import numpy as np
from drawing import GAIT_STYLE, STYLE
from published import CLOSED_FORM
from rimless_closed_forms import least_friction, slope_range
from rimless_setup import INERTIA_RATIO, SPOKES, wheel

from gaitopt import WalkProblem, rimless_wheel, trace
from gaitopt.continuation import trace_curve
from gaitopt.study import PublishedValue, Reproduction

BORDERS = {
    "A and B": (("slip_onset",), GAIT_STYLE["B"]["color"]),
    "B and C": (("impact_cone",), GAIT_STYLE["C"]["color"]),
    "C and D": (("loss_of_stick", "event_coincidence"), GAIT_STYLE["D+"]["color"]),
    "D, lifts off": (("lift_off",), "0.45"),
    "D, does not roll over": (("roll_over",), "0.2"),
    "A, does not roll over": (("roll_over",), GAIT_STYLE["A"]["color"]),
}
"""Kinds of special points and colour of each border."""
ADJACENT = "adjacent curve"

STARTS = ((13.0, tuple(BORDERS)[:-1]), (8.0, ("C and D",)), (6.0, ("B and C", "C and D")))
ROLLING = 3.0
"""Slope from which Type A is followed to its least slope [deg]."""


def study(
    slopes=STARTS,  # slopes of the branches over friction [deg], with the borders that are followed from there
    least=1.2,
    most=15.0,  # range of the slope [deg]
    frictions=(1.0, 0.05),  # range of friction of the branches
):
    """Return the study."""
    ends = {"slope": (math.radians(least), math.radians(most))}
    curves = [(name, curve) for slope, names in slopes for name, curve in _trace_borders(slope, names, ends, frictions)]
    if least < ROLLING:
        curves.append(("A, does not roll over", _trace_least_slope(ends, frictions)))
    with STYLE.figure(4.2) as figure:
        axes = figure.subplots()
        for name, curve in curves:
            label = f"Type {name}"
            old = label in axes.get_legend_handles_labels()[1]
            friction, slope = curve.values.T
            axes.plot(np.degrees(slope), friction, color=BORDERS[name][1], label=None if old else label)
        _label(axes, (least, most), frictions)
    return Reproduction(figure, tuple(_numbers(curves)), tuple(_remarks(curves)))


def _trace_borders(slope, names, ends, frictions):
    """Yield the name and the curve of each border that the branches at a slope cross."""
    problem = WalkProblem(robot=rimless_wheel(), parameters=wheel(frictions[0], slope))
    diagram = trace(problem, {"friction": frictions})
    for name in names:
        for number, branch in enumerate(diagram.branches[:2]):
            places = [place for place, point in enumerate(branch.special) if point.kind.key in BORDERS[name][0]]
            places = places[:1] if name == "A and B" else places[-1:]
            for place in places:
                yield name, trace_curve(problem, diagram, ends, branch=number, special=place)


def _trace_least_slope(ends, frictions):
    """Return the curve of the least slope of Type A, with friction as its first parameter."""
    problem = WalkProblem(robot=rimless_wheel(), parameters=wheel(frictions[0], ROLLING))
    diagram = trace(problem, {"slope": (math.radians(ROLLING), ends["slope"][0])})
    (special,) = (place for place, point in enumerate(diagram.branches[0].special) if point.kind.key == "roll_over")
    curve = trace_curve(problem, diagram, {"friction": frictions}, special=special)
    return replace(curve, values=curve.values[:, ::-1], parameters=curve.parameters[::-1], units=curve.units[::-1])


def _label(axes, limits, frictions):
    """Label axes and regions."""
    for text, place in {"A": (5, 0.5), "B": (12.9, 0.45), "C": (7.5, 0.18), "D": (12, 0.15)}.items():
        if limits[0] < place[0] < limits[1]:
            axes.text(*place, text, ha="center", va="center", fontsize=11)
    axes.set(xlabel=r"slope $\alpha$ [deg]", ylabel=r"friction $\mu$", xlim=limits, ylim=(0, frictions[0]))
    axes.legend(loc="upper center")


def _numbers(curves):
    """Yield the differences of borders from closed forms, and the distances between the curves of a border."""
    for name in ("B and C", "C and D"):
        parts = sorted(
            (curve.values[np.argsort(curve.values[:, 1])] for other, curve in curves if other == name), key=_least_slope
        )
        for left, right in itertools.pairwise(parts):
            place = f"{np.degrees(right[0, 1]):.4f} deg"
            yield PublishedValue(
                f"Types {name}: distance of adjacent curves at {place}",
                np.max(np.abs(right[0] - left[-1])),
                0.0,
                1e-9,
                ADJACENT,
            )
    for name, curve in curves:
        friction, slope = curve.values.T
        middle = f"{np.degrees(slope.min()):.1f} to {np.degrees(slope.max()):.1f} deg"
        if name == "C and D":
            error = np.max(np.abs(friction - np.tan(slope)))
            yield PublishedValue(f"Types {name}, {middle}: mu - tan(alpha)", error, 0.0, 1e-9, CLOSED_FORM)
        elif name == "D, lifts off":
            yield PublishedValue(f"Type {name}, {middle}: range of mu", np.ptp(friction), 0.0, 1e-9, CLOSED_FORM)
        elif name == "D, does not roll over":
            error = np.max(np.abs(friction - least_friction(SPOKES, INERTIA_RATIO)))
            yield PublishedValue(f"Type {name}, {middle}: mu - closed form", error, 0.0, 1e-9, CLOSED_FORM)
        elif name == "A, does not roll over":
            error = np.max(np.abs(slope - slope_range(SPOKES, INERTIA_RATIO)[0]))
            frictions = f"mu = {friction.min():.2f} to {friction.max():.2f}"
            yield PublishedValue(f"Type {name}, {frictions}: alpha - closed form", error, 0.0, 1e-9, CLOSED_FORM, "rad")


def _least_slope(values):
    """Return the least slope of a border."""
    return values[0, 1]


def _remarks(curves):
    """Yield how each border ends."""
    for name, curve in curves:
        (first, low), (last, high) = curve.values[[0, -1]]
        begin, end = _describe_end(curve.begin), _describe_end(curve.end)
        yield (
            f"Border '{name}': from mu = {first:.4f}, alpha = {np.degrees(low):.4f} deg ({begin}) to "
            f"mu = {last:.4f}, alpha = {np.degrees(high):.4f} deg ({end})."
        )


def _describe_end(end):
    """Return the end of a border in words."""
    return "end of the range" if end == "range_end" else end


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
