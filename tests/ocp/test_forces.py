"""Optimal gaits of a compass biped with forces at its hip, by both transcriptions: replay and energy ledger."""

import functools

import numpy as np
import pytest

from gaitopt import Collocation, GaitProblem, Limits, MultipleShooting, TorqueSquared, load, replay, save, solve, verify
from tests.walkers.sprung_compass import sprung_compass

SCHEMES = {"collocation": Collocation(intervals=30), "shooting": MultipleShooting(intervals=30)}
FORCES = {"spring": ("spring",), "all": ("spring", "damper", "rotor"), "damper": ("damper",)}
SEQUENCES = {"spring": "stick | stick", "all": "stick | stick", "damper": "slip+ stick | slip+"}

both = pytest.mark.parametrize("scheme", SCHEMES)
every_robot = pytest.mark.parametrize("forces", FORCES)


@functools.cache
def problem(forces, scheme, **changes):
    return GaitProblem(
        robot=sprung_compass(*FORCES[forces]),
        sequence=SEQUENCES[forces],
        friction=0.14 if "slip" in SEQUENCES[forces] else 0.5,
        speed=0.633,
        step_length=0.4713,
        limits=Limits(torque=6.0),
        transcription=SCHEMES[scheme],
        **changes,
    )


@functools.cache
def solved(forces, scheme, **changes):
    stated = problem(forces, scheme, **changes)
    return verify(solve(stated))


@pytest.mark.slow
@both
@every_robot
def test_the_gait_is_replayed_and_its_ledger_closes(forces, scheme):
    gait = solved(forces, scheme)
    assert gait.status.ok, gait.status
    assert gait.verification.passed, gait.verification.reasons
    assert gait.verification.energy_residual < 1e-8
    energy = gait.energy
    assert energy.relative_residual < 1e-6
    assert abs(energy.elastic_change) < 1e-9
    assert abs(energy.gravity) < 1e-9  # level ground: the potential energy of the spring is not gravity's
    assert (energy.damping_loss > 1e-3) == ("damper" in FORCES[forces])
    assert energy.losses == pytest.approx(energy.actuator, rel=1e-6)


@every_robot
def test_both_transcriptions_agree(forces):
    one, other = (solved(forces, scheme, objective=TorqueSquared()) for scheme in SCHEMES)
    assert one.solver.objective == pytest.approx(other.solver.objective, rel=1e-7)
    for name in ("damping_work", "elastic", "kinetic"):
        ends = [[getattr(part, name)[[0, -1]] for part in gait.motion.segments] for gait in (one, other)]
        np.testing.assert_allclose(*ends, rtol=1e-6, atol=1e-6)


@both
def test_the_planned_damping_work_is_that_of_the_replay(scheme):
    gait = solved("all", scheme)
    first = gait.motion.segments[0]
    walked = replay(gait).motion.segments[0]
    assert first.damping_work[-1] == pytest.approx(walked.damping_work[-1], rel=1e-7)
    work = np.interp(first.time, walked.time, walked.damping_work)
    np.testing.assert_allclose(first.damping_work, work, atol=1e-5)
    assert np.all(np.diff(first.damping_work) >= 0)


def test_a_gait_with_forces_comes_back_from_its_file(tmp_path):
    gait = solved("all", "collocation")
    again = load(save(gait, tmp_path / "gait.h5"))
    assert again.energy == gait.energy
    assert again.energy.damping_loss > 0
    assert verify(again).verification.passed
