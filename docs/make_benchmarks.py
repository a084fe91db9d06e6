"""Write docs/benchmarks.md from docs/benchmarks.json, where ``tests/benchmarks`` leaves its numbers."""

import json
from pathlib import Path

DOCS = Path(__file__).resolve().parent

HEAD = """# Benchmarks

How long gaitopt takes, beside other tools and as problems grow. The numbers come from `tests/benchmarks`, where each
other tool is one plain script, written as its users would write it. To measure again:

    pip install -r tests/benchmarks/requirements.txt
    OMP_NUM_THREADS=1 pytest tests/benchmarks/test_other_tools.py --benchmark-only -s
    OMP_NUM_THREADS=1 pytest tests/benchmarks/test_growth.py --benchmark-only -s
    python docs/make_benchmarks.py

A tool that is not installed is left out; the two are measured apart, as what other tools import slows the second down.
Seconds are the processor's, as the machine served others too; measurements of a pair are taken in turn, and given are
the median and, in brackets, the quartiles; what has none was measured once.
"""

BESIDE = """## Beside other tools

The sticking gait of the compass biped with the least integral of squared torques: 100 kg, 0.633 m/s, steps of 0.4713 m,
no limits on torque or friction, 20 intervals. *First* is building the problem and solving it, imports excluded; *again*
is a solve at 0.7 m/s that goes on from there. The error is that of the optimal value, against a very fine grid. As
tools differ in accuracy, gaitopt is timed on the coarsest grid on which it is at least as accurate; a ratio below 1
means that gaitopt is faster. Its times include assembling the robot from its bodies, which these scripts have written
out. Its refinement is switched off here (`tolerance=inf`), as these tools do not refine either: it then checks the plan
between its nodes and reads out motion, work and energy when asked for them, which nobody does here. With refinement on,
grids as coarse as these end up finer.
"""

BETWEEN = """### Where the time goes

Of a first answer of gaitopt a tenth goes into the robot's equations, half into the programme and its derivatives, a
seventh into Newton's method, most of that for building its one Function, and a tenth into the start. The script tuned
by hand has the equations of this one robot written out and nothing else to build; for any other robot they would have
to be written anew. A solve again is four steps of Newton's method. How that works, and why the cost of transport needs
Ipopt instead, is told in [concepts/optimisation](concepts/optimisation.md).
"""


def main():
    """Write the page."""
    results = json.loads((DOCS / "benchmarks.json").read_text(encoding="utf-8"))
    parts = [
        HEAD,
        BESIDE,
        beside(results),
        BETWEEN,
        growth(results),
        convergence(results),
        studies(results),
        made_with(results),
    ]
    (DOCS / "benchmarks.md").write_text("\n".join(parts), encoding="utf-8")


def beside(results):
    """Return the table of other tools."""
    tools, heads = chosen(results, "beside "), ["error", "first [s]", "again [s]"]
    lines = [row(["tool", *heads, "gaitopt's grid", *heads, "ratio first", "ratio again"])]
    lines.append("|---|---:|---:|---:|---|" + "---:|" * 5)
    for tool, numbers in tools.items():
        theirs = [f"{numbers['error']:.1e}", seconds(numbers["theirs_first"]), seconds(numbers["theirs_again"])]
        own = [f"{abs(numbers['own_error']):.1e}", seconds(numbers["own_first"]), seconds(numbers["own_again"])]
        shares = [spread(numbers["ratio_first"]), spread(numbers["ratio_again"])]
        lines.append(row([tool, *theirs, numbers["grid"], *own, *shares]))
    first, again = (middle([part[f"default_{what}"] for part in tools.values()]) for what in ("first", "again"))
    lines += ["", "On its default grid, 20 intervals of 4 points, gaitopt has an error of 1e-7 and takes"]
    return "\n".join([*lines, f"{seconds(first)} s first and {seconds(again)} s again.", ""])


def middle(spreads):
    """Return the one with the middle median."""
    return sorted(spreads, key=lambda values: values[1])[len(spreads) // 2]


def growth(results):
    """Return what larger grids and other words cost."""
    lines = ["## Larger grids and other words", ""]
    lines += ["Milliseconds per iteration of the solver for squared torques, the smallest of all rounds:", ""]
    for i, (name, numbers) in enumerate(chosen(results, "iteration, ").items()):
        if i == 0:
            lines.append(row(["intervals", *numbers["seconds"], "exponent"]))
            lines.append("|---|" + "---:|" * (len(numbers["seconds"]) + 1))
        values = [f"{1e3 * value:.1f}" for value in numbers["seconds"].values()]
        lines.append(row([name, *values, f"{numbers['exponent']:.2f}"]))
    build = results["build"]["numbers"]
    lines += ["", f"Building `slip+ stick | slip+` takes {spread(build['ratio'])} times as long as `stick | stick`:"]
    lines += [f"{seconds(build['slip'])} s and {seconds(build['stick'])} s, robot excluded.", ""]
    return "\n".join(lines)


def convergence(results):
    """Return the table of costs over the grid."""
    lines = ["## Convergence", ""]
    lines += [
        "Cost of transport as the programme adds it up, at friction 0.14, 0.633 m/s, steps of 0.4713 m and torques",
        "up to 6 N m; what a gait reports is integrated, and differs by up to 0.8 % on 10 intervals and 0.1 % on 40.",
        "In brackets are the intervals of each phase, doubled where a plan leaves its contact modes between nodes.",
        "",
    ]
    for i, (sequence, table) in enumerate(chosen(results, "convergence, ").items()):
        if i == 0:
            counts = list(next(iter(table.values())))
            lines += [row(["sequence", "method", *counts]), "|---|---|" + "---:|" * len(counts)]
        for method, values in table.items():
            cells = [f"{cost:.6f} ({'+'.join(map(str, grid))})" for cost, grid in values.values()]
            lines.append(row([f"`{sequence}`".replace("|", "\\|"), method, *cells]))
    return "\n".join([*lines, ""])


def studies(results):
    """Return what sweeps cost."""
    if "sweep" not in results:
        return ""
    numbers, machine = results["sweep"]["numbers"], results["sweep"]["machine"]
    return (
        "## Sweeps\n\n"
        "A sweep of 26 frictions from 0.1 to 0.25 and two sequences (52 gaits), reached from both sides and replayed,\n"
        f"takes {numbers['one']:.1f} s, as long as {numbers['solves']:.1f} cold solves of "
        f"{numbers['cold']:.2f} s. Two workers are\n{numbers['speed_up']:.2f} times as fast as one. "
        f"By the clock, imports included ({machine}).\n\n"
        "Half of that is the 52 solves on the fine grid, of 15 iterations each: an optimum that switches its\n"
        "torques on and off is found anew by an interior-point method, however near the start. Tried without gain:\n"
        "starts extrapolated from two neighbours, with and without their multipliers; starts from the neighbour's\n"
        "fine gait, corrected by what changes on the coarse grid; coarser grids to scout on, which the fine one\n"
        "pays for; other rules for the barrier. What pays is to spare solves: a way back that would only lead to\n"
        "the gait already known is told beforehand, from the multipliers.\n"
    )


def made_with(results):
    """Return date, machine and versions of each part."""
    lines = ["## Made with", ""]
    for name, part in results.items():
        versions = ", ".join(f"{package} {version}" for package, version in part["versions"].items())
        lines.append(f"- {name}: {part['date']}, Python {part['python']}, {part['machine']}, {versions}")
    return "\n".join([*lines, ""])


def chosen(results, start):
    """Return the numbers of all parts whose name starts like this, by the rest of it."""
    return {name[len(start) :]: part["numbers"] for name, part in results.items() if name.startswith(start)}


def seconds(values):
    """Return a spread of seconds."""
    return spread(values, ".3f")


def spread(values, form=".2f"):
    """Return the median and, in brackets, the quartiles."""
    low, median, high = (format(value, form) for value in values)
    return median if low == high else f"{median} ({low}-{high})"


def row(cells):
    """Return a row of a table."""
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    main()
