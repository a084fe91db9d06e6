"""Compass biped: feedback that stabilises a gait with slipping impact that is unstable in open loop.

Passive Gait C is imitated on level ground at friction 0.14 with at most 5 N m at ankle and hip; feedback may use 6 N m.
The laws are tuned for the smallest spectral radius. A push changes the rate of the stance leg after a touchdown; a
negative push slows the leg down.
"""

import numpy as np
from compass_setup import FRICTION, gait
from drawing import STYLE
from feedback_setup import IMITATED, LABEL, LAW_STYLE, LAWS, OPEN_LOOP, assess_open_loop, plan, tune_law, walker
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from published import check_value

from gaitopt import absolute_work, compass_biped
from gaitopt.simulation.simulator import record_walk
from gaitopt.study import PublishedValue, Reproduction

PUSH, SLIPPERY, PATCH = 0.01, 0.11, (2, 5)
"""A push [rad/s], the friction of a slippery patch, and the steps on it."""

END_MARK = {"marker": "x", "color": "0.1", "markersize": 11}
"""Mark of the end of a walk that does not take all steps."""


def study(laws=LAWS, evaluations=60, starts=200, steps=16, pushes=9, largest=0.04):  # largest push [rad/s]
    """Return the study."""
    tunings = {name: tune_law(IMITATED, name, evaluations, starts) for name in laws}
    closed_loops = {
        OPEN_LOOP: assess_open_loop(IMITATED),
        **{name: (tuning.law, tuning.cycle) for name, tuning in tunings.items()},
    }
    with STYLE.figure(6.4) as figure:
        (circle, cost), (pushed, patch) = figure.subplots(2, 2)
        _draw_multipliers(circle, closed_loops)
        sizes = np.linspace(-largest, largest, pushes)
        work = {name: [_extra_work(*closed_loops[name], size) for size in sizes] for name in tunings}
        _draw_cost(cost, sizes, work)
        ends = [_draw_return(pushed, name, *pair, steps, push=PUSH) for name, pair in closed_loops.items()]
        ends += [_draw_return(patch, name, *pair, steps, patch=True) for name, pair in closed_loops.items()]
        pushed.set(title=f"pushed by {PUSH:g} rad/s", ylabel="largest deviation after touchdown")
        patch.set(title=f"friction {SLIPPERY:g} in the shaded steps")
        patch.axvspan(PATCH[0] + 0.5, PATCH[1] + 0.5, color="0.9", zorder=0)
        for axes in (pushed, patch):
            axes.set(xlabel="step", xlim=(-0.5, steps + 0.5), ylim=(1e-9, 3), yscale="log")
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        handles, labels = circle.get_legend_handles_labels()
        if any(ends):
            handles, labels = [*handles, Line2D([], [], linestyle="none", **END_MARK)], [*labels, "walk ends"]
        figure.legend(handles, labels, loc="outside lower center", ncols=len(handles), columnspacing=1.2)
    return Reproduction(
        figure, _numbers(closed_loops), tuple(_remarks(closed_loops, work, sizes, [end for end in ends if end]))
    )


def _numbers(closed_loops):
    before, *after = (cycle.radius for _, cycle in closed_loops.values())
    return (
        check_value("passive Gait C on its slope: largest multiplier", gait("C", FRICTION).radius, "1.8235"),
        PublishedValue("imitation in open loop: unstable (1 = yes)", float(before > 1), 1.0, 0.0, "claim"),
        PublishedValue("under every law: stable (1 = yes)", float(max(after) < 1), 1.0, 0.0, "claim"),
    )


def _draw_multipliers(axes, closed_loops):
    turn = np.linspace(0, 2 * np.pi, 200)
    axes.fill(np.cos(turn), np.sin(turn), color="0.94", zorder=0)
    axes.plot(np.cos(turn), np.sin(turn), color="0.6", linewidth=0.9)
    for name, (_, cycle) in closed_loops.items():
        style = {"color": LAW_STYLE[name]["color"], "marker": LAW_STYLE[name]["marker"], "linestyle": "none"}
        values = cycle.multipliers
        axes.plot(values.real, values.imag, markerfacecolor="none", markersize=6, label=LABEL.get(name, name), **style)
    axes.set(aspect="equal", adjustable="datalim", xlabel="real part", ylabel="imaginary part", title="multipliers")


def _draw_cost(axes, sizes, work):
    for name, extra in work.items():
        axes.plot(sizes, extra, markersize=4, **LAW_STYLE[name])
    axes.axhline(0, color="0.6", linewidth=0.8)
    axes.set(xlabel="push [rad/s]", ylabel="extra joint work [J]", title="cost of recovery")


def _extra_work(law, cycle, push, steps=10):
    """Return the joint work of some steps after a push minus that of the gait; nan if the walk ends before."""
    state, ground = cycle.section.embed(cycle.z), walker(IMITATED, law)
    undisturbed = absolute_work(record_walk(ground, state, steps).motion)
    state[2 + compass_biped().n_q] += push
    walk = record_walk(ground, state, steps).motion
    return absolute_work(walk) - undisturbed if len(walk.jumps) == steps else np.nan


def _draw_return(axes, name, law, cycle, steps, push=0.0, patch=False):
    """Plot the deviations of a disturbed walk; return a description of its end, or None."""
    state, ended = cycle.section.embed(cycle.z), None
    reference, nominal, slippery = state.copy(), walker(IMITATED, law), walker(IMITATED, law, friction=SLIPPERY)
    state[2 + compass_biped().n_q] += push
    values = [np.max(np.abs(state - reference)[2:])]
    for step in range(1, steps + 1):
        following = (slippery if patch and PATCH[0] < step <= PATCH[1] else nominal).walk_step(state).following
        if following is None:
            place = "of the walk over the patch" if patch else "after the push"
            ended = f"{LABEL.get(name, name)}, in step {step} {place}"
            break
        state = following
        values.append(np.max(np.abs(state - reference)[2:]))
    values = np.maximum(values, 1e-12)
    axes.plot(np.arange(values.size), values, markersize=4, **LAW_STYLE[name])
    if ended is not None:
        axes.plot(values.size - 1, values[-1], zorder=5, clip_on=False, **END_MARK)
    return ended


def _remarks(closed_loops, work, sizes, ends):
    radii = ", ".join(f"{LABEL.get(name, name)} {cycle.radius:.3f}" for name, (_, cycle) in closed_loops.items())
    yield f"Spectral radius: {radii}; cost of transport of the gait {plan(IMITATED).cost_of_transport:.5f}."
    undisturbed = absolute_work(plan(IMITATED).motion)
    least, most = (choose(list(work.values())) / (10 * undisturbed) for choose in (np.nanmin, np.nanmax))
    yield (
        f"On the gait itself feedback has no cost. After pushes of up to {sizes[-1]:g} rad/s in either direction, the "
        f"joint work of ten steps, if they are completed, differs by {100 * least:+.1f} to {100 * most:+.1f} % from "
        "that of ten steps of the gait."
    )
    early = f"A cross marks the last touchdown of a walk that ends early: {'; '.join(ends)}."
    yield early if ends else "No walk ends early."


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
