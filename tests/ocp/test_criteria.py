"""Every objective: solved, replayed, compared with its definition in NumPy, and better at it than another optimum."""

from dataclasses import dataclass, fields, replace

import casadi as ca
import numpy as np
import pytest

from gaitopt import (
    Collocation,
    CostOfTransport,
    InputError,
    MultipleShooting,
    Newton,
    Objective,
    TorqueSquared,
    solve,
    verify,
)
from gaitopt.ocp import TorqueRate, Tracking
from gaitopt.ocp.statement.criteria import Duration, FootSlide, ImpactLoss, PeakFrictionDemand, PeakTorque
from gaitopt.ocp.statement.instant import StepBoundary
from gaitopt.ocp.statement.objective_names import OBJECTIVES

SLIP, STICK = "slip+ stick | slip+", "stick | stick"
METHODS = (Collocation(intervals=16), MultipleShooting(intervals=16))


def torque_rate(motion):
    """Integrate squared differences of the planned torques, which are linear between samples."""
    return sum(float(np.sum(np.diff(s.torque, axis=1) ** 2 / np.diff(s.time))) for s in motion.segments)


def torque_squared(motion):
    """Integrate the square of linear torques exactly: (a^2 + a b + b^2) / 3."""
    total = 0.0
    for s in motion.segments:
        a, b = s.torque[:, :-1], s.torque[:, 1:]
        total += float(np.sum(np.diff(s.time) * (a**2 + a * b + b**2) / 3))
    return total


def kinetic(compass, motion, v):
    jump = motion.jumps[0]
    return float(compass.energy(jump.q, v, compass.vector(motion.parameters))[0])


def definition(name, motion, compass):
    jump = motion.jumps[0]
    force = motion.channel("force")
    return {
        "torque_squared": lambda: torque_squared(motion),
        "torque_rate": lambda: torque_rate(motion),
        "foot_slide": lambda: float(sum(np.abs(s.q[0, -1] - s.q[0, 0]) for s in motion.segments)),
        "impact_loss": lambda: kinetic(compass, motion, jump.v_minus) - kinetic(compass, motion, jump.v_plus),
        "peak_torque": lambda: float(np.abs(motion.channel("torque")).max()),
        "peak_friction_demand": lambda: float(np.abs(force[0] / force[1]).max()),
        "duration": lambda: motion.period,
    }[name]()


# The objective, the contact sequence, and by how much samples and NLP may differ.
CASES = [
    (TorqueSquared(), SLIP, 1e-9),
    (TorqueRate(), SLIP, 1e-9),
    (FootSlide(), SLIP, 1e-6),
    (ImpactLoss(), SLIP, 1e-9),
    (ImpactLoss(), STICK, 1e-9),
    (PeakTorque(), SLIP, 1e-6),
    (PeakTorque(), STICK, 1e-6),
    (PeakFrictionDemand(), STICK, 1e-3),
    (Duration(), STICK, 1e-9),
]


@pytest.fixture(scope="module")
def economical(reference_problem):
    """Return a maker of the optima of the cost of transport, each solved once."""
    found = {}

    def optimum(sequence, method, speed):
        if (sequence, method, speed) not in found:
            found[sequence, method, speed] = solve(
                reference_problem(sequence=sequence, transcription=method, speed=speed)
            )
        return found[sequence, method, speed]

    return optimum


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS, ids=["collocation", "shooting"])
@pytest.mark.parametrize(
    ("objective", "sequence", "tolerance"), CASES, ids=lambda part: getattr(part, "name", str(part))
)
def test_an_objective_is_optimised_replayed_and_measured(
    reference_problem, economical, compass, objective, sequence, tolerance, method
):
    speed = (0.5, 0.8) if objective == Duration() else 0.633
    gait = verify(solve(reference_problem(sequence=sequence, objective=objective, transcription=method, speed=speed)))
    assert gait.status.ok
    assert gait.verification.passed, gait.verification.reasons
    value = definition(objective.name, gait.motion, compass)
    assert objective.evaluate(gait.motion) == pytest.approx(value, rel=1e-6)
    assert gait.solver.objective == pytest.approx(value, rel=tolerance)
    other = economical(sequence, method, speed)
    assert value < 0.95 * definition(objective.name, other.motion, compass)


@pytest.mark.parametrize("name", OBJECTIVES)
def test_every_name_makes_an_objective_with_a_unit_and_a_value(name, slip_gait):
    objective = OBJECTIVES[name]()
    assert objective.name == name
    assert objective.unit
    assert np.isfinite(objective.evaluate(slip_gait.motion))


def test_the_value_of_the_cost_of_transport_has_no_error_at_kinks(slip_gait):
    assert CostOfTransport().evaluate(slip_gait.motion) == slip_gait.cost_of_transport


def test_the_peak_friction_demand_of_a_slide_is_the_friction_coefficient(slip_gait):
    assert PeakFrictionDemand().evaluate(slip_gait.motion) == pytest.approx(0.14, rel=1e-9)


@pytest.mark.parametrize("method", METHODS, ids=["collocation", "shooting"])
def test_a_peak_is_held_at_every_node_and_inner_point(reference_problem, method):
    """With no smoothing: none of the planned torques exceeds the peak, and some reach it with either sign."""
    gait = solve(reference_problem(objective="peak_torque", transcription=method))
    torque = gait.solution.unknowns["torque"].values
    assert np.abs(torque).max() == pytest.approx(gait.solver.objective, rel=1e-6)
    assert np.sum(np.abs(torque) > gait.solver.objective * (1 - 1e-5)) > 10
    assert gait.solution.unknowns["peak"].rows == ("peak of peak_torque 1",)


@pytest.mark.parametrize(("sequence", "other"), [(SLIP, SLIP), (STICK, SLIP)])
def test_tracking_a_motion_brings_a_gait_near_to_it(reference_problem, economical, sequence, other):
    """The reference walks faster, and in one case with another contact sequence."""
    target = economical(other, METHODS[0], 0.633).motion
    objective = Tracking(target)
    gait = verify(solve(reference_problem(sequence=sequence, objective=objective, speed=0.6, intervals=16)))
    assert gait.verification.passed
    assert gait.solver.objective == pytest.approx(objective.evaluate(gait.motion), rel=0.05)
    assert gait.solver.objective < 0.2 * objective.evaluate(economical(sequence, METHODS[0], 0.6).motion)


def test_tracking_itself_costs_nothing(economical):
    motion = economical(SLIP, METHODS[0], 0.633).motion
    assert Tracking(motion).evaluate(motion) < 1e-7


def test_tracked_motions_are_told_apart_by_their_content(economical):
    one, other = (economical(sequence, METHODS[0], 0.633).motion for sequence in (SLIP, STICK))
    assert Tracking(one) == Tracking(replace(one))
    assert hash(Tracking(one)) == hash(Tracking(replace(one)))
    assert Tracking(one) != Tracking(other)
    assert Tracking(one) != Tracking(one, rate_weight=0.1)
    assert Tracking(one).digest in repr(Tracking(one))


def test_tracking_of_a_motion_of_another_robot_is_refused(economical, reference_problem):
    motion = replace(economical(SLIP, METHODS[0], 0.633).motion, angles=("left", "right"))
    with pytest.raises(InputError, match="the robot"):
        reference_problem(objective=Tracking(motion))
    with pytest.raises(InputError, match="needs a Motion"):
        Tracking("a gait")


def test_a_weighted_sum_is_the_sum_of_its_values(reference_problem):
    mixed = CostOfTransport() + 1e-5 * TorqueRate() + 0.02 * ImpactLoss() + 1e-3 * PeakTorque()
    gait = verify(solve(reference_problem(sequence=SLIP, objective=mixed, intervals=16)))
    assert gait.verification.passed
    parts = [weight * term.evaluate(gait.motion) for weight, term in mixed.terms()]
    assert all(part > 1e-4 for part in parts)
    assert gait.solver.objective == pytest.approx(sum(parts), rel=2e-3)
    assert mixed.evaluate(gait.motion) == pytest.approx(sum(parts))
    assert gait.problem["objective"] == mixed.name


def test_a_smooth_sum_is_solved_by_newton_alone(reference_problem, monkeypatch):
    mixed = TorqueSquared() + 1e-3 * TorqueRate()
    problem = reference_problem(objective=mixed, friction=0.2, intervals=16)
    gait = solve(problem)
    from gaitopt import Ipopt, WarmStart

    monkeypatch.setattr(Ipopt, "minimise", None)
    warm = solve(problem.replace(speed=0.64, guess=WarmStart(gait)), solver=Newton())
    assert warm.status.ok
    assert warm.solver.objective == pytest.approx(mixed.evaluate(warm.motion), rel=1e-9)


@pytest.mark.parametrize("objective", [TorqueRate(), PeakTorque(), 0.5 * CostOfTransport() + 0.05 * ImpactLoss()])
def test_open_contact_sequences_take_every_objective(reference_problem, objective):
    gait = verify(solve(reference_problem(sequence="any | any", objective=objective, intervals=16, friction=0.2)))
    assert gait.status.ok, gait.proposal
    assert gait.verification.passed
    assert gait.proposal.complementarity <= 1e-6


@dataclass(frozen=True)
class EndsMeet(Objective):
    """Use every field: the boundary's velocity jump, named views, accelerations, forces and elapsed time."""

    name, smooth, typical = "ends_meet", True, 10.0

    def integrand(self, point):
        swing = point.rate("th2") ** 2 + point.angle("th1") ** 2 + 1e-3 * ca.sumsqr(point.acceleration)
        push = (point.force[1] / point.parameters["gravity"]) ** 2 / 100
        return (1 + point.time) * (swing + push + point.torque_of("hip") ** 2 + point.torque_of("ankle") ** 2)

    def boundary(self, step):
        return ca.sumsqr(step.velocity_jump) + ca.sumsqr(step.q_first - step.q_last) + step.impulse[1] / step.travel


@pytest.mark.parametrize("method", METHODS, ids=["collocation", "shooting"])
@pytest.mark.parametrize("sequence", [SLIP, STICK])
def test_a_custom_objective_sees_the_whole_step(reference_problem, sequence, method):
    gait = verify(solve(reference_problem(sequence=sequence, objective=EndsMeet(), transcription=method)))
    assert gait.verification.passed
    assert EndsMeet().evaluate(gait.motion) == pytest.approx(gait.solver.objective, rel=1e-4)
    # The replay lands within the tolerance of verification, and so does the objective.
    assert EndsMeet().evaluate(gait.motion) > 0


@pytest.mark.parametrize("name", OBJECTIVES)
def test_two_samples_at_one_instant_count_once(name, slip_gait):
    """A replay samples the end of a torque and that of its phase, even if they coincide to rounding."""
    motion, objective = slip_gait.motion, OBJECTIVES[name]()
    first, count = motion.segments[0], motion.segments[0].time.size
    arrays = {each.name: getattr(first, each.name) for each in fields(first)}
    sampled = {key: array for key, array in arrays.items() if np.shape(array)[-1:] == (count,)}
    twice = np.append(np.arange(count), count - 1)
    first = replace(first, **{key: array[..., twice] for key, array in sampled.items()})
    repeated = replace(motion, segments=(first, *motion.segments[1:]))
    assert objective.evaluate(repeated) == pytest.approx(objective.evaluate(motion), rel=1e-12)


def test_the_value_needs_a_completed_step(slip_gait):
    with pytest.raises(InputError, match="did not reach its touchdown"):
        Duration().evaluate(replace(slip_gait.motion, jumps=()))


def test_the_boundary_record_is_complete():
    names = {"q_first", "v_first", "q_last", "v_last", "velocity_jump", "impulse", "duration", "travel", "parameters"}
    assert names < set(StepBoundary.__dataclass_fields__)


@pytest.mark.parametrize("name", OBJECTIVES)
def test_the_value_of_a_motion_with_nan_is_nan(name, not_a_number):
    """A failed gait has nan for times and points; states and forces follow."""
    spoilt = replace(not_a_number.motion.segments[0], q=not_a_number.motion.segments[0].q * np.nan)
    motion = replace(not_a_number.motion, segments=(spoilt, *not_a_number.motion.segments[1:]))
    assert np.isnan(OBJECTIVES[name]().evaluate(motion))
    with pytest.raises(InputError, match="must be finite, got nan"):
        Tracking(motion)
