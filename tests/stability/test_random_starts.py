"""Random starts of the search for gaits: states after touchdowns from which a step may be completed."""

import math

import numpy as np
import pytest

from gaitopt import Stop, compass_biped, feedforward, load, passive, rimless_wheel
from gaitopt.simulation import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.step_limits import StepLimits
from gaitopt.stability.cycle_iteration import search_section
from gaitopt.stability.random_starts import SMALLEST_ENERGY, _advance, _TouchdownSampler

COMPASS, WHEEL = compass_biped(), rimless_wheel()


def make_walker(robot, law=None, **parameters):
    law, p = law or passive(robot), robot.vector(robot.resolve(parameters))
    return Walker(robot, law, p, default_engine(law, robot), step_limits=StepLimits(duration=10))


def draw_states(sampler, count):
    rng = np.random.default_rng(7)
    samples = [rng.uniform(-1, 1, sampler.size) for _ in range(count)]
    return [sampler.state_after(sample, at_rest=i % 2 == 0) for i, sample in enumerate(samples)]


@pytest.mark.parametrize(
    "walker",
    [
        make_walker(COMPASS, slope=math.radians(1), friction=0.14),
        make_walker(COMPASS, slope=0.0, friction=0.2),
        make_walker(WHEEL, slope=math.radians(13), friction=0.25),
    ],
    ids=["compass downhill", "compass on level ground", "wheel"],
)
def test_starts_without_the_energy_of_a_step_fall(walker):
    sampler = _TouchdownSampler(walker, search_section(walker))
    kept = draw_states(sampler, 150)
    sampler._passive = False
    every = draw_states(sampler, 150)
    discarded = [state for state, start in zip(every, kept, strict=True) if state is not None and start is None]
    assert len(discarded) >= 5
    assert {walker.walk_step(state).stop for state in discarded} == {Stop.FELL}


def test_both_feet_touch_the_ground_in_a_start():
    walker = make_walker(COMPASS, slope=math.radians(1), friction=0.14)
    states = draw_states(_TouchdownSampler(walker, search_section(walker)), 60)
    assert any(state is not None for state in states)
    for state in (state for state in states if state is not None):
        place, velocity, _ = COMPASS.landing(state[:4], state[4:], walker.p)
        assert float(place[1]) == pytest.approx(0, abs=1e-12)
        assert float(velocity[1]) > 0  # the trailing foot leaves the ground


def test_the_energy_of_the_centre_of_mass_is_that_of_the_masses_of_a_compass():
    slope, length, com, leg, hip, g = 0.03, 1.6, 0.7, 4.0, 2.0, 9.8
    p = COMPASS.vector(
        COMPASS.resolve({"slope": slope, "leg_length": length, "leg_com": com, "leg_mass": leg, "hip_mass": hip})
    )
    (x, th1, th2), (speed, w1, w2) = (0.4, -0.21, -0.18), (0.3, 0.9, -0.5)
    stance, swing = np.array([np.sin(th1), np.cos(th1)]), np.array([np.sin(th2), -np.cos(th2)])
    turn1, turn2 = np.array([np.cos(th1), -np.sin(th1)]) * w1, np.array([np.cos(th2), np.sin(th2)]) * w2
    masses = np.array([leg, hip, leg])
    places = np.array([com * stance, length * stance, length * stance + (length - com) * swing])
    foot = np.array([speed, 0])
    rates = np.array([foot + com * turn1, foot + length * turn1, foot + length * turn1 + (length - com) * turn2])
    centre, velocity = masses @ places / masses.sum(), masses @ rates / masses.sum()
    up = np.array([-np.sin(slope), np.cos(slope)])
    rise = np.linalg.norm(centre) - up @ centre
    energy = masses.sum() * (velocity @ velocity / 2 - SMALLEST_ENERGY * g * rise)
    momentum, computed = np.asarray(_advance(COMPASS)([x, 0, th1, th2], [speed, 0, w1, w2], p)).ravel()
    assert momentum == pytest.approx(masses.sum() * velocity[0], rel=1e-12)
    assert computed == pytest.approx(energy, rel=1e-12)


def test_starts_of_a_law_with_torques_are_not_discarded_for_their_energy():
    gait = load("docs/examples/compass_slip.h5")
    walker = make_walker(COMPASS, feedforward(COMPASS, gait.motion), friction=0.14)
    assert not _TouchdownSampler(walker, search_section(walker))._passive
    assert _TouchdownSampler(make_walker(COMPASS), search_section(make_walker(COMPASS)))._passive
