"""Objectives of robots with several contacts that depend on the whole period: boundary terms, and peaks over time."""

from dataclasses import dataclass

import attrs
import casadi as ca
import numpy as np
import pytest

from gaitopt.ocp import Duration, ImpactLoss, Objective, PeakFrictionDemand, PeakTorque
from gaitopt.ocp.multicontact.planar_bounds import planar_structure
from gaitopt.ocp.multicontact.planar_guess import FromPlanarGait
from gaitopt.ocp.multicontact.planar_objective import make_instant
from gaitopt.ocp.multicontact.planar_point import PlanarPoint
from gaitopt.ocp.multicontact.planar_solver import solve_planar
from gaitopt.ocp.multicontact.planar_transcription import transcribe_planar
from gaitopt.ocp.nlp.keys import Kind
from gaitopt.simulation import verify_planar
from gaitopt.study.planar_metrics import largest_foot_ratio
from tests.ocp.multicontact_examples import drag, hop, roll_off

WEIGHT = 1e-2
"""Weight of the effort, without which the optimum is not unique."""


@pytest.fixture(scope="module")
def known():
    """Return the hop of least effort."""
    return solve_planar(hop(clearance=1e-3))


def solve_with(problem, objective, gait):
    """Return the gait of an objective near another gait."""
    return solve_planar(problem.replace(objective=objective, guess=FromPlanarGait(gait)))


def effort_of(gait, leg=1e-3):
    """Return the integral of the squared torques, that of the leg weighted; torques are linear between samples."""
    total = 0.0
    for segment in gait.motion.segments:
        u, h = segment.torque, np.diff(segment.time)
        squares = (u[:, 1:] ** 2 + u[:, 1:] * u[:, :-1] + u[:, :-1] ** 2) @ h / 3
        total += sum(
            value * (leg if name == "leg" else 1.0) for name, value in zip(gait.motion.actuators, squares, strict=True)
        )
    return total


@pytest.mark.slow
def test_the_peak_is_the_largest_torque(known):
    problem = hop(clearance=1e-3)
    gait = solve_with(problem, PeakTorque() + problem.objective, known)
    assert gait.status.ok
    peak = np.abs(gait.motion.channel("torque")).max()
    assert gait.solver.objective == pytest.approx(peak + effort_of(gait), rel=1e-6)
    assert peak < 0.5 * np.abs(known.motion.channel("torque")).max()
    # A limit of this size instead of the peak gives the same gait.
    limits = attrs.evolve(problem.limits, torque=peak)
    least = solve_with(problem.replace(limits=limits), problem.objective, gait)
    assert least.solver.objective == pytest.approx(effort_of(gait), rel=1e-6)


@pytest.mark.slow
def test_the_duration_is_that_of_the_period(known):
    problem = hop(clearance=1e-3).replace(speed=None)
    gait = solve_with(problem, Duration() + WEIGHT * problem.objective, known)
    assert gait.status.ok
    assert gait.solver.objective == pytest.approx(gait.period + WEIGHT * effort_of(gait), rel=1e-6)
    # At the optimum the effort decreases with the duration by the inverse of its weight.
    slower = solve_with(problem.replace(speed=0.6 / (gait.period + 1e-3)), problem.objective, gait)
    assert (slower.solver.objective - effort_of(gait)) / 1e-3 == pytest.approx(-1 / WEIGHT, rel=1e-2)


@pytest.mark.slow
def test_the_impact_loss_is_that_of_the_energy_ledger(known):
    problem = hop(clearance=1e-3)
    gait = solve_with(problem, ImpactLoss() + WEIGHT * problem.objective, known)
    assert verify_planar(gait).verification.passed
    assert gait.energy.impact_loss < 0.1 * known.energy.impact_loss
    assert gait.solver.objective == pytest.approx(gait.energy.impact_loss + WEIGHT * effort_of(gait), rel=1e-6)


def test_the_impact_loss_after_an_exchange_of_the_legs():
    problem = drag()
    gait = solve_planar(problem.replace(objective=ImpactLoss() + problem.objective))
    assert gait.status.ok
    assert gait.energy.impact_loss > 1e-3
    assert gait.solver.objective == pytest.approx(gait.energy.impact_loss + effort_of(gait), rel=1e-6)


@pytest.mark.slow
def test_the_friction_demand_is_the_largest_ratio_of_the_forces(known):
    problem = hop(clearance=1e-3)
    gait = solve_with(problem, 100 * PeakFrictionDemand() + problem.objective, known)
    assert gait.status.ok
    demand = largest_foot_ratio(gait)
    assert demand < 0.8 * largest_foot_ratio(known)
    # The demand is bounded at the points of the grid; the ratio at the samples between them may be slightly larger.
    assert gait.solver.objective == pytest.approx(100 * demand + effort_of(gait), rel=1e-3)


@pytest.mark.slow
def test_the_forces_of_heel_and_toe_are_added():
    problem = roll_off()
    structure = planar_structure(problem.replace(objective=PeakFrictionDemand()))
    transcription, motion = transcribe_planar(structure), solve_planar(problem).motion
    builder, phase, segment = transcription.builder, transcription.phases[0], motion.segments[0]
    names = ("q", "v", "u", "z", "p")
    sizes = (segment.q.shape[0], segment.v.shape[0], 2, phase.system.system.size1_out(0), len(problem.values))
    point = PlanarPoint(*(ca.SX.sym(name, size) for name, size in zip(names, sizes, strict=True)))
    feet = make_instant(builder, phase, point, ca.SX.zeros(2)).foot_forces
    inputs = [point.q, point.v, point.u, point.z, point.p]
    read = ca.Function("feet", inputs, [feet])
    p = problem.robot.vector(motion.parameters)
    k = segment.time.size // 2
    matrix, right = phase.system.system(segment.q[:, k], segment.v[:, k], segment.torque[:, k], p)
    force = np.array(read(segment.q[:, k], segment.v[:, k], segment.torque[:, k], ca.solve(matrix, right), p))
    assert force.shape == (2, 1)  # one foot
    assert force[:, 0] == pytest.approx(segment.force[:, :, k].sum(axis=0), rel=1e-6)


@pytest.mark.slow
def test_a_peak_of_continuous_torques_is_bounded_once(known):
    gait = solve_with(hop(clearance=1e-3), PeakTorque() + hop().objective, known)
    ends = [table for name, table in gait.solution.constraints.items() if name.startswith("end")]
    bounds = [sum(Kind.PEAK_BOUND.text.split(",")[0] in row for row in table.rows) for table in ends]
    assert bounds == [0, 4]  # the stance ends without an impact, the flight with one


@dataclass(frozen=True)
class LastHeight(Objective):
    """Height of the body at touchdown, as a custom boundary term."""

    name, unit, smooth = "last_height", "m", True

    def boundary(self, step):
        """Return the height [m]."""
        return step.q_last[step.coordinates.index("y")]


@pytest.mark.slow
def test_a_custom_boundary_term(known):
    problem = hop(clearance=1e-3)
    gait = solve_with(problem, LastHeight() + WEIGHT * problem.objective, known)
    assert gait.status.ok
    height = gait.motion.segments[-1].q[1, -1]
    assert gait.solver.objective == pytest.approx(height + WEIGHT * effort_of(gait), rel=1e-6)
    assert str(problem.replace(objective=LastHeight())).count("last_height") == 1
