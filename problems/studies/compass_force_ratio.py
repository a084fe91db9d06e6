"""Compass biped: ratio of tangential to normal contact force over a step of Gaits A, B and C.

The friction demand of Gait A is largest immediately after touchdown; at lower friction the foot slips and the gait
becomes Gait B.
"""

import math

from compass_setup import FRICTION, SEQUENCES, gait, walk
from drawing import STYLE, draw_by_mode, key_of_modes
from published import check_value

from gaitopt import Mode
from gaitopt.study import PublishedValue, Reproduction


def study(friction=FRICTION, starts=40):
    """Return the study; `friction` applies to Gaits B and C; Gait A never slips."""
    cycles = {name: gait(name, math.inf if name == "A" else friction, starts) for name in SEQUENCES}
    need = cycles["A"].critical_friction
    with STYLE.figure(3.3) as figure:
        panels = figure.subplots(1, len(cycles), sharex=True, sharey=True)
        for axes, (name, cycle) in zip(panels, cycles.items(), strict=True):
            _draw(axes, walk(cycle), need.friction if name == "A" else friction)
            axes.set(title=f"Gait {name}", xlabel="time [s]")
        panels[0].set(ylabel="force ratio $f_t/f_n$", ylim=(-0.21, 0.21))
        key_of_modes(figure, (Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD), IMPULSE)
    numbers = (
        check_value("Gait A: critical friction", need.friction, "0.17492"),
        PublishedValue(
            "Gait A: time of the critical friction", need.time, 0.0, 1e-9, "Gamus & Or 2015: just after the impact", "s"
        ),
        check_value("Gait A: impulse ratio at touchdown", cycles["A"].impact_ratio, "-0.14467"),
    )
    return Reproduction(figure, numbers)


IMPULSE = {
    "color": "black",
    "marker": "D",
    "markersize": 5,
    "linestyle": "none",
    "label": "touchdown impulse $\\Lambda_t/\\Lambda_n$",
}


def _draw(axes, motion, cone):
    """Draw the force ratio over time, the impulse ratio at touchdown, and the friction cone."""
    time = [segment.time for segment in motion.segments]
    ratio = [segment.force[0] / segment.force[1] for segment in motion.segments]
    draw_by_mode(axes, time, ratio, [segment.mode for segment in motion.segments])
    for side in (1, -1):
        axes.axhline(side * cone, **STYLE.limit_line)
    above = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points"}
    axes.annotate(rf"$\mu$ = {cone:.5g}", (0.03, cone), (0, 3), **above)
    for jump in motion.jumps:
        axes.plot([jump.time], [jump.ratio], zorder=5, **IMPULSE)


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
