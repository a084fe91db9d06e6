"""Compass biped with motors on level ground: trade-off between cost of transport and peak torque.

The front of gaits with slipping touchdown is compared with that of gaits that stick, at the same friction, speed and
step length; circles mark the knee of each front, the gait farthest from the straight line between its ends.
"""

from drawing import STYLE
from published import OPTIMA, check_optimum

from gaitopt import Execution, GaitProblem, Limits, Pareto, compass_biped
from gaitopt.study import Reproduction


def study(points=20, torque_limit=6.0, workers=1):  # [N m]
    """Return the study."""
    trade_off = Pareto(objectives=("cost", "peak_torque"), points=points)
    fronts = {}
    for sequence in OPTIMA:
        problem = GaitProblem(
            robot=compass_biped(),
            sequence=sequence,
            friction=0.14,
            speed=0.633,
            step_length=0.4713,
            limits=Limits(torque=torque_limit),
        )
        fronts[sequence] = trade_off.trace(problem, execution=Execution(workers=workers))
    numbers = [
        check_optimum(
            f"{sequence}: cost of transport at the loosest bound", front.cost.values[0], OPTIMA[sequence], 2e-3
        )
        for sequence, front in fronts.items()
    ]
    return Reproduction(_figure(fronts), tuple(numbers), tuple(_remark(*item) for item in fronts.items()))


def _remark(sequence, front):
    least = front.peak_torque.values[-1]
    texts = [f"'{sequence}': the smallest peak torque is {least:.4g} N m, at a cost of transport of"]
    texts.append(f"{front.cost.values[-1]:.5f}.")
    if front.knee.values.any():
        knee = int(front.knee.values.argmax())
        texts.append(f"The knee is at {front.peak_torque.values[knee]:.4g} N m and {front.cost.values[knee]:.5f}.")
    return " ".join(texts)


def _figure(fronts):
    with STYLE.figure(3.0) as figure:
        axes = figure.subplots()
        looks = (("#0072B2", "--"), ("#D55E00", "-"))
        for (sequence, front), (color, dashes) in zip(fronts.items(), looks, strict=True):
            axes.plot(front.peak_torque, front.cost, "o", linestyle=dashes, color=color, markersize=3, label=sequence)
        for number, front in enumerate(fronts.values()):
            knee, ring = front.isel(point=front.knee.values == 1), {"markerfacecolor": "none", "markersize": 9}
            label = None if number else "knee"
            axes.plot(knee.peak_torque, knee.cost, "o", color="0.15", label=label, **ring)
        axes.set(xlabel="peak torque [N m]", ylabel="cost of transport")
        figure.legend(loc="outside right center")
    return figure


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
