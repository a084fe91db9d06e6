import math

import numpy as np
import pytest

from gaitopt import compass_biped, rimless_wheel
from gaitopt.control.law import passive
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.scipy_engine import ScipyEngine
from gaitopt.stability.cycle_search import find_cycle


@pytest.fixture(scope="session")
def cycle():
    """Return a function (robot, parameters, start on the section with foot speed) -> Cycle, remembered."""
    known = {}

    def find(robot, parameters, z):
        key = (robot.name, tuple(sorted(parameters.items())), tuple(z))
        if key not in known:
            p = robot.vector(robot.resolve(parameters))
            known[key] = find_cycle(Walker(robot, passive(robot), p, ScipyEngine()), np.array(z, dtype=float))
        assert known[key] is not None, "Newton's method found no gait"
        return known[key]

    return find


COMPASS = {"slope": math.radians(1)}
WHEEL = {"slope": math.radians(13)}
NATURAL_TIME = math.sqrt((1 + 1 / 3) / 9.8)  # tau_c of the default wheel [s]
COMPASS_THREE = {"leg_length": 1, "leg_com": 0.4, "leg_mass": 5.5, "hip_mass": 4.5, "slope": 0.005, "friction": 0.047}
COMPASS_FIVE = {"leg_length": 1, "leg_com": 0.06, "leg_mass": 5.2, "hip_mass": 3.6, "slope": 0.0138, "friction": 0.0233}
WHEEL_THREE = {"spokes": 6, "inertia_ratio": 2.4, "slope": math.radians(10.3), "friction": 0.186}

# Every kind of passive gait of the study, and others, by its number of stick-slip events: robot, parameters, start.
GAITS = {
    "compass A, no event": (compass_biped, {**COMPASS, "friction": 0.3}, [-0.1478, 0.7328, -0.5007, 0]),
    "compass C, one event": (compass_biped, {**COMPASS, "friction": 0.14}, [-0.0790, 0.0438, -0.4318, 0.6342]),
    "compass B, two events": (compass_biped, {**COMPASS, "friction": 0.14}, [-0.1408, 0.7102, -0.5168, 0]),
    "wheel A, no event": (rimless_wheel, {**WHEEL, "friction": 1.0}, [2.4, 0]),
    "wheel B, one event": (rimless_wheel, {**WHEEL, "friction": 0.3}, [2.4, 0]),
    "wheel B, two events": (rimless_wheel, {**WHEEL, "friction": 0.25}, [2.39, 0]),
    "wheel C, two events": (rimless_wheel, {**WHEEL, "friction": 0.24}, [2.37, 0.03]),
    # Found by a search over random slopes, frictions, masses and numbers of spokes.
    "compass, three events": (compass_biped, COMPASS_THREE, [-0.0660, 0.5106, -0.4812, -0.0534]),
    "compass, five events": (compass_biped, COMPASS_FIVE, [-0.1100, 0.9519, -0.9324, -0.0463]),
    "wheel, three events": (rimless_wheel, WHEEL_THREE, [1.6724, 0]),
    "wheel D, complete slip": (rimless_wheel, {**WHEEL, "friction": 0.3}, [2.9, 2.5]),
}


@pytest.fixture(params=GAITS, ids=lambda name: name.replace(", ", "-").replace(" ", "_"))
def study_gait(request, cycle):
    robot, parameters, z = GAITS[request.param]
    return robot(), parameters, cycle(robot(), parameters, z)
