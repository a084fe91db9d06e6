"""Compass biped: phase portraits of a leg in Gaits A, B and C, and the speed of the stance foot.

At positive angles the leg leans forward.  It is the stance leg while the angle increases and the swing leg while it
decreases; at touchdown its rate jumps.
"""

import math

import numpy as np
from compass_setup import FRICTION, SEQUENCES, gait, walk
from drawing import JUMP_LINE, STYLE, draw_by_mode, draw_jump, format_sequence, key_of_modes
from published import check_value, energy_balance

from gaitopt import Mode
from gaitopt.study import Reproduction

PRINTED = {
    "A": {
        "th1": "-0.147836890",
        "th1_rate": "0.732796791",
        "th2_rate": "-0.500667882",
        "period": "0.744620868",
        "step length": "0.471356685",
    },
    "B": {"th1": "-0.140807105", "th1_rate": "0.710208797", "th2_rate": "-0.516847656", "period": "0.751962"},
    "C": {
        "th1": "-0.079038",
        "th1_rate": "0.043777",
        "th2_rate": "-0.431761",
        "foot_speed": "0.634174",
        "period": "0.635815",
    },
}
UNITS = {"th1": "rad", "th1_rate": "rad/s", "th2_rate": "rad/s", "foot_speed": "m/s", "period": "s", "step length": "m"}
SWING = {"color": "0.6", "linewidth": 1.0, "label": "swing"}


def study(friction=FRICTION, starts=40):
    """Return the study; `friction` applies to Gaits B and C; Gait A never slips."""
    cycles = {name: gait(name, math.inf if name == "A" else friction, starts) for name in SEQUENCES}
    with STYLE.figure(4.8) as figure:
        rows = figure.subplots(2, len(cycles), sharex="row")
        for column, (name, cycle) in zip(rows.T, cycles.items(), strict=True):
            motion = walk(cycle)
            _draw_leg(column[0], motion)
            _draw_foot_speed(column[1], motion)
            place = "unlimited friction" if name == "A" else rf"$\mu$ = {friction:g}"
            column[0].set_title(f"Gait {name}, {place}\n{format_sequence(cycle.sequence)}")
            column[0].set(xlabel="angle of a leg [deg]", ylim=(-1.25, 1.15))
            column[0].tick_params(labelleft=name == "A")
            column[1].set_xlabel("time [s]")
        rows[0, 0].set_ylabel("rate of a leg [rad/s]")
        rows[1, 0].set(ylabel=r"foot speed $\dot x$ [m/s]", ylim=(-0.1, 0.1))
        key_of_modes(figure, (Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD), SWING, {**JUMP_LINE, "label": "touchdown"})
    return Reproduction(figure, _numbers(cycles))


def _draw_leg(axes, motion):
    """Plot the orbit of a leg: stance by contact mode, then swing, with the jumps at touchdown between them."""
    modes = [segment.mode for segment in motion.segments]
    stance = [(np.rad2deg(segment.q[2]), segment.v[2]) for segment in motion.segments]
    angle, rate = -np.rad2deg(motion.channel("q")[3]), -motion.channel("v")[3]
    axes.plot(angle, rate, **SWING)
    draw_by_mode(axes, *zip(*stance, strict=True), modes)
    first = stance[0]
    draw_jump(axes, (stance[-1][0][-1], stance[-1][1][-1]), (angle[0], rate[0]))
    draw_jump(axes, (angle[-1], rate[-1]), (first[0][0], first[1][0]))


def _draw_foot_speed(axes, motion):
    modes = [segment.mode for segment in motion.segments]
    draw_by_mode(axes, [s.time for s in motion.segments], [s.v[0] for s in motion.segments], modes)


def _numbers(cycles):
    """Return state, period and step length of each gait with the published values, and its energy balance."""
    numbers = []
    for name, printed in PRINTED.items():
        cycle = cycles[name]
        values = {**cycle.state, "period": cycle.period, "step length": cycle.travel}
        for quantity, digits in printed.items():
            numbers.append(check_value(f"Gait {name}: {quantity}", values[quantity], digits, UNITS[quantity]))
        mass = 2 * cycle.parameters["leg_mass"] + cycle.parameters["hip_mass"]
        numbers.append(energy_balance(f"Gait {name}", cycle, mass))
    return tuple(numbers)


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
