"""Rimless wheel: phase portraits of its gaits, from no slip (Type A) to complete slip (Type D)."""

import math

import numpy as np
from drawing import JUMP_LINE, STYLE, draw_by_mode, draw_jump, format_sequence, key_of_modes
from published import CLOSED_FORM, check_value, energy_balance
from rimless_setup import HALF, RATE, SPEED, gait, speed_of, walk

from gaitopt import Mode
from gaitopt.study import PublishedValue, Reproduction

FRICTION = {"A": 1.0, "B": 0.3, "C": 0.24, "D": 0.3}
"""Friction coefficient at which each type is shown."""


def study(foot_speed=0.3, steps=3):  # of Type D: initial value [l/tau_c], number of plotted steps
    """Return the study."""
    cycles = {kind: gait(kind, friction) for kind, friction in FRICTION.items()}
    numbers = (
        check_value("Type B, mu = 0.3: theta_rate after impact", speed_of(cycles["B"]), "0.88075", "rad/tau_c"),
        check_value("Type B, mu = 0.3: multiplier", cycles["B"].radius, "0.7623"),
        check_value("Type D, mu = 0.3: theta_rate after impact", speed_of(cycles["D"]), "1.07204", "rad/tau_c"),
        check_value("Type D, mu = 0.3: multiplier", cycles["D"].radius, "0.356"),
        check_value("Type D, mu = 0.3: change of foot speed per step", cycles["D"].drift, "-0.0517", "l/tau_c"),
        _drift(cycles["D"]),
        *(energy_balance(f"Type {kind}", cycles[kind], 1.0) for kind in "ABC"),
    )
    with STYLE.figure(4.6) as figure:
        rows = figure.subplots(2, len(cycles), sharex=True)
        for column, (kind, cycle) in zip(rows.T, cycles.items(), strict=True):
            start = foot_speed if kind == "D" else cycle.state.get("foot_speed", 0.0)
            motion = walk(speed_of(cycle), FRICTION[kind], start, steps if kind == "D" else 1).motion
            _draw_portrait(column[0], motion, 2, "q_next")
            _draw_portrait(column[1], motion, 0, "q_next")
            column[0].set_title(f"Type {kind}, $\\mu$ = {FRICTION[kind]:g}\n{format_sequence(cycle.sequence)}")
            column[1].set_xlabel(r"angle $\theta$ [deg]")
            column[1].set_xticks([-18, 0, 18])
        for axes in rows[0]:
            axes.set_ylim(0.83, 1.16)
            axes.tick_params(labelleft=axes is rows[0, 0])
        rows[0, 0].set_ylabel(rf"rate $\dot\theta$ [{RATE}]")
        rows[1, 0].set_ylabel(rf"foot speed $\dot x$ [{SPEED}]")
        rows[1, 0].set_ylim(-0.1, 0.1)
        key_of_modes(figure, (Mode.SLIP_FORWARD,), JUMP_LINE)
    return Reproduction(figure, numbers)


def _drift(cycle):
    """Return the change of the foot speed in complete slip, with its closed form as the reference."""
    p = cycle.parameters
    exact = p["gravity"] * cycle.period * (math.sin(p["slope"]) - p["friction"] * math.cos(p["slope"]))
    name = "Type D, mu = 0.3: change of foot speed, g T (sin alpha - mu cos alpha)"
    return PublishedValue(name, cycle.drift, exact, 1e-10, CLOSED_FORM, "l/tau_c")


def _draw_portrait(axes, motion, row, following):
    """Plot a rate over the angle of the spoke, with the jumps at touchdown."""
    angle = [np.rad2deg(segment.q[2]) for segment in motion.segments]
    draw_by_mode(axes, angle, [segment.v[row] for segment in motion.segments], [s.mode for s in motion.segments])
    for jump in motion.jumps:
        degrees = math.degrees(HALF)
        draw_jump(axes, (degrees, jump.v_minus[row]), (-degrees, jump.v_next[row]))


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
