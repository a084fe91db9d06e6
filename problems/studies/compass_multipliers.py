"""Compass biped: largest multiplier of Gaits A, B and C as a function of friction, with the stability limit."""

import math

import numpy as np
from compass_setup import FRICTION, gait
from drawing import GAIT_STYLE, STYLE
from matplotlib.ticker import NullFormatter, ScalarFormatter
from published import check_value

from gaitopt import compass_biped, trace_branch
from gaitopt.study import PublishedValue, Reproduction


def study(friction=FRICTION, points=25, least=0.05, most=0.4, starts=40):  # points per part of a branch
    """Return the study; Gaits B and C are found at `friction` and followed from there."""
    cycles = {name: gait(name, math.inf if name == "A" else friction, starts) for name in "ABC"}
    lines, remarks = _lines(cycles, np.linspace(friction, most, points), np.linspace(friction, least, points))
    with STYLE.figure(3.6) as figure:
        axes = figure.subplots()
        for name, (frictions, radii) in lines.items():
            axes.plot(frictions, radii, label=f"Gait {name}", **GAIT_STYLE[name])
        axes.axhline(1, label="stability limit", **STYLE.limit_line)
        axes.set(xlabel=r"friction $\mu$", ylabel="largest modulus of a multiplier", xlim=(least, most))
        axes.set(yscale="log", ylim=(0.6, 8), yticks=[0.6, 0.8, 1, 1.5, 2, 3, 4, 6, 8])
        axes.yaxis.set_major_formatter(ScalarFormatter())
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.legend(loc="upper right", handlelength=3.2)
    return Reproduction(figure, _numbers(cycles), remarks)


def _lines(cycles, upward, downward):
    """Return frictions and largest moduli of each gait, and remarks on the ends of the branches."""
    critical = cycles["A"].critical_friction.friction
    # Just below the critical friction Gait B slips after touchdown only, so its contact sequence may change here.
    above = _follow(cycles["B"], np.linspace(upward[0], critical, len(upward)), same_sequence=False)
    below = _follow(cycles["B"], downward)
    c_above, c_below = (_follow(cycles["C"], values) for values in (upward, downward))
    lines = {
        "A": (np.array([critical, upward[-1]]), np.full(2, cycles["A"].radius)),
        "B": _join(above, below),
        "C": _join(c_above, c_below),
    }
    change = above.changes("sequence")[0]
    remarks = [
        f"Between mu = {change.value:.4f} and {critical:.4f} Gait B slips only immediately after touchdown "
        f"({change.after}).",
    ]
    remarks += [f"Gait B is stable above mu = {point.value:.4f}." for point in below.changes("stability")]
    if below.values[-1] > downward[-1]:
        remarks.append(f"Gait B ends at mu = {below.values[-1]:.4f}, where its impact starts to slip.")
    if c_above.values[-1] < upward[-1]:
        remarks.append(f"Gait C joins the second, unstable sticking gait at mu = {c_above.values[-1]:.4f}.")
    return lines, tuple(remarks)


def _follow(start, frictions, same_sequence=True):
    return trace_branch(compass_biped(), start.parameters, start, {"friction": frictions}, same_sequence=same_sequence)


def _join(*branches):
    """Return frictions and largest moduli along parts of a branch, in order of friction."""
    rows = [(mu, cycle.radius) for part in branches for mu, cycle in zip(part.values, part.cycles, strict=True)]
    return np.array(sorted(rows)).T


def _numbers(cycles):
    """Return the multipliers of each gait with the published values."""
    a, b, c = (cycles[name].multipliers for name in "ABC")
    numbers = [
        check_value("Gait A: real part of multipliers 1, 2", a[0].real, "0.48361"),
        check_value("Gait A: imaginary part of multipliers 1, 2", abs(a[0].imag), "0.51892"),
        check_value("Gait A: modulus of multipliers 1, 2", abs(a[0]), "0.70933"),
        check_value("Gait A: multiplier 3", a[2].real, "0.38575"),
        check_value("Gait B: largest modulus of a multiplier", abs(b[0]), "0.8206"),
    ]
    for number, printed in enumerate(("1.8235", "-1.0695", "0.0579")):
        numbers.append(check_value(f"Gait C: multiplier {number + 1}", c[number].real, printed))
    numbers.append(PublishedValue("Gait C: modulus of multiplier 4", abs(c[3]), 0.0, 1e-10, "Gamus & Or 2015"))
    return tuple(numbers)


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
