"""Landings that slip in hopping and running, as functions of friction.

Left: a monopod with a spring in its leg hops at 1.5 m/s with steps of 0.6 m and the least integral of squared hip
torque plus 1e-3 m^2 times squared leg force. Right: a point mass on two telescoping legs, with feet of 5 % of its mass,
runs at 1.2 m/s with steps of 1 m and the least positive work. The foot that lands sticks, or slips forward until it
comes to rest. Sticking contacts keep a margin from slipping, and all gaits keep margins from other outcomes of the
impact and from an early lift-off. A hollow marker denotes a gait whose slip phase has the minimum permitted duration.
The lower panels show the absolute work of the motors (positive work plus braking work) and its parts, the losses and
twice the braking work, for the sticking (left bar) and the slipping landing (right bar).

A landing that sticks at low friction needs a foot that falls almost vertically, because the impulse must stay in the
friction cone; its impact dissipates most of the energy of the hop. The running gaits have several local optima: the
slipping landing of the biped at friction 0.15, which slides for more than half of its stance, is a different kind of
local optimum from those at higher friction, so that its saving is uncertain.
"""

import numpy as np
from contacts_setup import check_balance, describe_gaits, describe_work, name_gait, script_problem, sweep_sequences
from drawing import STYLE, TERMS, stack_terms
from published import OWN

from gaitopt import Margins
from gaitopt.ocp import solve_planar
from gaitopt.study import PublishedValue, Reproduction

STICK, SLIP = "sticking landing", "slipping landing"
LINES = {
    STICK: {"color": "#0072B2", "linestyle": "-", "marker": "o"},
    SLIP: {"color": "#D55E00", "linestyle": (0, (5, 1.5)), "marker": "s"},
}
MARGINS = Margins(cone=0.01, impact_cone=0.02, slip_speed=0.01, normal_force=0.005, touchdown_rate=0.1)
ROBOTS = {
    "monopod, hopping": (
        "monopod",
        {STICK: "foot stick > flight |", SLIP: "foot slip+ > foot stick > flight |"},
        {"clearance": 0.005},
    ),
    "telescoping biped, running": (
        "telescoping_biped",
        {STICK: "foot A stick > flight |", SLIP: "foot A slip+ > foot A stick > flight |"},
        {"speed": 1.2, "step_length": 1.0, "foot_mass": 0.05, "torque_limit": 0.2, "intervals": 8},
    ),
}
"""Script, contact sequences and parameters of each robot."""

UNITS = {"monopod, hopping": "N$^2$ m$^2$ s", "telescoping biped, running": "J"}


def study(hopping=(0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.6), running=(0.15, 0.2, 0.3), workers=2, folder=None):
    """Return the study of the friction coefficients of each robot.

    `folder` stores the sweeps, from which an interrupted study resumes.
    """
    tables = {}
    for label, frictions in zip(ROBOTS, (hopping, running), strict=True):
        if frictions:
            axes = {"friction": frictions}
            tables[label] = sweep_sequences(ROBOTS[label][0], make_problems(label), axes, workers, folder)
    figure = _draw(tables)
    hop = solve_planar(script_problem("monopod")(clearance=0.0)).solver.objective
    numbers = [
        PublishedValue("monopod, friction 1, no margins, no clearance: cost", hop, 23.505, 5e-4, OWN, "N^2 m^2 s")
    ]
    numbers += [check_balance(table, label) for label, table in tables.items()]
    remarks = [f"{label.capitalize()}: {text}" for label, table in tables.items() for text in _remarks(table)]
    return Reproduction(figure, tuple(numbers), tuple(remarks))


def make_problems(label):
    """Return the problems of a robot by landing."""
    script, sequences, settings = ROBOTS[label]
    make = script_problem(script)
    return {
        name: make(sequence=sequence, friction=0.3, **settings).replace(margins=MARGINS)
        for name, sequence in sequences.items()
    }


def _draw(tables):
    """Return the figure: costs above, energies below."""
    with STYLE.figure(4.8) as figure:
        columns = figure.subplots(2, len(tables), squeeze=False).T
        for (above, below), (label, table) in zip(columns, tables.items(), strict=True):
            for name, shift in ((STICK, -0.2), (SLIP, 0.2)):
                one = table.sel(gait=name)
                cost = one.objective.where(one.verified == 1)
                style = LINES[name]
                above.plot(table.friction, cost, label=name, markersize=4, **style)
                hollow = one.shortest_phase.values < 1.01 * make_problems(label)[name].limits.shortest_phase
                mark = {"linestyle": "", "marker": style["marker"], "markersize": 4, "markerfacecolor": "white"}
                above.plot(table.friction[hollow], cost[hollow], color=style["color"], **mark)
                terms = one.terms.where(one.verified == 1)
                stack_terms(below, shift, 0.36, [terms.sel(term=term).fillna(0).values for term, *_ in TERMS])
            above.set(title=label, xlabel=r"friction $\mu$", ylabel=f"objective [{UNITS[label]}]")
            above.legend()
            bars = "left bar sticking landing, right bar slipping"
            below.set(xlabel=f"friction $\\mu$\n({bars})", ylabel="work of the motors [J/m]")
            below.set_xticks(range(table.friction.size), [f"{each:g}" for each in table.friction.values])
            below.grid(visible=False, axis="x")
        handles, labels = columns[0][1].get_legend_handles_labels()
        figure.legend(handles[: len(TERMS)], labels[: len(TERMS)], loc="outside lower center", ncols=len(TERMS))
    return figure


def _remarks(table):
    """Yield where the slipping landing costs less, its largest saving, the energies there, and the failures."""
    cost = table.objective.where(table.verified == 1)
    saving = (100 * (1 - cost.sel(gait=SLIP) / cost.sel(gait=STICK))).values
    friction, less = table.friction.values, table.friction.values[saving > 0]
    if less.size:
        yield f"the slipping landing costs less at friction {', '.join(f'{each:g}' for each in less)}."
    if np.isfinite(saving).any():
        most = int(np.nanargmax(saving))
        yield f"the largest saving is {saving[most]:.1f} %, at friction {friction[most]:g}."
        for name in LINES:
            one = table.sel(gait=name).isel(friction=most)
            yield f"there, the work of the motors of the gait with {name_gait(name)} is {describe_work(one)}."
    yield from describe_gaits(table)


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
