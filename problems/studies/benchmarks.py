"""Independent benchmarks: multipliers of a rimless wheel, the simplest walker and Goswami's compass, without slip.

The simplest walker is the limit of vanishing leg mass. A leg of zero mass makes the mass matrix singular, so compass
bipeds with decreasing leg masses are extrapolated to the limit.
"""

import math

import numpy as np
from drawing import STYLE
from numpy.polynomial import Polynomial
from published import CLOSED_FORM, OWN, check_value
from rimless_closed_forms import gait_speed, velocity_ratio

from gaitopt import WalkProblem, compass_biped, find_cycles, rimless_wheel, trace
from gaitopt.continuation import gaits_at
from gaitopt.study import PublishedValue, Reproduction

SIMPLEST = {
    "th1": -0.2003109005442,
    "th1_rate": 0.1998324730050,
    "real": -0.1900998410659,
    "imaginary": 0.5575987766821,
}
UNIT = "rad/sqrt(l/g)"
SIMPLEST_COLOR = "#D55E00"
"""Colour of the simplest walker in both panels."""


def study(heaviest=0.01, lighter=0.7, ratios=8, degree=5, starts=40):  # leg mass / hip mass, a geometric series
    """Return the study."""
    wheel = find_cycles(rimless_wheel(), _wheel(), starts=10)[0]
    goswami = find_cycles(compass_biped(), _goswami(), starts=starts)[0]
    masses = heaviest * lighter ** np.arange(ratios)
    light = _light_legs(masses, starts)
    limit = {name: Polynomial.fit(masses, values, degree)(0.0) for name, values in light.items()}
    with STYLE.figure(3.4) as figure:
        left, right = figure.subplots(1, 2)
        _draw_limit(left, masses, light, limit)
        _draw_multipliers(right, wheel, limit, goswami)
    return Reproduction(figure, (*_wheel_numbers(wheel), *_simplest_numbers(limit), *_goswami_numbers(goswami)))


def _wheel():
    return {"spokes": 6, "inertia_ratio": 0.5, "slope": 0.2, "leg_length": 1, "mass": 1, "gravity": 1}


def _goswami():
    masses = {"leg_mass": 5, "hip_mass": 10, "leg_length": 1, "leg_com": 0.5}
    return {**masses, "slope": math.radians(3), "gravity": 9.81}


def _light_legs(masses, starts):
    """Return state, and sum and product of the pair of multipliers, for each leg mass.

    Unlike the multipliers, their sum and product remain smooth where the pair becomes complex.
    """
    parameters = {"leg_length": 1, "leg_com": 0, "hip_mass": 1, "slope": 0.009, "gravity": 1}
    start = find_cycles(compass_biped(), {**parameters, "leg_mass": masses[0]}, starts=starts)[0]
    problem = WalkProblem(robot=compass_biped(), parameters=parameters)
    diagram = trace(problem, {"leg_mass": (masses[0], masses[-1])}, start=start)
    cycles = [gaits_at(problem, diagram, mass)[0] for mass in masses]
    multipliers = np.array([cycle.multipliers for cycle in cycles])
    return {
        "th1": np.array([cycle.state["th1"] for cycle in cycles]),
        "th1_rate": np.array([cycle.state["th1_rate"] for cycle in cycles]),
        "sum": (multipliers[:, 0] + multipliers[:, 1]).real,
        "product": (multipliers[:, 0] * multipliers[:, 1]).real,
        "third": multipliers[:, 2].real,
    }


def _pair(limit):
    """Return real and imaginary part of a complex pair from its sum and product."""
    return limit["sum"] / 2, math.sqrt(limit["product"] - limit["sum"] ** 2 / 4)


def _wheel_numbers(cycle):
    name, value, multiplier = "rimless wheel n = 6, kappa = 1/2", cycle.state["theta_rate"], cycle.multipliers[0].real
    exact = gait_speed(6, 0.5, 0.2) / math.sqrt(1.5)  # tau_c = sqrt(1.5 l / g)
    return (
        PublishedValue(f"{name}: theta_rate after impact", value, 0.460341126609, 1e-12, OWN, UNIT),
        PublishedValue(f"{name}: theta_rate after impact, closed form", value, exact, 1e-12, CLOSED_FORM, UNIT),
        PublishedValue(f"{name}: multiplier 4/9", multiplier, velocity_ratio(6, 0.5) ** 2, 1e-12, CLOSED_FORM),
    )


def _simplest_numbers(limit):
    name, values = "simplest walker", dict(limit)
    values["real"], values["imaginary"] = _pair(limit)
    units = {"th1": "rad", "th1_rate": UNIT}
    labels = {"real": "real part of multipliers 1, 2", "imaginary": "imaginary part of multipliers 1, 2"}
    numbers = [
        PublishedValue(f"{name}: {labels.get(key, key)}", float(values[key]), reference, 1e-9, OWN, units.get(key, "1"))
        for key, reference in SIMPLEST.items()
    ]
    return (*numbers, PublishedValue(f"{name}: multiplier 3", float(limit["third"]), 0.0, 1e-9, OWN))


def _goswami_numbers(cycle):
    printed = {"th1": "-0.2710286805", "th1_rate": "1.0923835899", "th2_rate": "-0.3773739489"}
    units = {"th1": "rad", "th1_rate": "rad/s", "th2_rate": "rad/s"}
    states = [
        check_value(f"Goswami's compass: {k}", cycle.state[k], text, units[k], OWN) for k, text in printed.items()
    ]
    return (*states, check_value("Goswami's compass: period", cycle.period, "0.7343464", "s", OWN))


def _draw_limit(axes, masses, light, limit):
    """Plot the distance of the walkers with light legs from the extrapolated limit."""
    names = {"th1": (r"$\theta_1$ [rad]", "o"), "th1_rate": (r"$\dot\theta_1$ [rad$/\sqrt{l/g}$]", "s")}
    names |= {"sum": ("sum of pair", "^"), "product": ("product of pair", "v")}
    look = {"color": SIMPLEST_COLOR, "linestyle": "-", "linewidth": 0.8, "markersize": 4.5}
    for key, (label, marker) in names.items():
        fill = {"markerfacecolor": "white"} if key in ("sum", "product") else {}
        axes.loglog(masses, np.abs(light[key] - limit[key]), marker, label=label, **look, **fill)
    axes.set(xlabel="leg mass / hip mass", ylabel="distance to the extrapolated limit", title="simplest walker")
    axes.set_ylim(None, 300 * axes.get_ylim()[1])
    axes.legend(loc="upper left", borderaxespad=0.2)


def _draw_multipliers(axes, wheel, limit, goswami):
    """Plot the multipliers of all benchmarks in the unit circle, with the references as crosses."""
    turn = np.linspace(0, 2 * np.pi, 181)
    axes.plot(np.cos(turn), np.sin(turn), **STYLE.limit_line)
    real, imaginary = _pair(limit)
    simplest = np.array([real + 1j * imaginary, real - 1j * imaginary, limit["third"]])
    sets = {
        "rimless wheel, $n$ = 6": (wheel.multipliers, "o", "#0072B2"),
        "simplest walker": (simplest, "s", SIMPLEST_COLOR),
        "Goswami's compass": (goswami.multipliers, "^", "#009E73"),
    }
    for label, (values, marker, color) in sets.items():
        axes.plot(values.real, values.imag, marker, color=color, markersize=6, linestyle="none", label=label)
    pair = SIMPLEST["real"] + 1j * SIMPLEST["imaginary"] * np.array([1, -1])
    references = np.array([4 / 9, *pair, 0])
    axes.plot(references.real, references.imag, "x", color="black", markersize=4.5, linestyle="none", label="reference")
    axes.set(xlabel="real part", ylabel="imaginary part", title="multipliers", aspect="equal", xlim=(-1.1, 1.1))
    axes.figure.legend(*axes.get_legend_handles_labels(), loc="outside lower right", ncols=4, handlelength=1)


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
