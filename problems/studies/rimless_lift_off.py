"""Rimless wheel: normal force over steps with initial rates up to the onset of lift-off.

With unlimited friction the foot lifts off at the end of the step.  With limited friction the foot slips first, which
delays lift-off: a larger initial rate is required, and the foot lifts off when the spoke is upright.
"""

import math

import numpy as np
from drawing import STYLE, draw_by_mode, key_of_modes
from published import CLOSED_FORM
from rimless_closed_forms import fastest_speed
from rimless_setup import INERTIA_RATIO, RATE, SLOPE, SPOKES, walk, wheel

from gaitopt import Mode, SettlingCriterion, rimless_wheel
from gaitopt.study import PublishedValue, Reproduction, locate_basin_edges


def study(frictions=(math.inf, 1.0, 0.3), slower=(0.8, 0.9), samples=4, tolerance=1e-9):
    """Return the study; `slower` are fractions of the rate at the onset, for further curves."""
    onsets = [_onset(friction, samples, tolerance) for friction in frictions]
    slope = math.radians(SLOPE)
    exact = fastest_speed(SPOKES, INERTIA_RATIO, slope)
    numbers = (
        PublishedValue(
            "initial theta_rate at the onset of lift-off, unlimited friction, closed form",
            onsets[0],
            exact,
            1e-8,
            CLOSED_FORM,
            "rad/tau_c",
        ),
    )
    with STYLE.figure(3.3) as figure:
        panels = figure.subplots(1, len(frictions), sharex=True, sharey=True)
        for axes, friction, onset in zip(panels, frictions, onsets, strict=True):
            for fraction in (*slower, 1 - 1e-6):
                _draw(axes, walk(fraction * onset, friction).motion, rf"{fraction * onset:.3f}")
            axes.axhline(0, **STYLE.limit_line)
            axes.set_title("unlimited friction" if math.isinf(friction) else rf"$\mu$ = {friction:g}")
            axes.set_xlabel(r"angle $\theta$ [deg]")
        panels[0].set(ylabel="normal force $f_n/(m\\,g)$", ylim=(-0.03, 0.62), xticks=[-18, -9, 0, 9, 18])
        panels[0].text(-17, 0.03, f"numbers: initial rate\n[{RATE}]", color="0.3")
        key_of_modes(figure, tuple(Mode.slipping(sign) for sign in (1, -1)))
    return Reproduction(figure, numbers)


def _onset(friction, samples, tolerance):
    """Return the initial rate above which the foot lifts off in the first step."""
    rates = {"theta_rate": np.linspace(0.8, 1.3, samples)}
    edges = locate_basin_edges(
        rimless_wheel(), wheel(friction), rates, tolerance=tolerance, criterion=SettlingCriterion(steps=1)
    )
    return next(value for value, _, above in edges if above == "lift_off")


def _draw(axes, motion, label):
    """Plot the normal force over the angle, labelled with the initial rate."""
    weight = motion.total_mass * motion.parameters["gravity"]
    angle = [np.rad2deg(segment.q[2]) for segment in motion.segments]
    force = [segment.force[1] / weight for segment in motion.segments]
    draw_by_mode(axes, angle, force, [segment.mode for segment in motion.segments])
    axes.annotate(label, (angle[0][0], force[0][0]), (0, 8), textcoords="offset points", color="0.3")


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
