"""The reference optimum: robot defaults, level ground, 0.633 m/s, 0.4713 m, torques within 6 N m, friction 0.14.

Source of the two costs: tests/references/compass_optimum.py, which uses nothing of gaitopt.
"""

import numpy as np
import pytest

from gaitopt import ContactSequence, Status, positive_work
from tests.references.storage import reference

STICK, SLIP = "stick | stick", "slip+ stick | slip+"
COST = {
    sequence: reference("compass_optimum", name)["replayed_cost_of_transport"]
    for sequence, name in ((STICK, "sticking"), (SLIP, "slipping"))
}
GRID = 2e-3
"""Relative error of the cost on the default grid of 40 intervals; the costs of the sequences differ by 2.5 %."""
WEIGHT = 10 * 9.8

both = pytest.mark.parametrize("sequence", COST)


@both
def test_the_reference_cost_is_found_and_verified(solved, sequence):
    gait = solved(sequence=sequence)
    assert gait.status is Status.SOLVED
    assert gait.cost_of_transport == pytest.approx(COST[sequence], rel=GRID)
    assert gait.verification.passed
    assert gait.verification.sequence == sequence
    assert gait.verification.state_error < 1e-6
    assert gait.verification.cost_of_transport == pytest.approx(gait.cost_of_transport, rel=5e-3)
    assert gait.verification.reasons == ()


def test_the_slipping_impact_walks_cheaper(solved):
    assert solved(sequence=SLIP).cost_of_transport < 0.99 * solved(sequence=STICK).cost_of_transport


@both
def test_targets_and_limits_are_kept(solved, sequence):
    gait = solved(sequence=sequence)
    assert gait.speed == pytest.approx(0.633, abs=1e-7)
    assert gait.step_length == pytest.approx(0.4713, abs=1e-7)
    assert np.max(np.abs(gait.motion.channel("torque"))) <= 6 + 1e-6
    assert gait.motion.sequence() == ContactSequence.parse(sequence)


@both
def test_the_energy_ledger_closes(solved, sequence):
    energy = solved(sequence=sequence).energy
    assert energy.relative_residual < 1e-6
    assert energy.gravity == pytest.approx(0, abs=1e-9)  # level ground
    assert energy.impact_loss > 0
    assert (energy.friction_loss > 1e-3) == (sequence == SLIP)


@both
def test_the_cone_is_kept_with_its_margin(solved, sequence):
    gait = solved(sequence=sequence)
    assert gait.friction_margin >= 1e-3 - 1e-6
    # In replay it is looked at between nodes too, where it may be a little narrower but never crossed.
    assert gait.verification.cone_margin > 0.5e-3


@both
def test_the_objective_is_the_cost_up_to_its_quadrature(solved, sequence):
    gait = solved(sequence=sequence)
    assert gait.solver.objective == pytest.approx(gait.cost_of_transport, rel=2e-3)


def test_the_foot_slides_forward_to_an_exact_rest(solved):
    slide, stick = solved(sequence=SLIP).motion.segments
    assert np.all(slide.v[0, :-1] > 0)
    assert slide.v[0, -1] == 0
    assert slide.slide > 1e-3
    assert np.ptp(stick.q[0]) == 0
    friction = -0.14 * slide.force[1]
    assert slide.force[0] == pytest.approx(friction, rel=1e-9)


def test_the_slipping_impulse_lies_on_the_cone(solved):
    assert solved(sequence=SLIP).motion.jumps[0].ratio == pytest.approx(-0.14, abs=1e-8)
    assert abs(solved(sequence=STICK).motion.jumps[0].ratio) <= 0.14 * (1 - 1e-3) + 1e-8


def test_positive_work_is_counted_by_its_own_objective(solved):
    gait = solved(sequence=STICK, objective="positive_work")
    assert gait.verification.passed
    paid = positive_work(gait.motion) / (WEIGHT * gait.step_length)
    assert gait.solver.objective == pytest.approx(paid, rel=5e-3)
    # Measured by an objective, its optimum does not cost more than the optimum of another.
    other = solved(sequence=STICK)
    assert paid <= positive_work(other.motion) / (WEIGHT * other.step_length) * (1 + 1e-3)
