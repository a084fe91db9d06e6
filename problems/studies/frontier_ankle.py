"""Benefit of ankle and hip motors: cost of transport over the torque limit of the ankle, and over speed with one motor.

Left: the torque limit of the ankle is reduced step by step, each gait warm-started from the previous one, down to the
lowest limit for which a gait of this speed and step length was found; the limit of the hip is 30 N m. Right: the foot
sticks throughout, and the limit of each motor is 30 N m. Costs are plotted on a logarithmic scale.
"""

import numpy as np
from drawing import STYLE, format_sequence
from frontier_setup import SEQUENCE_STYLE, standard_numbers, walker
from published import OPTIMA

from gaitopt import Execution, Ipopt, WarmStart, solve, sweep, verify
from gaitopt.study import Reproduction

STRONG = 30.0
"""Torque limit of a strong motor [N m]."""

STICK, HIGH_FRICTION = "stick | stick", 0.5

WEAKENED = ((STICK, 0.14), ("slip+ stick | slip+", 0.14), (STICK, HIGH_FRICTION))
"""Contact sequences and frictions; at high friction, slip at touchdown would have to be forced."""

MOTORS = {
    "hip and ankle": ({"ankle": STRONG, "hip": STRONG}, {"color": "#0072B2", "linestyle": "-", "marker": "o"}),
    "ankle alone": ({"ankle": STRONG, "hip": 0.0}, {"color": "#E69F00", "linestyle": (0, (5, 1.5)), "marker": "v"}),
    "hip alone": ({"ankle": 0.0, "hip": STRONG}, {"color": "#CC79A7", "linestyle": (0, (1.5, 1)), "marker": "P"}),
}
"""Torque limits [N m] and line styles."""


def study(limits=(6.0, 4.5, 3.0, 2.25, 1.5, 1.2, 1.0, 0.8, 0.6, 0.4, 0.2, 0.0), speeds=(0.4, 0.7, 7), workers=2):
    """Return the study; `limits` of the ankle decrease [N m], `speeds` are (least, most, count) [m/s]."""
    weakened = {pair: list(_weaken_ankle(*pair, limits)) for pair in WEAKENED}
    speed = np.round(np.linspace(*speeds), 6)
    alone = {
        name: _costs_over(walker(friction=HIGH_FRICTION, torque=torque), speed, workers)
        for name, (torque, _) in MOTORS.items()
    }
    with STYLE.figure(3.6) as figure:
        left, right = figure.subplots(1, 2, sharey=True)
        for (sequence, friction), gaits in weakened.items():
            style = SEQUENCE_STYLE[sequence] | {"markersize": 4, "linewidth": 1.2}
            fill = {"markerfacecolor": "white"} if friction == HIGH_FRICTION else {}
            if gaits:
                points = [(limit, gait.cost_of_transport) for limit, gait in gaits]
                left.plot(
                    *zip(*points, strict=True),
                    label=rf"{format_sequence(sequence)}, $\mu$ = {friction:g}",
                    **style,
                    **fill,
                )
        for name, (_, style) in MOTORS.items():
            right.plot(speed, alone[name], label=name, markersize=4, linewidth=1.2, **style)
        left.set(xlabel="torque limit of the ankle [N m]", ylabel="cost of transport", yscale="log", xlim=(-0.1, None))
        right.set(xlabel=rf"speed [m/s], {STICK}, $\mu$ = {HIGH_FRICTION:g}")
        for axes in (left, right):
            axes.set_yticks([0.01, 0.02, 0.05, 0.1, 0.2], ["0.01", "0.02", "0.05", "0.1", "0.2"])
            axes.minorticks_off()
            axes.legend(loc="upper right" if axes is left else "upper center")
    standard = {sequence: solve(walker().replace(sequence=sequence)).require().cost_of_transport for sequence in OPTIMA}
    remarks = (*_remarks(weakened), *_remarks_alone(speed, alone))
    return Reproduction(figure, tuple(standard_numbers(standard)), remarks)


def _costs_over(problem, speed, workers):
    """Return the cost of transport over speed."""
    return sweep(problem, {"speed": speed}, execution=Execution(workers=workers)).cost_of_transport[0].values


def _weaken_ankle(sequence, friction, limits):
    """Yield limits and gaits, each warm-started from the previous one, until one is not found or fails the replay."""
    gait = None
    for limit in limits:
        problem = walker(friction=friction, torque={"ankle": limit, "hip": STRONG}).replace(sequence=sequence)
        if gait is not None:
            problem = problem.replace(guess=WarmStart(gait))
        gait = solve(problem, solver=Ipopt(max_iterations=200))
        gait = verify(gait) if gait.status.ok else gait
        if not gait.status.ok:
            return
        yield limit, gait


def _remarks(weakened):
    """Yield the increase of cost with a weaker ankle and the lowest feasible limit."""
    for (sequence, friction), gaits in weakened.items():
        if gaits:
            (most, strong), (limit, weak) = gaits[0], gaits[-1]
            yield (
                f"`{sequence}` at friction {friction:g}: gaits were found down to {limit:g} N m at the ankle, where "
                f"the cost is {weak.cost_of_transport / strong.cost_of_transport:.1f} times that with {most:g} N m."
            )


def _remarks_alone(speed, alone):
    """Yield the speed at which each single motor compares best with both motors."""
    both = alone["hip and ankle"]
    for name, cost in alone.items():
        if cost is not both and np.any(np.isfinite(cost)):
            best = int(np.nanargmin(cost / both))
            yield (
                f"{name.capitalize()} at friction {HIGH_FRICTION:g}: gaits were found at {np.isfinite(cost).sum()} of "
                f"{speed.size} speeds; the lowest ratio of the cost to that with both motors is "
                f"{cost[best] / both[best]:.2f}, at {speed[best]:g} m/s."
            )


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
