"""Random starts of the search for gaits, and states from which a fall is predicted without simulation."""

import math

import numpy as np
import pytest

from gaitopt import Stop, compass_biped, feedforward, find_cycles, load, passive, rimless_wheel
from gaitopt.model.uneven_ground import adapt_to_uneven_ground
from gaitopt.simulation import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.step_limits import StepLimits
from gaitopt.stability.cycle_iteration import search_section
from gaitopt.stability.fall_prediction import predict_falls
from gaitopt.stability.random_starts import _TouchdownSampler
from gaitopt.stability.return_map import ReturnMap
from tests.walkers.sprung_compass import sprung_compass

COMPASS, WHEEL = compass_biped(), rimless_wheel()
GOSWAMI = {"leg_mass": 5.0, "hip_mass": 10.0, "leg_length": 1.0, "leg_com": 0.5, "gravity": 9.81}


def make_walker(robot, law=None, **parameters):
    law, p = law or passive(robot), robot.vector(robot.resolve(parameters))
    return Walker(robot, law, p, default_engine(law, robot), step_limits=StepLimits(duration=10))


def draw_states(walker, count, seed=7):
    """Return states after random touchdowns."""
    sampler, rng = _TouchdownSampler(walker, search_section(walker)), np.random.default_rng(seed)
    samples = [rng.uniform(-1, 1, sampler.size) for _ in range(count)]
    states = (sampler.state_after(sample, at_rest=i % 2 == 0) for i, sample in enumerate(samples))
    return [state for state in states if state is not None]


WALKERS = {
    "slippery ground": make_walker(COMPASS, slope=math.radians(1), friction=0.08),
    "compass": make_walker(COMPASS, slope=math.radians(1), friction=0.14),
    "static friction": make_walker(COMPASS, slope=math.radians(1), friction=0.1, static_friction_ratio=2),
    "level ground": make_walker(COMPASS, slope=0.0, friction=0.2),
    "no slip": make_walker(COMPASS, slope=math.radians(3)),
    "heavy hip": make_walker(COMPASS, slope=math.radians(3), friction=0.2, **GOSWAMI),
    "heavy legs": make_walker(COMPASS, slope=math.radians(1), friction=0.15, leg_mass=5.0, hip_mass=2.0),
    "wheel": make_walker(WHEEL, slope=math.radians(13), friction=0.25),
}


@pytest.mark.parametrize("name", WALKERS)
def test_no_step_is_completed_from_an_excluded_state(name):
    walker = WALKERS[name]
    prediction = predict_falls(walker)
    excluded = [state for state in draw_states(walker, 3000) if prediction.excludes(state)]
    assert len(excluded) >= 20
    assert {walker.walk_step(state).stop for state in excluded} <= {Stop.FELL, Stop.LIFT_OFF}


def test_most_falls_on_slippery_ground_are_predicted():
    walker = WALKERS["compass"]
    prediction, states = predict_falls(walker), draw_states(walker, 200)
    falls = [state for state in states if walker.walk_step(state).stop is Stop.FELL]
    assert sum(map(prediction.excludes, falls)) > 0.6 * len(falls) > 20


def test_walkers_that_torques_springs_or_ground_may_lift_have_no_prediction():
    gait = load("docs/examples/compass_slip.h5")
    assert predict_falls(make_walker(COMPASS, feedforward(COMPASS, gait.motion), friction=0.14)) is None
    assert predict_falls(make_walker(sprung_compass("spring"))) is None
    assert predict_falls(make_walker(adapt_to_uneven_ground(COMPASS))) is None
    assert predict_falls(make_walker(COMPASS)) is not None


def test_a_return_map_does_not_simulate_an_excluded_state():
    walker = WALKERS["compass"]
    section, prediction = search_section(walker), predict_falls(walker)
    falls = next(section.project(state) for state in draw_states(walker, 200) if prediction.excludes(state))
    passage = ReturnMap(walker, section, prediction=prediction)(falls)
    assert passage.end is None
    assert passage.stop is Stop.FELL
    assert not passage.walk_steps[0].arcs
    assert ReturnMap(walker, section)(falls).walk_steps[0].arcs


def test_both_feet_touch_the_ground_in_a_start():
    walker = WALKERS["compass"]
    states = draw_states(walker, 60)
    assert states
    for state in states:
        place, velocity, _ = COMPASS.landing(state[:4], state[4:], walker.p)
        assert float(place[1]) == pytest.approx(0, abs=1e-12)
        assert float(velocity[1]) > 0  # the trailing foot leaves the ground


def test_a_search_on_slippery_ground_simulates_few_states(monkeypatch):
    """Without the prediction of falls it simulates 786 steps."""
    counts, simulate = [], Walker.walk_step
    monkeypatch.setattr(Walker, "walk_step", lambda *args, **options: counts.append(1) or simulate(*args, **options))
    gaits = find_cycles(COMPASS, {"slope": math.radians(1), "friction": 0.13})
    assert [gait.sequence for gait in gaits] == ["slip+ stick slip- | stick", "slip+ stick | slip+"]
    assert len(counts) < 550
