"""Write docs/benchmarks.md from docs/benchmarks.json, the numbers of the last run of ``tests/benchmarks``.

Run it with ``python docs/make_benchmarks.py`` after

    OMP_NUM_THREADS=1 pytest tests/benchmarks/test_other_tools.py tests/benchmarks/test_growth.py --benchmark-only -s
"""

import json
from pathlib import Path

DOCS = Path(__file__).resolve().parent

HEAD = """# Benchmarks

How long gaitopt takes, beside other tools and as problems grow. The numbers come from `tests/benchmarks`, where each other
tool is one plain script, written as its users would write it. This page is written by `python docs/make_benchmarks.py`
from the numbers of

    OMP_NUM_THREADS=1 pytest tests/benchmarks/test_other_tools.py tests/benchmarks/test_growth.py --benchmark-only -s

A tool that is not installed is left out; `pip install casadi rockit-meco drake nosnoc dymos` installs all of them.
Seconds are the processor's, as the machine served others too; measurements of a pair are taken in turn, and given are the
median and, in brackets, the quartiles.
"""

BESIDE = """## Beside other tools

The sticking gait of the compass biped with the least integral of squared torques: 100 kg, 0.633 m/s, steps of 0.4713 m,
no limits on torque or friction, 20 intervals. *First* is building the problem and solving it, imports excluded; *again* is
a solve at 0.7 m/s that goes on from there. The error is that of the optimal value, against a very fine grid. As tools
differ in accuracy, gaitopt is timed on the coarsest grid on which it is at least as accurate; a ratio below 1 means that
gaitopt is faster. What gaitopt does besides, and these scripts do not: assemble the robot from its bodies, check the plan
between its nodes, and read out motion, work and energy ledger.
"""


def main():
    results = json.loads((DOCS / "benchmarks.json").read_text(encoding="utf-8"))
    parts = [HEAD, BESIDE, beside(results), growth(results), convergence(results), studies(results), made_with(results)]
    (DOCS / "benchmarks.md").write_text("\n".join(parts), encoding="utf-8")


def beside(results):
    rows = {name[len("beside ") :]: part["numbers"] for name, part in results.items() if name.startswith("beside ")}
    lines = ["| tool | error | first [s] | again [s] | gaitopt's grid | error | first [s] | again [s] | ratio first | again |"]
    lines.append("|---|---:|---:|---:|---|---:|---:|---:|---:|---:|")
    for tool, numbers in rows.items():
        cells = [tool, f"{numbers['error']:.1e}", seconds(numbers["theirs_first"]), seconds(numbers["theirs_again"])]
        cells += [numbers["grid"], f"{abs(numbers['own_error']):.1e}", seconds(numbers["own_first"])]
        cells += [seconds(numbers["own_again"]), spread(numbers["ratio_first"]), spread(numbers["ratio_again"])]
        lines.append(row(cells))
    first, again = zip(*((part["default_first"], part["default_again"]) for part in rows.values()), strict=True)
    middle = [sorted(part, key=lambda numbers: numbers[1])[len(part) // 2] for part in (first, again)]
    lines += ["", f"gaitopt with 20 intervals of 4 points, its default: first {seconds(middle[0])} s, again "]
    lines[-1] += f"{seconds(middle[1])} s, at an error of 1e-7.\n"
    return "\n".join(lines)


def growth(results):
    lines = ["## Larger grids and other words", "", "Milliseconds per iteration of the solver, the smallest of all rounds:", ""]
    for i, (name, numbers) in enumerate(chosen(results, "iteration, ").items()):
        if i == 0:
            lines += [row(["intervals", *numbers["seconds"], "exponent"]), "|---|" + "---:|" * (len(numbers["seconds"]) + 1)]
        values = [f"{1e3 * value:.1f}" for value in numbers["seconds"].values()]
        lines.append(row([name, *values, f"{numbers['exponent']:.2f}"]))
    build = results["build"]["numbers"]
    lines += ["", f"Building `slip+ stick | slip+` takes {spread(build['ratio'])} times as long as `stick | stick`:"]
    lines += [f"{seconds(build['slip'])} s and {seconds(build['stick'])} s, robot excluded.", ""]
    return "\n".join(lines)


def convergence(results):
    lines = ["## Convergence", "", "Cost of transport at friction 0.14, 0.633 m/s, steps of 0.4713 m and torques up to 6 N m."]
    lines += ["Where a plan is not accurate between its nodes, gaitopt refines it; the grid it ended on stands in brackets.", ""]
    for i, (word, table) in enumerate(chosen(results, "convergence, ").items()):
        if i == 0:
            counts = list(next(iter(table.values())))
            lines += [row(["word", "method", *counts]), "|---|---|" + "---:|" * len(counts)]
        for method, values in table.items():
            cells = [f"{cost:.6f} ({'+'.join(map(str, grid))})" for cost, grid in values.values()]
            lines.append(row([f"`{word}`".replace("|", "\\|"), method, *cells]))
    return "\n".join([*lines, ""])


def studies(results):
    numbers = results["sweep"]["numbers"]
    return (
        "## Sweeps\n\n"
        f"A sweep of 26 frictions from 0.1 to 0.25 and two words, 52 gaits, each replayed and continued both ways, takes "
        f"{numbers['one']:.1f} s by the clock: as long as {numbers['solves']:.1f} cold solves of {numbers['cold']:.2f} s. "
        f"Two workers are {numbers['speed_up']:.2f} times as fast as one, on a machine that others used at the time.\n"
    )


def made_with(results):
    lines = ["## Made with", ""]
    for name, part in results.items():
        versions = ", ".join(f"{package} {version}" for package, version in part["versions"].items())
        lines.append(f"- {name.replace('|', chr(92) + '|')}: {part['date']}, Python {part['python']}, {part['machine']}, {versions}")
    return "\n".join([*lines, ""])


def chosen(results, start):
    return {name[len(start) :]: part["numbers"] for name, part in results.items() if name.startswith(start)}


def seconds(values):
    return spread(values, ".3f")


def spread(values, form=".2f"):
    low, middle, high = (format(value, form) for value in values)
    return middle if low == high else f"{middle} ({low}-{high})"


def row(cells):
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    main()
