"""What ankle and hip are worth: cost of transport with a weaker and weaker ankle, and with one motor alone over speed.

On the left each gait is the start of the next one with a weaker ankle, down to the weakest with which a gait of this
speed and step length was found; the hip may have 30 N m. On the right the foot sticks throughout, and motors may have
30 N m each. Costs are drawn on a logarithmic scale.
"""

import numpy as np
from drawing import STYLE, spelled
from frontier_setup import SEQUENCE_STYLE, STANDARD, standard_numbers, walker

from gaitopt import Execution, Ipopt, Reproduction, WarmStart, solve, sweep, verify

STRONG = 30.0
"""[N m]."""

STICK, GRIPPY = "stick | stick", 0.5

WEAKENED = ((STICK, 0.14), ("slip+ stick | slip+", 0.14), (STICK, GRIPPY))
"""Contact sequences and frictions; with much friction a slip at touchdown would have to be forced."""

MOTORS = {
    "hip and ankle": ({"ankle": STRONG, "hip": STRONG}, {"color": "#0072B2", "linestyle": "-", "marker": "o"}),
    "ankle alone": ({"ankle": STRONG, "hip": 0.0}, {"color": "#E69F00", "linestyle": (0, (5, 1.5)), "marker": "v"}),
    "hip alone": ({"ankle": 0.0, "hip": STRONG}, {"color": "#CC79A7", "linestyle": (0, (1.5, 1)), "marker": "P"}),
}
"""Torque limits [N m], and how they are drawn."""


def study(limits=(6.0, 4.5, 3.0, 2.25, 1.5, 1.2, 1.0, 0.8, 0.6, 0.4, 0.2, 0.0), speeds=(0.4, 0.7, 7), workers=2):
    """Return the study; limits of the ankle fall, in N m, speeds are (least, most, count) in m/s."""
    weakened = {pair: list(_weakened(*pair, limits)) for pair in WEAKENED}
    speed = np.round(np.linspace(*speeds), 6)
    alone = {
        name: _costs_over(walker(friction=GRIPPY, torque=torque), speed, workers)
        for name, (torque, _) in MOTORS.items()
    }
    with STYLE.figure(3.6) as figure:
        left, right = figure.subplots(1, 2, sharey=True)
        for (sequence, friction), gaits in weakened.items():
            style = SEQUENCE_STYLE[sequence] | {"markersize": 4, "linewidth": 1.2}
            fill = {"markerfacecolor": "white"} if friction == GRIPPY else {}
            if gaits:
                points = [(limit, gait.cost_of_transport) for limit, gait in gaits]
                left.plot(
                    *zip(*points, strict=True), label=rf"{spelled(sequence)}, $\mu$ = {friction:g}", **style, **fill
                )
        for name, (_, style) in MOTORS.items():
            right.plot(speed, alone[name], label=name, markersize=4, linewidth=1.2, **style)
        left.set(xlabel="torque limit of the ankle [N m]", ylabel="cost of transport", yscale="log", xlim=(-0.1, None))
        right.set(xlabel=rf"speed [m/s], {STICK}, $\mu$ = {GRIPPY:g}")
        for axes in (left, right):
            axes.set_yticks([0.01, 0.02, 0.05, 0.1, 0.2], ["0.01", "0.02", "0.05", "0.1", "0.2"])
            axes.minorticks_off()
            axes.legend(loc="upper right" if axes is left else "upper center")
    standard = {
        sequence: solve(walker().replace(sequence=sequence)).require().cost_of_transport for sequence in STANDARD
    }
    remarks = (*_remarks(weakened), *_remarks_alone(speed, alone))
    return Reproduction(figure, tuple(standard_numbers(standard)), remarks)


def _costs_over(problem, speed, workers):
    """Return the cost of transport over speed."""
    return sweep(problem, {"speed": speed}, execution=Execution(workers=workers)).cost_of_transport[0].values


def _weakened(sequence, friction, limits):
    """Yield limits and gaits, each started from the one before, until one is not found or fails its replay."""
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


def _remarks(found):
    """Say what a weaker ankle costs and where gaits end."""
    for (sequence, friction), gaits in found.items():
        if gaits:
            (most, strong), (limit, weak) = gaits[0], gaits[-1]
            yield (
                f"`{sequence}` at friction {friction:g}: found down to {limit:g} N m at the ankle, where it costs "
                f"{weak.cost_of_transport / strong.cost_of_transport:.1f} times as much as with {most:g} N m."
            )


def _remarks_alone(speed, alone):
    """Say where each motor alone is at its best, beside both."""
    both = alone["hip and ankle"]
    for name, cost in alone.items():
        if cost is not both and np.any(np.isfinite(cost)):
            best = int(np.nanargmin(cost / both))
            yield (
                f"{name.capitalize()} at friction {GRIPPY:g}: found at {np.isfinite(cost).sum()} of {speed.size} "
                f"speeds; nearest to both at {speed[best]:g} m/s, at {cost[best] / both[best]:.2f} times their cost."
            )


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
