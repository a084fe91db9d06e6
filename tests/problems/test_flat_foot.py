"""The walker with heel and toe: its sequence, the balance of its foot, and its energy."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

from gaitopt.cli.script import call_script
from gaitopt.ocp import solve_planar
from gaitopt.simulation import verify_planar
from tests.conftest import ROOT

pytestmark = pytest.mark.slow

SEQUENCE = "heel A stick, toe B stick > heel A stick | heel A stick, toe A stick > toe A stick |"


@pytest.fixture(scope="module")
def gait():
    return verify_planar(solve_planar(call_script(ROOT / "problems" / "flat_foot.py", [])))


def test_it_is_solved_and_its_replay_has_heel_strike_toe_off_foot_flat_and_heel_off(gait):
    assert gait.status.ok, gait.solver.violations
    assert gait.verification.passed, gait.verification.reasons
    assert gait.verification.sequence == SEQUENCE
    events = [" & ".join(event.names) for event in gait.motion.events]
    assert events == ["toe B opens", "toe A closes", "heel A opens", "heel B closes"]
    assert gait.motion.events[-1].outcome.mode("toe A").value == "stick"


def test_a_foot_at_rest_is_in_equilibrium(gait):
    """The moments of both contact forces, of the weight and of the ankle torque about the ankle add up to zero."""
    flat, values = gait.motion.segments[2], gait.motion.parameters
    heel, toe = (flat.force[gait.robot.contact_index(f"{name} A")] for name in ("heel", "toe"))
    height, back, ahead = (values[name] for name in ("ankle_height", "heel_length", "toe_length"))
    moment = ahead * toe[1] - back * heel[1] + height * (heel[0] + toe[0])
    moment -= values["foot_mass"] * values["gravity"] * (ahead - back) / 3
    torque = flat.torque[gait.robot.actuators.index("ankle A")]
    assert moment + torque == pytest.approx(np.zeros(torque.size), abs=1e-8)
    assert np.ptp(torque) > 1


def test_both_feet_carry_the_weight_and_the_motion(gait):
    """The change of momentum in double support is the integral of weight and contact forces."""
    double, values = gait.motion.segments[0], gait.motion.parameters
    mass, p = gait.motion.total_mass, gait.robot.vector(values)
    momentum = np.array([np.array(gait.robot.momentum(double.q[:, k], double.v[:, k], p)[0]).ravel() for k in (0, -1)])
    force = double.force.sum(axis=0)
    weight = mass * values["gravity"]
    total = np.array([trapezoid(force[i], double.time) for i in (0, 1)]) - [0, weight * np.ptp(double.time)]
    assert momentum[1] - momentum[0] == pytest.approx(total, abs=0.02)
    assert np.all(force[1] > 0.5 * weight)


def test_the_actuators_replace_what_the_impacts_take(gait):
    ledger = gait.energy
    assert ledger.gravity == pytest.approx(0, abs=1e-9)
    assert ledger.actuator == pytest.approx(ledger.impact_loss, rel=1e-6)
    assert gait.solver.objective == pytest.approx(84.8, abs=0.3)  # of finer grids too; not published


def test_the_ankle_of_the_trailing_foot_pushes_off(gait):
    row = gait.robot.actuators.index("ankle B")
    assert gait.motion.segments[0].work[row, -1] > 0
