"""Double support with a slipping foot against single support, over step length and friction.

A compass biped with motors at ankle and hip walks at 0.633 m/s with the least integral of squared torques. In the
double support, the trailing foot is dragged forward while the front foot sticks. In the gaits with single support, the
trailing foot leaves the ground at touchdown, and the front foot sticks or first slips forward. Sticking contacts keep a
margin from slipping, and all gaits keep margins from other outcomes of the impact and from grazing touchdowns.
Percentages are the saving of double support relative to the better of the other two; "none" marks the point without a
double support. The lower panel shows the absolute work of the motors (positive work plus braking work) and its parts,
the losses and twice the braking work, for single support (left bar), slipping landing (middle bar) and double support
(right bar). In the list, the step lengths [m] of missing gaits are in parentheses after the friction coefficient.

Long single-support steps need large torques that brake the legs; in the double support the impact and the slip
dissipate the energy instead. The comparison does not include a front foot that slips backward or a trailing foot that
slips backward. Five further random starts at steps of 0.8 m and friction 0.2 and 0.4 led to no lower cost. Slow long
steps (0.25 m/s, 0.9 m) are not shown: both legs of their optima are vertical at the same instant, and whether the swing
foot touches the ground there depends on errors below the tolerances, so that their replays fail.

The legs are straight, so that the swing foot may be below the ground after its leg has passed the other one. In a valid
gait the foot then rises to a height above the ground that exceeds its depth below the ground. This limit is active in
some gaits with long steps: at friction 0.4 it increases the cost of the slipping landings with steps of 1.0, 1.1 and
1.2 m by 0.4, 3 and 8 %.
"""

import numpy as np
from attrs import evolve
from contacts_setup import check_balance, describe_gaits, describe_work, name_gait, script_problem, sweep_sequences
from drawing import STYLE, TERMS, stack_terms
from matplotlib.ticker import FixedLocator, NullFormatter, ScalarFormatter
from published import OWN

from gaitopt import Margins
from gaitopt.ocp import solve_planar
from gaitopt.study import PublishedValue, Reproduction

SCRIPT = "compass_double_support"
STICK, SLIP, DOUBLE = "single support", "slipping landing", "double support"
GAITS = {
    STICK: ("foot A stick |", {"color": "#0072B2", "linestyle": "-", "marker": "o"}),
    SLIP: ("foot A slip+ > foot A stick |", {"color": "#009E73", "linestyle": (0, (5, 1.5, 1, 1.5)), "marker": "^"}),
    DOUBLE: (
        "foot A slip+, foot B stick > foot B stick |",
        {"color": "#D55E00", "linestyle": (0, (5, 1.5)), "marker": "s"},
    ),
}
"""Contact sequence and line style of each gait."""

COST_UNIT = "N^2 m^2 s"
MARGINS = Margins(
    cone=0.01, impact_cone=0.02, slip_speed=0.01, separation=0.01, normal_force=0.005, touchdown_rate=0.05
)


def study(
    steps=(0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2),
    frictions=(0.15, 0.2, 0.3, 0.4, 0.6),
    speed=0.633,
    shown=0.4,
    workers=2,
    folder=None,
):
    """Return the study.

    `shown` is the friction of the curves and of the energies; `folder` stores the sweeps, from which an interrupted
    study resumes.
    """
    make = script_problem(SCRIPT)
    problems = {name: make(sequence=text, speed=speed, step_length=0.8) for name, (text, _) in GAITS.items()}
    for name, problem in problems.items():
        problems[name] = problem.replace(margins=MARGINS, transcription=evolve(problem.transcription, tolerance=1e-8))
    axes = {"friction": frictions, "step_length": steps}
    table = sweep_sequences(SCRIPT, problems, axes, workers, folder)
    figure = _draw(table, shown)
    reference = solve_planar(make()).solver.objective
    name = "double support, 0.25 m/s, steps of 0.4713 m, friction 0.4, no margins: cost"
    numbers = (PublishedValue(name, reference, 42.7621, 5e-4, OWN, COST_UNIT), check_balance(table))
    return Reproduction(figure, numbers, (*_remarks(table), *describe_gaits(table)))


def _draw(table, shown):
    """Return the figure: map of the saving, costs, and energies."""
    with STYLE.figure(5.6) as figure:
        grid = figure.add_gridspec(2, 2)
        _draw_map(figure, figure.add_subplot(grid[0, 0]), table)
        _draw_costs(figure.add_subplot(grid[0, 1]), table.sel(friction=shown))
        axes = figure.add_subplot(grid[1, :])
        for name, shift in zip(GAITS, (-0.27, 0, 0.27), strict=True):
            one = table.sel(gait=name, friction=shown)
            heights = [one.terms.where(one.verified == 1).sel(term=term).fillna(0).values for term, *_ in TERMS]
            stack_terms(axes, shift, 0.25, heights)
        bars = f"bars from left to right: {', '.join(GAITS)}"
        axes.set(xlabel=f"step length [m], friction {shown:g} ({bars})", ylabel="work of the motors [J/m]")
        axes.set_xticks(range(table.step_length.size), [_write(step) for step in table.step_length.values])
        axes.grid(visible=False, axis="x")
        handles, labels = axes.get_legend_handles_labels()
        axes.legend(handles[: len(TERMS)], labels[: len(TERMS)], loc="lower right", bbox_to_anchor=(1, 1), ncols=3)
    return figure


def _write(length):
    """Return a length with at least one decimal, as at the other axes."""
    return np.format_float_positional(length, trim="0")


def _draw_map(figure, axes, table):
    """Plot the saving by double support over friction and step length."""
    values, others = saving(table)
    shading = axes.pcolormesh(values.T, cmap="RdBu", vmin=-60, vmax=60)
    figure.colorbar(shading, location="top", extend="both", label="saving by double support [%]")
    for i, j in np.ndindex(values.shape):
        text = f"{values[i, j]:z.0f}".replace("-", "\N{MINUS SIGN}") if np.isfinite(values[i, j]) else ""
        double = table.verified.sel(gait=DOUBLE).transpose("friction", "step_length").values[i, j]
        text = text or ("only" if double and not np.isfinite(others[i, j]) else "none")
        color = "white" if abs(np.nan_to_num(values[i, j])) > 35 else "black"
        axes.text(i + 0.5, j + 0.5, text, color=color, ha="center", va="center", fontsize=7)
    axes.set_xticks(np.arange(values.shape[0]) + 0.5, [f"{each:g}" for each in table.friction.values])
    axes.set_yticks(np.arange(values.shape[1]) + 0.5, [_write(each) for each in table.step_length.values])
    axes.set(xlabel=r"friction $\mu$", ylabel="step length [m]")
    axes.grid(visible=False)


def _draw_costs(axes, table):
    """Plot the costs over step length at one friction."""
    for name, (_, style) in GAITS.items():
        one = table.sel(gait=name)
        axes.plot(one.step_length, one.objective.where(one.verified == 1), label=name, markersize=4, **style)
    axes.set(xlabel=f"step length [m], friction {float(table.friction):g}", yscale="log")
    axes.set(ylabel="squared torques [N$^2$ m$^2$ s]")
    axes.yaxis.set_major_locator(FixedLocator([20, 50, 100, 200, 500]))
    axes.yaxis.set_major_formatter(ScalarFormatter())
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.legend()


def saving(table):
    """Return the saving by double support [%] and the lower cost of the other gaits, (friction, step) arrays."""
    cost = table.objective.where(table.verified == 1).transpose("gait", "friction", "step_length")
    others = cost.sel(gait=[STICK, SLIP]).min("gait").values
    return 100 * (1 - cost.sel(gait=DOUBLE).values / others), others


def _remarks(table):
    """Yield where double support costs less, the largest saving, and the energies there."""
    values, _ = saving(table)
    for i, friction in enumerate(table.friction.values):
        less = table.step_length.values[values[i] > 0]
        if less.size:
            steps = ", ".join(f"{step:g}" for step in less)
            yield f"At friction {friction:g} double support costs less at steps of {steps} m."
    complete = (table.verified == 1).all("gait").transpose("friction", "step_length").values
    if not complete.any():
        return
    i, j = np.unravel_index(np.argmax(np.where(complete, values, -np.inf)), values.shape)
    step, friction = float(table.step_length[j]), float(table.friction[i])
    yield (
        f"Where all three gaits exist, the largest saving is {values[i, j]:.0f} %, at steps of {step:g} m and friction "
        f"{friction:g}."
    )
    for name in GAITS:
        one = table.sel(gait=name, step_length=step, friction=friction)
        cost, work = float(one.objective), describe_work(one)
        yield f"There, {name_gait(name)} costs {cost:.1f} N^2 m^2 s; the work of its motors is {work}."


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
