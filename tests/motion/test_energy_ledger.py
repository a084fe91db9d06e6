"""The ledger of motions made by hand: every entry is known before."""

import numpy as np
import pytest

from gaitopt import Mode, ledger
from gaitopt.model import monopod
from gaitopt.motion.energy import Ledger
from gaitopt.simulation import simulate_planar


def test_every_entry_is_counted_once(segment, jump, motion):
    """Two steps: in each an actuator works, the robot falls, the foot slides and the touchdown costs energy."""
    time = np.linspace(0, 1, 5)
    first = segment(
        time,
        mode=Mode.SLIP_FORWARD,
        work=np.array([3.0 * time, -1.0 * time]),
        friction_work=0.5 * time,
        kinetic=10 + 2.5 * time,
        potential=100 - 1.0 * time,
    )
    second = segment(
        1 + time,
        step=1,
        work=np.array([0.25 * time, 0 * time]),
        friction_work=0 * time,
        kinetic=11.5 + 1.25 * time,
        potential=99 - 1.0 * time,
    )
    energies = ledger(motion([first, second], [jump(1.0, energy_lost=1.0), jump(2.0, step=1, energy_lost=0.75)]))
    assert energies.actuator == pytest.approx(3 - 1 + 0.25)
    assert energies.gravity == pytest.approx(2.0)
    assert energies.friction_loss == pytest.approx(0.5)
    assert energies.impact_loss == pytest.approx(1.75)
    assert energies.kinetic_change == pytest.approx(12.75 - 0.75 - 10)
    assert energies.residual == pytest.approx(0.0, abs=1e-14)


def test_a_walk_that_goes_on_after_its_last_touchdown_ends_with_its_last_sample(segment, jump, motion):
    time = np.linspace(0, 1, 3)
    walk = motion(
        [segment(time, kinetic=5 + time), segment(1 + time, step=1, kinetic=4 - time)], [jump(1.0, energy_lost=2.0)]
    )
    assert ledger(walk).kinetic_change == pytest.approx(3 - 5)


def test_a_walk_that_stops_at_the_instant_of_its_last_touchdown(segment, jump, motion):
    """Lift-off right after an impact: a segment of no length follows the jump at the same time."""
    time = np.linspace(0, 1, 3)
    at_once = segment(np.array([1.0, 1.0]), step=1, kinetic=np.array([4.0, 4.0]))
    walk = motion([segment(time, kinetic=5 + time), at_once], [jump(1.0, energy_lost=2.0)])
    assert ledger(walk).kinetic_change == pytest.approx(4 - 5)


def test_the_residual_is_what_is_missing(segment, motion):
    time = np.linspace(0, 1, 3)
    energies = ledger(motion([segment(time, kinetic=8 * time, potential=-6 * time)]))
    assert energies.residual == pytest.approx(-2.0)
    assert energies.relative_residual == pytest.approx(2 / 8)


def test_nothing_at_all_closes(motion):
    energies = ledger(motion([]))
    assert energies.residual == 0
    assert energies.relative_residual == 0


def test_springs_and_dampers_have_entries_of_their_own(segment, motion):
    """The elastic part of the potential energy is not gravity's."""
    time = np.linspace(0, 1, 3)
    parts = [
        segment(time, potential=20 - 3.0 * time, elastic=5 + 2.0 * time, damping_work=0.25 * time, kinetic=2.75 * time),
        segment(
            1 + time, potential=17 + 0 * time, elastic=7 - 1.0 * time, damping_work=1.5 * time, kinetic=2.75 - time
        ),
    ]
    energies = ledger(motion(parts))
    assert (energies.gravity, energies.elastic_change, energies.damping_loss) == (4.0, 1.0, 1.75)
    assert energies.losses == 1.75
    assert energies.kinetic_change == 1.75
    assert energies.residual == 4.0 - 1.75 - 1.75 - 1.0
    assert energies.relative_residual == 0.5 / 4.0


def test_a_robot_without_springs_and_dampers_has_zeros(segment, motion):
    time = np.linspace(0, 1, 3)
    plain = segment(time, kinetic=time)
    np.testing.assert_array_equal([plain.damping_work, plain.elastic], np.zeros((2, 3)))
    energies = ledger(motion([plain]))
    assert (energies.damping_loss, energies.elastic_change) == (0.0, 0.0)


def test_a_motion_without_work_and_losses_has_a_small_error(segment, motion):
    """Without a floor, rounding errors of a passive hop would be compared with each other, with the result 1."""
    time = np.linspace(0, 1, 3)
    hop = segment(time, kinetic=5 + np.array([0.0, -2.0, 1e-12]), potential=3 + np.array([0.0, 2.0, 0.0]))
    energies = ledger(motion([hop]))
    assert energies.largest_kinetic == pytest.approx(5)
    assert energies.relative_residual == pytest.approx(1e-12 / 5e-6, rel=1e-3)
    assert Ledger(1.0, 0.0, 0.5, 0.0, 0.0, largest_kinetic=5.0).relative_residual == 0.5  # the floor is below the work


def test_the_scale_of_a_planar_motion_is_its_largest_kinetic_energy():
    motion = simulate_planar(monopod(), [0, 5.0, 0.1, 0, 0.6], [0, 1.0, 0, 0, 0], {}, duration=0.1).motion
    energies = motion.ledger()
    assert energies.largest_kinetic == motion.segments[0].kinetic.max() > 1
    passive = Ledger(0.0, 1e-12, 0.0, 0.0, 0.0, largest_kinetic=energies.largest_kinetic)
    assert passive.relative_residual == pytest.approx(1e-6 / energies.largest_kinetic)
