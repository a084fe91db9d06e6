"""Why slip reduces the cost: energy losses of two contact sequences as functions of friction.

On level ground the absolute work of the motors is the impact loss plus the friction loss plus twice the braking work,
for both contact sequences, which are compared at equal speed and step length. A touchdown that slips forward has a
smaller impact loss: friction limits the tangential impulse, so that a part of the tangential motion, which a sticking
impact stops, is retained. This saving exceeds the cost of slip and braking, until friction is so high that slip would
have to be forced by the motors.
"""

import numpy as np
from drawing import STYLE, TERMS, format_sequence, stack_terms
from frontier_setup import walker

from gaitopt import Execution, sweep
from gaitopt.study import PublishedValue, Reproduction

SLIP, STICK = "slip+ stick | slip+", "stick | stick"


def study(frictions=(0.1, 0.12, 0.14, 0.16, 0.18, 0.2, 0.22), workers=2):
    """Return the study."""
    table = sweep(walker(), {"friction": frictions}, sequences=[STICK, SLIP], execution=Execution(workers=workers))
    terms = {name: factor * table[name] / table.travel for name, factor, *_ in TERMS}
    with STYLE.figure(3.8) as figure:
        left, right = figure.subplots(1, 2)
        for sequence, shift in ((STICK, -0.2), (SLIP, 0.2)):
            stack_terms(left, shift, 0.36, [terms[name].sel(sequence=sequence).values for name, *_ in TERMS])
        bars = f"left bar {format_sequence(STICK)}, right bar {format_sequence(SLIP)}"
        left.set(xlabel=f"friction $\\mu$\n({bars})")
        left.set(ylabel="work of the motors over distance [J/m]", ylim=(0, None))
        stack_terms(right, 0.0, 0.6, [_difference(terms[name]) for name, *_ in TERMS])
        right.plot(sum(map(_difference, terms.values())), "D", color="0.1", markeredgecolor="white", label="total")
        right.axhline(0, color="0.3", linewidth=0.8)
        right.margins(y=0.08)
        right.set(xlabel=r"friction $\mu$", ylabel="slipping minus sticking [J/m]")
        for axes in (left, right):
            axes.set_xticks(range(len(frictions)), [f"{friction:g}" for friction in frictions])
            axes.grid(visible=False, axis="x")
        handles, labels = right.get_legend_handles_labels()
        order = [*range(1, len(labels)), 0]
        figure.legend(
            [handles[i] for i in order], [labels[i] for i in order], loc="outside upper center", ncols=len(labels)
        )
    return Reproduction(figure, tuple(_numbers(table, terms)), tuple(_remarks(frictions, terms)))


def _difference(term):
    return term.sel(sequence=SLIP).values - term.sel(sequence=STICK).values


def _numbers(table, terms):
    """Yield for each sequence the sum of the terms over the cost of transport, at the friction of largest error."""
    robot, values = walker().robot, walker().values
    mass = float(robot.mass(robot.vector(values)))
    for sequence in (STICK, SLIP):
        total = sum(term.sel(sequence=sequence) for term in terms.values()) / (mass * values["gravity"])
        ratio = (total / table.cost_of_transport.sel(sequence=sequence)).values
        worst = float(ratio[np.argmax(np.abs(ratio - 1))])
        yield PublishedValue(
            f"{sequence}: (impact + friction + 2 braking) / cost of transport", worst, 1.0, 1e-5, "energy balance"
        )


def _remarks(frictions, terms):
    """Yield the saving and the cost of slip."""
    for number in range(0, len(frictions), 2):
        impact, slip, braking = (_difference(terms[name])[number] for name, *_ in TERMS)
        yield (
            f"At friction {frictions[number]:g} the slipping touchdown reduces the impact loss by {-impact:.3f} J/m; "
            f"slip dissipates {slip:.3f} J/m, and twice the braking work changes by {braking:+.3f} J/m; "
            f"in total, the absolute work changes by {impact + slip + braking:+.3f} J/m."
        )


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
