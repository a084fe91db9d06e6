"""A compass biped with a hip spring, and with all forces, walks downhill: gaits, exact multipliers and ledger."""

import numpy as np
import pytest

from gaitopt import find_cycles
from tests.walkers.sprung_compass import sprung_compass

from .test_multipliers import central_differences

WALKERS = {
    "spring": (("spring",), {"slope": np.deg2rad(1), "friction": 0.5}),
    "slipping spring": (("spring",), {"slope": np.deg2rad(1), "friction": 0.14, "hip_stiffness": 1.0}),
    "spring, damper and rotor": (("spring", "damper", "rotor"), {"slope": np.deg2rad(1.5), "friction": 0.5}),
}


@pytest.fixture(scope="module", params=WALKERS.values(), ids=WALKERS)
def walker(request):
    names, parameters = request.param
    robot = sprung_compass(*names)
    cycles = find_cycles(robot, parameters, starts=60)
    assert cycles
    return robot, parameters, cycles[0]


def test_exact_multipliers_are_those_of_finite_differences(walker):
    robot, parameters, cycle = walker
    assert cycle.residual < 1e-11
    numerical = central_differences(robot, parameters, cycle)
    np.testing.assert_allclose(cycle.derivative, numerical, atol=1e-6)
    values = sorted(np.linalg.eigvals(numerical), key=lambda value: (abs(value), value.imag))
    exact = sorted(cycle.multipliers, key=lambda value: (abs(value), value.imag))
    np.testing.assert_allclose(exact, values, atol=1e-6)


def test_the_ledger_of_the_gait_closes(walker):
    robot, _, cycle = walker
    energy = cycle.energy
    assert energy.relative_residual < 1e-8
    assert abs(energy.elastic_change) < 1e-9  # a periodic gait stores nothing
    assert (energy.damping_loss > 1e-3) == robot.has_dampers
    weight = float(robot.mass(robot.vector(cycle.parameters))) * 9.8
    assert energy.gravity == pytest.approx(weight * np.sin(cycle.parameters["slope"]) * cycle.travel, rel=1e-9)
    assert energy.losses == pytest.approx(energy.gravity, rel=1e-8)


def test_a_spring_makes_steps_shorter_in_time():
    """The swing leg is faster with a spring, so a step takes less time, the more so the stiffer the spring."""
    slope = {"slope": np.deg2rad(1), "friction": np.inf}
    periods = [
        find_cycles(sprung_compass("spring"), slope | {"hip_stiffness": k}, starts=20)[0].period
        for k in (0.0, 2.0, 4.0)
    ]
    assert periods[0] == pytest.approx(0.744620868, abs=1e-8)  # gait A of the compass without a spring
    assert periods[0] > periods[1] > periods[2]
