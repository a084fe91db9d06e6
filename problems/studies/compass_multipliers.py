"""Compass biped: largest multiplier of Gaits A, B and C over friction, with the limit of stability."""

import math

import numpy as np
from branch_ends import follow
from compass_setup import FRICTION, gait
from drawing import GAIT_STYLE, STYLE
from matplotlib.ticker import NullFormatter, ScalarFormatter
from published import published
from scipy.optimize import brentq

from gaitopt import Number, Study, compass_biped, trace_branch


def study(friction=FRICTION, points=25, least=0.05, most=0.4, starts=100):  # points per stretch of a branch
    """Return the study; Gaits B and C are looked for at `friction` and followed from there."""
    cycles = {name: gait(name, math.inf if name == "A" else friction, starts) for name in "ABC"}
    lines, remarks = _lines(cycles, np.linspace(friction, most, points), np.linspace(friction, least, points))
    with STYLE.figure(3.6) as figure:
        axes = figure.subplots()
        for name, (frictions, radii) in lines.items():
            axes.plot(frictions, radii, label=f"Gait {name}", **GAIT_STYLE[name])
        axes.axhline(1, label="limit of stability", **STYLE.limit_line)
        axes.set(xlabel=r"friction $\mu$", ylabel="largest modulus of a multiplier", xlim=(least, most))
        axes.set(yscale="log", ylim=(0.6, 8), yticks=[0.6, 0.8, 1, 1.5, 2, 3, 4, 6, 8])
        axes.yaxis.set_major_formatter(ScalarFormatter())
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.legend(loc="upper right", handlelength=3.2)
    return Study(figure, _numbers(cycles), remarks)


def _lines(cycles, upward, downward):
    """Return frictions and largest moduli of each gait, and what is seen where branches end."""
    robot, critical = compass_biped(), cycles["A"].critical_friction.friction
    first = follow(robot, cycles["B"], "friction", upward, 1e-5)
    # Between its two critical frictions Gait A's successor slips after the touchdown only; followed whatever its word.
    between = np.linspace(first.end, critical, 4)
    above = trace_branch(robot, first.cycles[-1].parameters, first.cycles[-1], "friction", between)
    below = follow(robot, cycles["B"], "friction", downward, 1e-5)
    c_above, c_below = (follow(robot, cycles["C"], "friction", values, 1e-5) for values in (upward, downward))
    lines = {
        "A": (np.array([critical, upward[-1]]), np.full(2, cycles["A"].radius)),
        "B": _joined(first, above, below),
        "C": _joined(c_above, c_below),
    }
    remarks = [
        f"Between mu = {first.end:.4f} and {critical:.4f} Gait B slips only just after the touchdown "
        f"({above.cycles[-2].word}).",
    ]
    if not below.cycles[-1].stable:
        remarks.append(f"Gait B is stable above mu = {_stability_limit(below):.4f}.")
    if below.end > downward[-1]:
        remarks.append(f"Gait B ends at mu = {below.end:.4f}, where its impact begins to slip.")
    if c_above.end < upward[-1]:
        remarks.append(f"Gait C joins the second, unstable sticking gait at mu = {c_above.end:.4f}.")
    return lines, tuple(remarks)


def _joined(*stretches):
    """Return frictions and largest moduli along stretches of a branch, in order of friction."""
    rows = [(mu, cycle.radius) for part in stretches for mu, cycle in zip(part.values, part.cycles, strict=True)]
    return np.array(sorted(rows)).T


def _stability_limit(stretch):
    """Return the friction at which a gait that is stable at the start of a stretch loses its stability."""
    robot, last = compass_biped(), next(k for k, cycle in enumerate(stretch.cycles) if not cycle.stable)
    start = stretch.cycles[last - 1]

    def excess(friction):
        return trace_branch(robot, start.parameters, start, "friction", [friction]).cycles[-1].radius - 1

    return brentq(excess, stretch.values[last], stretch.values[last - 1], xtol=1e-6)


def _numbers(cycles):
    """Return the multipliers of each gait beside the study's."""
    a, b, c = (cycles[name].multipliers for name in "ABC")
    numbers = [
        published("Gait A: real part of multipliers 1, 2", a[0].real, "0.48361"),
        published("Gait A: imaginary part of multipliers 1, 2", abs(a[0].imag), "0.51892"),
        published("Gait A: modulus of multipliers 1, 2", abs(a[0]), "0.70933"),
        published("Gait A: multiplier 3", a[2].real, "0.38575"),
        published("Gait B: largest modulus of a multiplier", abs(b[0]), "0.8206"),
    ]
    for number, printed in enumerate(("1.8235", "-1.0695", "0.0579")):
        numbers.append(published(f"Gait C: multiplier {number + 1}", c[number].real, printed))
    numbers.append(Number("Gait C: modulus of multiplier 4", abs(c[3]), 0.0, 1e-10, "Gamus & Or 2015"))
    return tuple(numbers)


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
