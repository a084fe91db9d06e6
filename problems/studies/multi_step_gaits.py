"""Compass biped with motors on level ground: start from rest, a slippery patch, and a gait of period two.

Three steps lead from rest to the periodic gait; five steps cross a patch of low friction, with and without slip on it;
and a gait of period two repeats after two steps of different lengths. Every plan is replayed by the event-driven
simulator.
"""

import numpy as np
from drawing import STYLE, draw_by_mode, key_of_modes

from gaitopt import GaitProblem, InputError, Limits, Mode, WarmStart, compass_biped, solve
from gaitopt.ocp import MultiStepProblem, solve_steps, state_after_touchdown
from gaitopt.simulation import verify_steps
from gaitopt.study import PublishedValue, Reproduction

REST = {"th1_rate": 0.0, "th2_rate": 0.0}
CONE = "#DCE6C8"
IMPULSE = {"marker": "D", "color": "black", "markersize": 4, "linestyle": "none"}
ON_PATCH = {"stick on the patch": "stick | stick", "slip on the patch": "slip+ stick | slip+"}


def study(friction=0.2, patch=0.08, torque_limit=20.0):  # [N m]
    """Return the study."""
    step = GaitProblem(
        robot=compass_biped(),
        sequence="stick | stick",
        friction=friction,
        speed=0.6,
        step_length=0.45,
        limits=Limits(torque=torque_limit, longest_step=3),
        objective="torque_squared",
    )
    periodic = solve(step)
    state = state_after_touchdown(periodic)
    free = step.replace(speed=None, step_length=None, guess=WarmStart(periodic))
    plans = {
        "twice the same step": MultiStepProblem(steps=(step, step)),
        "period two": MultiStepProblem(steps=(step, step.replace(step_length=0.5))),
        "start from rest": MultiStepProblem(steps=(free,) * 3, start=REST, end=state),
    }
    for name, sequence in ON_PATCH.items():
        slippery = free.replace(friction=patch, sequence=sequence)
        plans[name] = MultiStepProblem(steps=(free, free, slippery, free, free), start=state, end=state)
    gaits = {name: _solve(name, problem) for name, problem in plans.items()}
    same = PublishedValue(
        "torque squared of two equal steps over that of one",
        gaits["twice the same step"].objective / periodic.solver.objective,
        2.0,
        1e-6,
        "the periodic gait",
    )
    remarks = [_remark(name, gait) for name, gait in gaits.items()]
    return Reproduction(_figure(gaits, friction, patch), (same,), tuple(remarks))


def _solve(name, problem):
    gait = verify_steps(solve_steps(problem))
    if not gait.status.ok:
        raise InputError(f"The gait '{name}' is not solved: {gait.status.hint}")
    return gait


def _remark(name, gait):
    lengths = ", ".join(f"{plan.travel:.3f}" for plan in gait.plans)
    error = gait.verification.state_error
    return f"{name}: steps of {lengths} m, torque squared {gait.objective:.4g} N^2 m^2 s, replayed within {error:.0e}."


def _figure(gaits, friction, patch):
    with STYLE.figure(4.6) as figure:
        first, *others = figure.subplots(3, 1)
        for number, color in enumerate(("#0072B2", "#D55E00")):
            parts = [
                (segment.time, np.degrees(segment.q[2 + number]))
                for segment in gaits["start from rest"].motion.segments
            ]
            for piece, (time, angle) in enumerate(parts):
                axes_label = rf"$\theta_{number + 1}$" if piece == 0 else None
                first.plot(time, angle, color=color, linestyle=("-", "--")[number], label=axes_label)
        first.set(xlabel="time [s]", ylabel="angle [deg]", title="start from rest")
        first.legend(loc="upper left")
        for axes, name in zip(others, ON_PATCH, strict=True):
            _draw_patch(axes, gaits[name], name, friction, patch)
        cone = {"color": CONE, "linewidth": 6, "label": "friction cone"}
        key_of_modes(figure, (Mode.SLIP_FORWARD,), {**IMPULSE, "label": "touchdown impulse"}, cone)
    return figure


def _draw_patch(axes, gait, name, friction, patch):
    """Draw the force ratio with the friction of each step, and the impulse ratio of each touchdown."""
    motion = gait.motion
    for number in range(len(gait.plans)):
        segments = [segment for segment in motion.segments if segment.step == number]
        limit = patch if number == 2 else friction
        start, end = segments[0].time[0], segments[-1].time[-1]
        axes.fill_between([start, end], -limit, limit, color=CONE)
        for segment in segments:
            draw_by_mode(axes, [segment.time], [segment.force[0] / segment.force[1]], [segment.mode])
    for jump in motion.jumps:
        axes.plot(jump.time, jump.impulse[0] / jump.impulse[1], **IMPULSE)
    axes.margins(y=0.08)
    axes.set(xlabel="time [s]", ylabel=r"ratio $f_t/f_n$", title=name)


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
