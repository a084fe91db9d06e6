"""Compass biped: largest multiplier of Gaits A, B and C as a function of friction, with the stability limit."""

import math

import numpy as np
from compass_setup import FRICTION, SEQUENCES, gait
from drawing import GAIT_STYLE, STYLE
from matplotlib.ticker import NullFormatter, ScalarFormatter
from published import check_value

from gaitopt import WalkProblem, compass_biped, trace
from gaitopt.study import PublishedValue, Reproduction


def study(friction=FRICTION, least=0.05, most=0.4, starts=40):
    """Return the study; Gaits A and B are one branch, traced from Gait A; Gait C is traced from `friction`."""
    cycles = {name: gait(name, math.inf if name == "A" else friction, starts) for name in "ABC"}
    branches = {
        "A": _trace(gait("A", most, starts), most, least),
        "C": _trace(cycles["C"], least, most),
    }
    lines = {
        "A": _part(branches["A"], lambda sequence: sequence == SEQUENCES["A"]),
        "B": _part(branches["A"], lambda sequence: "slip" in sequence and sequence.endswith("| stick")),
        "C": _part(branches["C"], lambda sequence: sequence == SEQUENCES["C"]),
    }
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
    return Reproduction(figure, _numbers(cycles), tuple(_remarks(branches)))


def _trace(start, first, last):
    """Return the branch of a gait over a range of friction."""
    problem = WalkProblem(robot=compass_biped(), parameters=start.parameters)
    return trace(problem, {"friction": (first, last)}, start=start).branches[0]


def _part(branch, belongs):
    """Return frictions and largest moduli of the gaits of a branch whose contact sequence belongs to a type."""
    rows = [
        (value, radius)
        for value, radius, sequence in zip(branch.values, branch.radii, branch.sequences, strict=True)
        if belongs(sequence)
    ]
    return np.array(sorted(rows)).T


def _remarks(branches):
    """Yield what happens at the special points of the branches."""
    onset, second = branches["A"].special_of("slip_onset")
    yield (
        f"Between mu = {second.value:.4f} and {onset.value:.4f} Gait B slips only immediately after touchdown "
        f"({second.before})."
    )
    for point in branches["A"].special_of("neimark_sacker"):
        yield f"Gait B is stable above mu = {point.value:.4f}."
    for point in branches["A"].special_of("impact_cone"):
        yield f"Gait B ends at mu = {point.value:.4f}, where its impact starts to slip."
    for point in branches["C"].special_of("impact_cone"):
        yield f"Gait C joins the second, unstable sticking gait at mu = {point.value:.4f}."


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
