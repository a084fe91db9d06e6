"""check_robot: the catalogue passes, a robot with any part broken does not."""

import dataclasses

import casadi as ca
import numpy as np
import pytest

from gaitopt import InputError, Mode, check_robot
from gaitopt.model import robot_named
from gaitopt.model.robots.catalogue import CATALOGUE
from tests.walkers.sprung_compass import sprung_compass

PARAMETERS = {
    "compass_biped": [
        {},
        {"friction": 1.2, "slope": -0.1},
        {"leg_mass": 0.1, "hip_mass": 10.0, "leg_com": 0.0},
        {"leg_length": 0.4, "leg_com": 0.3, "gravity": 1.6, "friction": 0.0},
    ],
    "rimless_wheel": [{}, {"spokes": 6, "inertia_ratio": 0.5, "slope": 0.2}, {"mass": 30.0, "friction": 0.05}],
}


@pytest.mark.parametrize("name", CATALOGUE)
def test_catalogue_passes(name):
    for seed, parameters in enumerate(PARAMETERS.get(name, [{}])):
        assert check_robot(robot_named(name), parameters, seed=seed, states=8).passed, parameters


def changed(function, change):
    """Return a Function with the same interface whose outputs have been changed."""
    inputs = [ca.SX.sym(function.name_in(i), function.sparsity_in(i)) for i in range(function.n_in())]
    outputs = function(*inputs)
    outputs = change(*outputs) if function.n_out() > 1 else [change(outputs)]
    names = [function.name_out(i) for i in range(function.n_out())]
    return ca.Function(function.name(), inputs, list(outputs), list(function.name_in()), names)


def broken_acceleration(robot, mode, change):
    return {"acceleration": {**robot.acceleration, mode: changed(robot.acceleration[mode], change)}}


BREAKS = {
    "mass matrix not symmetric": (
        "asymmetry",
        lambda r: {"dynamics": changed(r.dynamics, lambda m, h, e: (m + 0.1 * ca.DM(np.eye(4, k=1)), h, e))},
    ),
    "mass matrix not positive": (
        "least_eigenvalue",
        lambda r: {"dynamics": changed(r.dynamics, lambda m, h, e: (m - 10 * ca.DM.eye(4), h, e))},
    ),
    "mass matrix negative": (
        "least_eigenvalue",
        lambda r: {"dynamics": changed(r.dynamics, lambda m, h, e: (-m, h, e))},
    ),
    "mass matrix a percent high": (
        "contact",
        lambda r: {"dynamics": changed(r.dynamics, lambda m, h, e: (1.01 * m, h, e))},
    ),
    "gravity and Coriolis terms a percent low": (
        "contact",
        lambda r: {"dynamics": changed(r.dynamics, lambda m, h, e: (m, 0.99 * h, e))},
    ),
    "inverse dynamics a percent high": (
        "contact",
        lambda r: {"inverse_dynamics": changed(r.inverse_dynamics, lambda f: 1.01 * f)},
    ),
    "hip torque on one leg only": (
        "contact",
        lambda r: {
            "dynamics": changed(r.dynamics, lambda m, h, e: (m, h, e * ca.DM([[1, 1], [1, 1], [1, 0], [1, 1]])))
        },
    ),
    "kinetic energy a percent high": (
        "energy",
        lambda r: {"energy": changed(r.energy, lambda t, v: (1.01 * t, v))},
    ),
    "gravity a little weak": ("force", lambda r: {"mass": changed(r.mass, lambda m: 0.999 * m)}),
    "force a percent high": (
        "force",
        lambda r: broken_acceleration(r, Mode.STICK, lambda a, f: (a, 1.01 * f)),
    ),
    "friction law of the other sign": (
        "contact",
        lambda r: {"acceleration": {**r.acceleration, Mode.SLIP_FORWARD: r.acceleration[Mode.SLIP_BACKWARD]}},
    ),
    "angular momentum of one sign only": (
        "momentum",
        lambda r: {"momentum": changed(r.momentum, lambda p, a: (p, -a))},
    ),
    "landing foot elsewhere": (
        "exchange",
        lambda r: {"landing": changed(r.landing, lambda x, v, j: (x + ca.DM([0.01, 0]), v, j))},
    ),
    "landing foot at another height": (
        "momentum",
        lambda r: {"landing": changed(r.landing, lambda x, v, j: (x + ca.DM([0, 0.01]), v, j))},
    ),
    "landing foot's Jacobian a percent high": (
        "momentum",
        lambda r: {"landing": changed(r.landing, lambda x, v, j: (x, v, 1.01 * j))},
    ),
    "impact too soft": (
        "impact",
        lambda r: {"collision": changed(r.collision, lambda v, m, s: (0.99 * v, m, s))},
    ),
}


@pytest.mark.parametrize(("what", "breaking"), BREAKS.values(), ids=BREAKS.keys())
def test_a_broken_robot_fails_and_the_error_is_in_the_right_place(compass, what, breaking):
    check = check_robot(dataclasses.replace(compass, **breaking(compass)), states=5)
    assert not check.passed
    allowed = {"least_eigenvalue": 0.0, "energy": 1e-6, "force": 1e-6, "derivatives": 1e-6}.get(what, 1e-9)
    error = -check.least_eigenvalue if what == "least_eigenvalue" else getattr(check, what)
    assert error > allowed


@pytest.mark.parametrize("name", ["energy", "momentum", "landing"])
def test_a_robot_that_returns_nan_fails(compass, name):
    broken = changed(getattr(compass, name), lambda *outputs: [output * np.nan for output in outputs])
    assert not check_robot(dataclasses.replace(compass, **{name: broken}), states=2).passed


def test_infinite_friction_is_refused(compass):
    with pytest.raises(InputError, match="finite friction"):
        check_robot(compass, {"friction": np.inf})


@pytest.mark.parametrize("names", [("spring",), ("potential",), ("damper",), ("rotor",), ("spring", "damper", "rotor")])
def test_springs_dampers_and_rotors_pass(names):
    for seed, parameters in enumerate([{}, {"friction": 1.2, "slope": -0.1, "leg_mass": 0.5}]):
        report = check_robot(sprung_compass(*names), parameters, seed=seed, states=8)
        assert report.passed, report


def scaled(robot, function, name, factor):
    """Return a Function of a robot in which one parameter, the last input's, has another value."""
    symbols, number = function.sx_in(), robot.index(name)
    p = ca.vertcat(*[factor * x if i == number else x for i, x in enumerate(ca.vertsplit(symbols[-1]))])
    outputs = function.call([*symbols[:-1], p])
    return ca.Function(function.name(), symbols, outputs, function.name_in(), function.name_out())


def scaled_accelerations(robot, name, factor):
    modes = robot.acceleration.items()
    return {"acceleration": {mode: scaled(robot, function, name, factor) for mode, function in modes}}


FORCE_BREAKS = {
    "dissipation doubled": ("energy", lambda r: {"force_powers": scaled(r, r.force_powers, "hip_damping", 2)}),
    "dissipation forgotten": ("energy", lambda r: {"force_powers": scaled(r, r.force_powers, "hip_damping", 0)}),
    "dissipation nan": ("energy", lambda r: {"force_powers": scaled(r, r.force_powers, "hip_damping", np.nan)}),
    "damping of the accelerations a percent high": ("energy", lambda r: scaled_accelerations(r, "hip_damping", 1.01)),
    "damping of the other sign": ("energy", lambda r: scaled_accelerations(r, "hip_damping", -1)),
    "stiffness of the accelerations a percent low": (
        "energy",
        lambda r: scaled_accelerations(r, "hip_stiffness", 0.99),
    ),
    "damping of the bias a percent high": (
        "contact",
        lambda r: {"dynamics": scaled(r, r.dynamics, "hip_damping", 1.01)},
    ),
    "rotor forgotten in the mass matrix": (
        "contact",
        lambda r: {"dynamics": scaled(r, r.dynamics, "rotor_inertia", 0)},
    ),
    "kinetic energy without the rotor": ("energy", lambda r: {"energy": scaled(r, r.energy, "rotor_inertia", 0)}),
    "elastic energy a percent high": (
        "momentum",  # that of gravity, the potential energy less the elastic energy, is then wrong, too
        lambda r: {"force_powers": scaled(r, r.force_powers, "hip_stiffness", 1.01)},
    ),
}


@pytest.mark.parametrize(("what", "breaking"), FORCE_BREAKS.values(), ids=FORCE_BREAKS.keys())
def test_a_robot_with_a_wrong_force_fails(what, breaking):
    robot = sprung_compass("spring", "damper", "rotor")
    check = check_robot(dataclasses.replace(robot, **breaking(robot)), states=5)
    assert not check.passed
    assert not getattr(check, what) <= {"energy": 1e-6}.get(what, 1e-9)


def test_a_spring_that_favours_one_leg_is_refused():
    """Its energy jumps at the leg exchange, although no body moves."""
    robot = sprung_compass("spring", rest=0.1)
    check = check_robot(robot, states=5)
    assert not check.passed
    assert check.exchange > 1e-3
    assert "changes the elastic energy" in check.faults[0]
    assert "springs and potentials must be the same for both legs" in check.faults[0]
