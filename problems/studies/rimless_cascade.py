"""Rimless wheel: transition from complete slip (Type D) to stick-slip (Type B), step by step.

In complete slip the rate of theta converges quickly, whereas the foot speed decreases by the same amount in each step;
when the foot comes to rest, the type of the gait changes.
"""

import numpy as np
from drawing import STYLE, format_sequence
from published import check_value
from rimless_setup import RATE, SPEED, gait, speed_of, walk

from gaitopt.study import PublishedValue, Reproduction

MARKS = (("o", "#AA4499"), ("X", "0.2"), ("s", "#D55E00"), ("^", "#009E73"))


def study(rate=1.12, foot_speed=0.7, friction=0.3, steps=45):  # initial: [rad/tau_c], [l/tau_c]
    """Return the study."""
    motion = walk(rate, friction, foot_speed, steps).motion
    after = np.array([jump.v_next for jump in motion.jumps])  # per step: foot speed, 0, rate
    sequences = [format_sequence(motion.sequence(step)) for step in range(len(after))]
    before, final = gait("D", friction), gait("B", friction)
    with STYLE.figure(4.8) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True)
        _draw(upper, after[:, 2], sequences)
        _draw(lower, after[:, 0], sequences)
        for cycle, kind in ((before, "D"), (final, "B")):
            upper.axhline(speed_of(cycle), **STYLE.limit_line)
            upper.annotate(
                f"Type {kind}", (len(after), speed_of(cycle)), (0, 5), textcoords="offset points", ha="right"
            )
        upper.set(ylabel=rf"rate after impact $\dot\theta$ [{RATE}]", ylim=(0.86, 1.11))
        lower.set(ylabel=rf"foot speed after impact $\dot x$ [{SPEED}]", xlabel="step")
        figure.legend(*lower.get_legend_handles_labels(), loc="outside upper center", ncols=4, handlelength=1)
    rest = 1 + int(np.argmax(after[:, 0] <= 0))
    source = "its periodic gait, computed by gaitopt"
    numbers = (
        check_value("step in which the foot speed reaches zero", rest, "15"),
        PublishedValue(
            "theta_rate after the last step, Type B", after[-1, 2], speed_of(final), 1e-3, source, "rad/tau_c"
        ),
    )
    return Reproduction(figure, numbers)


def _draw(axes, values, sequences):
    """Plot a value after the touchdown of each step, with markers for the contact sequence of the step."""
    number = np.arange(1, values.size + 1)
    axes.plot(number, values, color="0.75", linewidth=0.8, zorder=1)
    for (marker, color), sequence in zip(MARKS, dict.fromkeys(sequences), strict=False):
        selected = np.array([other == sequence for other in sequences])
        axes.plot(
            number[selected], values[selected], marker, color=color, markersize=4.5, linestyle="none", label=sequence
        )


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
