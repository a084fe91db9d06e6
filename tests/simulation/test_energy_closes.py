"""The energy ledger of simulated walks closes to 1e-8, with slips, torques, stops and many steps."""

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from gaitopt import ScipyEngine, absolute_work, feedforward, ledger, positive_work, replay

BOUND = 1e-8


def test_passive_gaits(compass_walk, passive_gait):
    walk = compass_walk(passive_gait["z"], xd=passive_gait["xd"], mu=passive_gait["mu"], steps=3)
    energies = ledger(walk.motion)
    assert energies.relative_residual < BOUND
    assert energies.actuator == 0
    assert energies.gravity == pytest.approx(98 * walk.motion.travel * np.sin(np.deg2rad(1)), rel=1e-5)
    slips = any(segment.mode.slips for segment in walk.motion.segments)
    assert (energies.friction_loss > 1e-3) == slips
    assert energies.friction_loss >= 0
    assert energies.impact_loss > 0


@pytest.mark.parametrize(
    ("rate", "xd", "mu"), [(0.88, 0.0, 0.3), (1.12, 0.7, 0.3), (0.88, 0.0, 0.24), (0.5, -0.3, 0.1)]
)
def test_wheels(wheel_walk, rate, xd, mu):
    walk = wheel_walk(rate, xd=xd, mu=mu, steps=20)
    assert len(walk.motion.jumps) > 3
    assert ledger(walk.motion).relative_residual < BOUND


def test_complete_slip_changes_kinetic_energy_by_what_is_left(wheel_walk):
    """Type D is not periodic: its foot slows down, so the ledger needs the kinetic change to close."""
    energies = ledger(wheel_walk(1.07204, xd=0.5, mu=0.3).motion)
    assert energies.relative_residual < BOUND
    assert energies.kinetic_change < -0.01


def test_actuated_gait_that_slips(slip_gait, compass):
    walk = replay(slip_gait)
    energies = ledger(walk.motion)
    assert energies.relative_residual < BOUND
    assert energies.gravity == pytest.approx(0.0, abs=1e-6)  # level ground, and the next step begins as this one
    assert energies.actuator == pytest.approx(energies.impact_loss + energies.friction_loss, rel=1e-5)
    assert energies.friction_loss > 0


def test_actuated_steps_that_do_not_repeat(compass_walk, slip_gait, compass):
    """The torques of the level gait on a slope, from another state: nothing is periodic, everything is counted."""
    law = feedforward(compass, slip_gait.motion)
    walk = compass_walk((-0.147836890, 0.732796791, -0.500667882), mu=0.14, law=law, steps=2)
    energies = ledger(walk.motion)
    assert energies.relative_residual < BOUND
    entries = [energies.actuator, energies.gravity, energies.impact_loss, energies.friction_loss]
    assert min(abs(entry) for entry in entries) > 1e-4


def test_walks_that_stop(compass_walk, wheel_walk):
    fall = compass_walk((-0.1, 0.1, -0.5), mu=0.14)
    lift = wheel_walk(0.99, mu=np.inf, steps=3)
    for walk in (fall, lift):
        assert walk.stop.key in ("fell", "lift_off")
        assert ledger(walk.motion).relative_residual < BOUND
    back = ledger(wheel_walk(0.05).motion)  # it comes back to where it started: every entry is nil
    assert back.residual == pytest.approx(0.0, abs=1e-13)
    assert back.gravity == pytest.approx(0.0, abs=1e-9)


def test_work_is_the_integral_of_power_and_friction_loss_that_of_force_times_slide(slip_gait, compass):
    """Torque, rates, force and slide speed are recorded next to the works the integrator carried along."""
    walk = replay(slip_gait, engine=ScipyEngine(samples=16))
    for segment in walk.motion.segments:
        power = segment.torque * np.array([segment.v[2], segment.v[2] + segment.v[3]])
        np.testing.assert_allclose(segment.power, power, atol=1e-13)
        time, keep = np.unique(segment.time, return_index=True)
        work = cumulative_simpson(power[:, keep], x=time, initial=0)
        np.testing.assert_allclose(segment.work[:, keep], work, atol=1e-8)
        loss = cumulative_simpson((-segment.force[0] * segment.v[0])[keep], x=time, initial=0)
        np.testing.assert_allclose(segment.friction_work[keep], loss, atol=1e-8)
        assert np.all(np.diff(segment.friction_work) >= 0)


def test_absolute_work_of_a_replay_does_not_depend_on_the_sampling(slip_gait, compass):
    coarse, fine = (replay(slip_gait, engine=ScipyEngine(samples=n)).motion for n in (4, 40))
    assert absolute_work(coarse) == pytest.approx(absolute_work(fine), rel=1e-8)
    assert positive_work(fine) == pytest.approx((absolute_work(fine) + ledger(fine).actuator) / 2, rel=1e-12)
    assert absolute_work(fine) > ledger(fine).actuator
