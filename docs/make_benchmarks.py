"""Write docs/benchmarks.md from docs/benchmarks.json, in which ``tests/benchmarks`` stores its results."""

import json
from pathlib import Path

DOCS = Path(__file__).resolve().parent

HEAD = """# Benchmarks

This page compares the computing times of gaitopt with those of other tools, and shows how they grow with problem
size. The numbers are measured by `tests/benchmarks`, which contains one plain script for each other tool, written as
its users would write it. To repeat the measurements:

    pip install -r tests/benchmarks/requirements.txt
    OMP_NUM_THREADS=1 pytest tests/benchmarks/test_other_tools.py --benchmark-only -s
    OMP_NUM_THREADS=1 pytest tests/benchmarks/test_growth.py --benchmark-only -s
    OMP_NUM_THREADS=1 pytest tests/benchmarks/test_resolves.py --benchmark-only -s
    OMP_NUM_THREADS=1 pytest tests/benchmarks/test_chain_growth.py --benchmark-only -s
    OMP_NUM_THREADS=1 pytest tests/benchmarks/test_five_link_opti.py --benchmark-only -s
    python docs/make_benchmarks.py

A tool that is not installed is omitted. The files are run separately, because the imports of one tool slow down the
others. Times are processor times, because other programs ran on the machine; *load* denotes its load average. The two
measurements of a pair alternate. The tables give the median with the quartiles in parentheses; a value without
quartiles was measured once, or its quartiles are equal in the printed digits. An exponent is the slope of a line fitted
to the logarithms of both quantities.
"""

BESIDE = """## Comparison with other tools

The problem is the sticking gait of the compass biped with the minimum integral of squared torques: 100 kg, 0.633 m/s,
step length 0.4713 m, no limits on torque or friction, 20 intervals. *First* is the time to build and solve the
problem, without imports; *again* is the time of a solve at 0.7 m/s that is warm-started from it. The error is that of
the optimal value, relative to a very fine grid. Because the accuracy of the tools differs, gaitopt is timed on the
coarsest grid on which it is at least as accurate, such as "6 of 3 points", which has 6 intervals of 3 points each. The
ratio is the time of gaitopt divided by that of the tool; below 1, gaitopt is faster. The times of gaitopt include the
assembly of the robot from its bodies, whereas the scripts contain the equations of motion in explicit form. The grid
refinement of gaitopt is switched off (`tolerance=inf`), because the other tools do not refine either. The error between
the nodes, and the motion, work and energy of the result, are then evaluated only when they are accessed, which is not
timed here. By default, grids as coarse as these are refined.
"""

BETWEEN = """### Distribution of the computing time

In the first solve of gaitopt, a tenth of the time is spent on the equations of the robot, half on the NLP and its
derivatives, a seventh on Newton's method (mostly on building its Function), and a tenth on the initial guess. The
hand-tuned script contains the explicit equations of this robot and builds nothing else; for any other robot they would
have to be rewritten. A repeated solve consists of four steps of Newton's method.
[From a contact sequence to a gait](concepts/optimisation.md) explains this method, and why the cost of transport
requires other methods.

In three series of 60 alternating pairs on a machine without other load (2026-11-24), the first solve took 0.91 to 0.93
times as long as that of the hand-tuned script.

The command `gaitopt solve problems/compass_slip.py` takes 0.9 s of processor time: 30 % in Ipopt (80 iterations on five
NLPs), 19 % for the import of other packages, 13 % for that of gaitopt, 10 % to build the NLPs, 12 % for the certificate
(half of it for a linear program), 4 % each for the replay and for writing the file and the table, and 8 % for guesses
and checks between nodes. These shares were measured on 2026-11-25; since then, Ipopt and the import of gaitopt have
become faster. The command takes 0.67 of the processor time and 0.60 of the wall-clock time of an earlier revision of
gaitopt, 183f18f (medians of 25 pairs of runs with compiled bytecode, 2026-11-28); other packages, Ipopt and the linear
program alone take 0.4 of the processor time of that revision.
Derivatives are not stored on disk: the command builds them in 32 ms, and CasADi would take 24 ms to identify and read
stored ones.
"""


CHAINS = """## Many links

The walker of this section is a chain of links: a torso and two legs of equal links (absolute angles, one foot on the
ground, `PlanarProblem` with [lifted equations](concepts/optimisation.md)). The first table below lists, for several
numbers of links, the time per iteration, the number of nonzeros of the linear system of an iteration (Hessian,
Jacobian and diagonal), and the number of operations of its factorisation. The time is the minimum over all rounds; it
refers to the solve from the initial guess and, in the row "near an optimum", to solves at four other speeds that
start from the optimum at 0.7 m/s. The number of nonzeros grows linearly. The number of operations of one
factorisation (L D Lᵀ with a minimum-degree ordering, counted from the pattern) grows faster than quadratically on
both grids, because dense blocks contain unknowns of all links at a few nodes. A minimum cut of the graph of the system
shows why: at 21 links, 135 unknowns and Lagrange multipliers separate one half of the step from the other on both
grids, about three per link at each of two instants, whereas 171 on 4 intervals and 467 on 12 separate the lower halves
of both legs from the rest. Cuts between links are smaller only above about 27 links on 4 intervals and 70 links on 12.
On 12 intervals, the number of operations with nested dissection by METIS differs by at most 30 % from that in the
table.

The time grows more slowly than the number of operations, because MUMPS adds zeros to the small fronts of a short chain
and processes larger ones at a higher rate. From 5 to 21 links, measured once while other programs ran, the time of
one factorisation grows with the exponent 1.21 on 4 intervals and 1.47 on 12, that of one solution with the factors with
0.94 and 1.31, and that of the remaining parts of an iteration with at most 0.8. The evaluation of the functions takes
4 % of the time at 21 links. On 12 intervals, an iteration takes 2.2 factorisations on average at 5, 9 and 13 links and
2.4 at 21, since the Hessian is not positive definite; with a single one, the exponent from 5 to 21 links would still be
1.35. Minimum fill and other orderings take up to 20 % more time at 17 links.

Settings of Ipopt with fewer factorisations per iteration take more iterations. On 4 intervals with 5, 7, 9 and 13
links, Ipopt takes 23, 27, 30 and 45 iterations with 1.9 to 2.1 factorisations each. With a test of the curvature along
the step instead of the inertia (`neg_curv_test_tol` of 1e-11), it takes 40, 89, 58 and 120 iterations with 1.3 to 1.4
factorisations, and converges to other local optima: the cost at 5 links is 60.9 instead of 34.1. With this test, the
problem script `monopod` takes 72 iterations instead of 42, `telescoping_biped` 203 instead of 169 and
`compass_double_support` 21 instead of 28. If perturbations of the Hessian decrease more slowly (`perturb_dec_fact` of
0.7), the chains take 27, 52, 51 and 112 iterations with 1.9 to 2.0 factorisations.
"""

FIVE_LINKS = """The next table compares gaitopt with a plain script for CasADi's Opti, for a five-link walker of the
size of the robot RABBIT whose foot slips at touchdown (friction 0.2, 0.7 m/s, step length 0.4 m, 12 intervals in each
phase). The first row is the time to build and solve the same NLP with four points per interval; the second one is that
at default accuracy, for which gaitopt increases the number of points from four to six, whereas the script solves the
last NLP only.
"""

ROBOTS = """## Other robots

Processor time to solve and verify the gait of each problem script at default accuracy, without imports, measured once
by `python docs/make_gallery.py` while other programs ran. `hop_effort` and `leg_effort`, defined in the scripts, are
the integral of the squared hip torques plus 1e-3 m² times the squared leg forces:
"""

SWEEPS = """Gaits are continued from point to point on the grid of the problem by sequential quadratic programming;
the best gait of each point is then solved to the tolerance, for which its nodes are usually placed once more, and
replayed. If the Lagrange multipliers predict that the sweep in the reverse direction leads to the known gait of a
point, that gait is not solved again.
"""

REPEATED = """## Repeated solves of the cost of transport

A solve at friction 0.15 is warm-started from a gait at friction 0.14 with 40 intervals (0.633 m/s, step length
0.4713 m, torques up to 6 N m). *First* is a cold solve with a new robot, *cold* one with all Functions available, and
*again* the warm-started solve. All include refinement and checks.
"""

REPEATED_BESIDE = """Like gaitopt, the scripts for the other tools split the joint powers into positive and negative
parts: gaitopt at three points per interval, the script for Opti at two, and that for rockit at one. Each script is
compared with gaitopt at an equal number of intervals and at an equal number of slacks, which are the unknowns of the
split. The scripts do not bound the work between these points, so their costs are less accurate.
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
        chains(results),
        robots(),
        convergence(results),
        studies(results),
        repeated(results),
        made_with(results),
    ]
    (DOCS / "benchmarks.md").write_text("\n".join(parts), encoding="utf-8")


def beside(results):
    """Return the table with other tools."""
    tools, heads = select(results, "beside "), ["error", "first [s]", "again [s]"]
    lines = [row(["tool", *heads, "grid of gaitopt", *heads, "ratio first", "ratio again"])]
    lines.append("|---|---:|---:|---:|---|" + "---:|" * 5)
    for tool, numbers in tools.items():
        theirs = [f"{numbers['error']:.1e}", seconds(numbers["theirs_first"]), seconds(numbers["theirs_again"])]
        ours = [f"{abs(numbers['own_error']):.1e}", seconds(numbers["own_first"]), seconds(numbers["own_again"])]
        ratios = [spread(numbers["ratio_first"]), spread(numbers["ratio_again"])]
        lines.append(row([tool, *theirs, numbers["grid"], *ours, *ratios]))
    first, again = (middle([part[f"default_{what}"] for part in tools.values()]) for what in ("first", "again"))
    lines += ["", "On its default grid, 20 intervals of 4 points, the error of gaitopt is 1e-7, and it takes"]
    return "\n".join([*lines, f"{seconds(first)} s (first) and {seconds(again)} s (again).", ""])


def middle(spreads):
    """Return the spread with the middle median."""
    return sorted(spreads, key=lambda values: values[1])[len(spreads) // 2]


def growth(results):
    """Return the section on larger grids and other contact sequences."""
    lines = ["## Larger grids and other contact sequences", ""]
    lines += ["Solver time per iteration for squared torques in milliseconds, minimum of all rounds:", ""]
    for i, (name, numbers) in enumerate(select(results, "iteration, ").items()):
        if i == 0:
            lines.append(row(["intervals", *numbers["seconds"], "exponent"]))
            lines.append("|---|" + "---:|" * (len(numbers["seconds"]) + 1))
        values = [f"{1e3 * value:.1f}" for value in numbers["seconds"].values()]
        lines.append(row([name, *values, f"{numbers['exponent']:.2f}"]))
    build = results["build"]["numbers"]
    lines += ["", f"Building the NLP of `slip+ stick | slip+` takes {spread(build['ratio'])} times as long as"]
    times = f"{seconds(build['slip'])} s and {seconds(build['stick'])} s"
    lines += [f"that of `stick | stick`: {times}, without the robot.", ""]
    return "\n".join(lines)


def chains(results):
    """Return the section on walkers with many links and on the five-link walker."""
    tables, beside_opti = select(results, "chain of links, "), select(results, "five links beside Opti, ")
    operations = select(results, "operations of a chain, ")
    if not tables or not beside_opti:
        return ""
    links = [str(count) for count in next(iter(tables.values()))["links"]]
    lines = [CHAINS, row(["grid and quantity", *links, "exponent"]), "|---|" + "---:|" * (len(links) + 1)]
    for intervals, numbers in tables.items():
        times = [f"{1e3 * value:.1f}" for value in numbers["seconds"]]
        lines.append(row([f"{intervals}, time [ms]", *times, f"{numbers['exponents']['time']:.2f}"]))
        if "near" in intervals:  # the system is that of the same grid
            continue
        counts = [str(count) for count in numbers["nonzeros"]]
        lines.append(row([f"{intervals}, nonzeros", *counts, f"{numbers['exponents']['nonzeros']:.2f}"]))
        if intervals in operations:
            counted = operations[intervals]
            millions = [f"{value / 1e6:.2f}" for value in counted["operations"]]
            growth = f"{counted['exponents']['operations']:.2f}"
            lines.append(row([f"{intervals}, operations [million]", *millions, growth]))
    heads = ["gaitopt [s]", "Opti [s]", "ratio", "iterations of gaitopt", "iterations of Opti"]
    lines += ["", FIVE_LINKS, row(["grid", *heads]), "|---|" + "---:|" * len(heads)]
    for name, numbers in beside_opti.items():
        values = [seconds(numbers["own"]), seconds(numbers["plain"]), spread(numbers["ratio"])]
        counts = [str(numbers[f"{tool} iterations"]) for tool in ("own", "plain")]
        lines.append(row([name, *values, *counts]))
    return "\n".join([*lines, ""])


def robots():
    """Return the section on the problem scripts, from the table of the gallery."""
    table = json.loads((DOCS / "gallery.json").read_text(encoding="utf-8"))
    solved = {name: entry for name, entry in table.items() if "objective" in entry}
    lines = [ROBOTS, row(["script", "robot", "contact sequence", "objective", "time [s]"]), "|---|---|---|---|---:|"]
    for name, entry in sorted(solved.items(), key=lambda item: item[1]["seconds"]):
        sequence = f"`{entry['sequence']}`".replace("|", "\\|")
        lines.append(row([name, entry["robot"], sequence, f"`{entry['objective']}`", f"{entry['seconds']:.2g}"]))
    return "\n".join([*lines, ""])


def convergence(results):
    """Return the section with the cost over the grid."""
    lines = ["## Convergence", ""]
    lines += [
        "Cost of transport at friction 0.14, 0.633 m/s, step length 0.4713 m and torques up to 6 N m, for four stated",
        "numbers of intervals. The numbers of intervals of the phases are in parentheses; a slip phase has a quarter",
        "of the stated number, but at least 5, and all numbers are doubled if the plan violates a contact mode between",
        "nodes.",
        "",
    ]
    for i, (sequence, table) in enumerate(select(results, "convergence, ").items()):
        if i == 0:
            counts = list(next(iter(table.values())))
            lines += [row(["contact sequence", "method", *counts]), "|---|---|" + "---:|" * len(counts)]
        for method, values in table.items():
            cells = [f"{cost:.6f} ({'+'.join(map(str, grid))})" for cost, grid in values.values()]
            lines.append(row([f"`{sequence}`".replace("|", "\\|"), method, *cells]))
    return "\n".join([*lines, ""])


def studies(results):
    """Return the section on sweeps."""
    if "sweep" not in results:
        return ""
    numbers, machine = results["sweep"]["numbers"], results["sweep"]["machine"]
    return (
        "## Sweeps\n\n"
        "A sweep over 26 friction coefficients from 0.1 to 0.25 and two contact sequences (52 gaits, each solved in\n"
        f"both directions and replayed) takes {numbers['one']:.1f} s, which equals {numbers['solves']:.1f} cold solves "
        f"of {numbers['cold']:.2f} s. Two workers are\n{numbers['speed_up']:.2f} times as fast as one. "
        f"Times are wall-clock times and include imports ({machine}).\n\n"
        f"{SWEEPS}"
    )


def repeated(results):
    """Return the section on repeated solves of the cost of transport."""
    table = select(results, "repeated solve, ")
    if not table:
        return ""
    heads = ["first [s]", "cold [s]", "again [s]", "ratio to first", "ratio to cold"]
    lines = [REPEATED, row(["contact sequence", *heads]), "|---|" + "---:|" * 5]
    for sequence, numbers in table.items():
        values = [seconds(numbers[name]) for name in ("first", "cold", "again")]
        values += [spread(numbers[name]) for name in ("ratio_first", "ratio_cold")]
        lines.append(row([f"`{sequence}`".replace("|", "\\|"), *values]))
    heads = ["cost at 0.14", "again [s]", "gaitopt again [s]", "ratio"]
    lines += ["", REPEATED_BESIDE, row(["tool", "intervals", *heads]), "|---|---|" + "---:|" * 4]
    for name, numbers in select(results, "repeated solve beside ").items():
        tool, equal = name.split(", equal ")
        values = [f"{numbers['cost']:.6f}", seconds(numbers["theirs"]), seconds(numbers["own"])]
        lines.append(row([tool, f"{numbers['intervals']}, equal {equal}", *values, spread(numbers["ratio"])]))
    return "\n".join([*lines, ""])


def made_with(results):
    """Return the section with date, machine and versions of each measurement."""
    lines = ["## Versions", ""]
    for name, part in results.items():
        versions = ", ".join(f"{package} {version}" for package, version in part["versions"].items())
        title = name.replace(" beside ", ", comparison with ").replace("beside ", "comparison with ")
        lines.append(f"- {title}: {part['date']}, Python {part['python']}, {part['machine']}, {versions}")
    return "\n".join([*lines, ""])


def select(results, start):
    """Return the numbers of all parts whose name has the given start, by the rest of the name."""
    return {name[len(start) :]: part["numbers"] for name, part in results.items() if name.startswith(start)}


def seconds(values):
    """Format a spread of seconds."""
    return spread(values, ".3f")


def spread(values, form=".2f"):
    """Format the median with the quartiles in parentheses."""
    low, median, high = (format(value, form) for value in values)
    return median if low == high else f"{median} ({low}-{high})"


def row(cells):
    """Return a row of a table."""
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    main()
