"""Properties of the simulation from random states, for every planar robot of the catalogue."""

import numpy as np
import pytest

from gaitopt.model import compass_with_two_feet
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.simulation import simulate_planar
from gaitopt.status import Stop
from tests.matrix import catalogue

ROBOTS = {name: robot for name, robot in catalogue().items() if isinstance(robot, PlanarRobot)}
STATES = {"quadruped": 1, "monopod": 2}
"""Number of random states; robots with stiff springs take long."""
ENDS = {"duration_done", "fell", "painleve", "jam", "ambiguous", "must_slip"}
"""Reasons for which these motions may end; the last four are named properties of rigid bodies with Coulomb friction."""
MOST_EVENTS = 60


def lift(robot, q, p):
    """Return coordinates with every contact at least 1 cm from the ground or from its limit."""
    for _ in range(200):
        gaps = np.array(robot.gaps(q, p)[0]).ravel()
        lowest = int(np.argmin(gaps))
        if gaps[lowest] >= 0.01:
            break
        row = np.array(robot.rows(q, np.zeros(robot.n_q), p)[0])[lowest]
        q = q + row * (0.02 - gaps[lowest]) / (row @ row)
    return q


def random_motion(robot, seed):
    """Return a simulation of a random state on random ground."""
    generator = np.random.default_rng(seed)
    friction = float(generator.choice([0.2, 0.7, np.inf]))
    parameters = {"friction": friction, "slope": float(generator.uniform(0, 0.08))}
    q, v = generator.normal(0, 0.25, robot.n_q), generator.normal(0, 1, robot.n_q)
    q = lift(robot, q, robot.vector(robot.resolve(parameters)))
    return simulate_planar(robot, q, v, parameters, duration=0.6)


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_energy_never_grows_in_an_impact_and_every_end_has_a_name(name):
    robot, contacts = ROBOTS[name], 0
    for seed in range(STATES.get(name, 8)):
        rollout = random_motion(robot, seed)
        assert rollout.stop.key in ENDS, (seed, rollout.stop)
        if rollout.stop is Stop.MUST_SLIP:
            assert np.isinf(rollout.motion.parameters["friction"])
        assert len(rollout.motion.events) <= MOST_EVENTS
        scale = max(1.0, *(float(np.max(np.abs(s.kinetic))) for s in rollout.motion.segments))
        for event in rollout.motion.events:
            contacts += event.is_impact
            assert event.energy_lost >= -1e-12 * scale, (seed, event)
        ledger = rollout.motion.ledger()
        assert abs(ledger.residual) < 1e-9 * scale, (seed, ledger)
    assert contacts > 0


def test_infinite_friction_ends_where_any_finite_one_slips():
    """As the coefficient grows, the onset of slip tends to the time at which the normal force alone vanishes."""
    robot, generator = compass_with_two_feet(), np.random.default_rng(0)
    q, v = generator.normal(0, 0.25, robot.n_q), generator.normal(0, 1, robot.n_q)
    q = lift(robot, q, robot.vector(robot.resolve({})))
    ideal = simulate_planar(robot, q, v, {}, duration=0.6)
    assert ideal.stop is Stop.MUST_SLIP
    last = ideal.motion.segments[-1]
    tangential, normal = last.force[0, :, -1]
    assert abs(normal) < 1e-6
    assert abs(tangential) > 1
    gaps = []
    for friction in (1e3, 1e4, 1e5):
        events = simulate_planar(robot, q, v, {"friction": friction}, duration=0.6).motion.events
        slip = next(event for event in events if event.names[0].startswith("foot A slip"))
        gaps.append(float(last.time[-1]) - slip.time)
    assert np.array(gaps[:-1]) / gaps[1:] == pytest.approx([10, 10], rel=0.1)
