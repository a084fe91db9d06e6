"""Rimless wheel: normal force over a step that starts just fast enough to lift the foot off.

Without a limit of friction the foot is lifted at the end of the step; slip relieves it, so that with friction 0.3 a
faster start is needed.
"""

import math

import numpy as np
from drawing import draw_by_mode, figure_of, key_of_modes
from published import OWN
from rimless_closed_forms import fastest_speed, least_normal_force
from rimless_setup import INERTIA_RATIO, RATE, SLOPE, SPOKES, walk, wheel

from gaitopt import Mode, Number, Study, basin_edges, rimless_wheel
from gaitopt.plot.style import LIMIT


def study(frictions=(math.inf, 1.0, 0.3), slower=0.9, samples=4, tolerance=1e-9):
    """Return the study; `slower` is the share of the onset's speed of the thin lines."""
    with figure_of(3.2) as figure:
        panels = figure.subplots(1, len(frictions), sharey=True)
        onsets = [_onset(friction, samples, tolerance) for friction in frictions]
        for axes, friction, onset in zip(panels, frictions, onsets, strict=True):
            for rate in (slower * onset, onset):
                _draw(axes, friction, rate)
            axes.axhline(0, **LIMIT)
            axes.set_title(_name(friction))
            axes.set(xlabel=r"angle $\theta$ [deg]", xticks=[-18, -9, 0, 9, 18])
        panels[0].set_ylabel(r"normal force $f_n/(m g)$")
        key_of_modes(figure, (Mode.SLIP_FORWARD,), impact=False)
    slope = math.radians(SLOPE)
    onset = fastest_speed(SPOKES, INERTIA_RATIO, slope)
