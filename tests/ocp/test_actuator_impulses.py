"""Impulses of actuators at impacts: closed forms of the push-off, optima, replays, multipliers and wrong input.

Source of the closed forms: Kuo (Journal of Biomechanical Engineering 124, 2002).  A point mass on massless legs walks
as an inverted pendulum with the speed w at touchdown and an angle 2 al between the legs.  The push-off P = w tan(al)
along the trailing leg just before the collision restores the speed and costs P^2 / 2 per unit mass; the collision alone
costs 4 cos^4(al) times more.
"""

import functools
import math
import runpy
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad

from gaitopt import Collocation, InputError, load, save
from gaitopt.cli.script import call_script
from gaitopt.control import planar_feedforward
from gaitopt.export import write_python
from gaitopt.model import compass_with_two_feet, telescoping_biped
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.motion.actuator_impulses import EventImpulses, split_work
from gaitopt.motion.planar_gait_summary import summarise_planar
from gaitopt.motion.planar_gait_table import tabulate_planar_gait
from gaitopt.ocp import ActuatorImpulse, CostOfTransport, Objective, PlanarLimits, solve_planar
from gaitopt.ocp.multicontact.impulse_stages import mean_of_positive
from gaitopt.simulation import simulate_planar, verify_planar
from gaitopt.simulation.planar_simulation.contact_resolution import ContactResolution
from gaitopt.simulation.planar_simulation.impact_passage import pass_impact
from gaitopt.simulation.planar_simulation.planar_state import PlanarState
from gaitopt.stability import assess_planar
from gaitopt.study.audit.second_planar_replay import replay_planar_again
from tests.conftest import ROOT
from tests.ocp.multicontact_examples import walk
from tests.problems.test_telescoping_biped import WALK
from tests.stability.difference_quotients import planar_differences

LIGHT = 1e-8
"""Mass of a foot [kg]; the results differ from those of massless legs by about as much."""

ANGLE, SPEED = 0.3, 0.7
"""Half the angle between the legs [rad], speed at touchdown [m/s]."""

ANKLES = (
    ActuatorImpulse("ankle A", "foot B closes", limits=(0.05, 0.1)),
    ActuatorImpulse("ankle B", "foot B closes", limits=(-0.1, 0.1), moment="after"),
)


def collide(before, after):
    """Return the passage of a touchdown of the biped: impulses of legs A and B before and after it."""
    robot, c, s = telescoping_biped(), math.cos(ANGLE), math.sin(ANGLE)
    p = robot.vector(robot.resolve({"foot_mass": LIGHT, "friction": math.inf}))
    q = np.array([s, c, -ANGLE, 1, ANGLE, 1])
    v = np.array([SPEED * c, -SPEED * s, -SPEED, 0, -SPEED, 0])
    modes = dict.fromkeys(robot.contact_names, "free") | {"foot A": "stick"}
    state, impulses = PlanarState(0.0, q, v, ContactState.of(modes)), np.zeros((2, 3))
    impulses[0, 0], impulses[1, 1] = before, after
    return pass_impact(ContactResolution(robot, p), p, state, ([0, 1], frozenset()), EventImpulses(*impulses))


def test_the_push_off_restores_the_speed():
    push, (c, s) = SPEED * math.tan(ANGLE), (math.cos(ANGLE), math.sin(ANGLE))
    passage = collide(push, push)
    pushed, stopped = passage.stages
    assert pushed.v_plus[:2] == pytest.approx([SPEED / c, 0], abs=1e-7)  # the velocity is horizontal
    assert passage.v_plus[:2] == pytest.approx([SPEED * c, SPEED * s], abs=1e-7)
    assert pushed.reaction[0] == pytest.approx([push * s, push * c], abs=1e-7)
    assert pushed.generated[0] == pytest.approx(push**2 / 2, abs=1e-8)
    assert stopped.absorbed[1] == pytest.approx(push**2 / 2, abs=1e-8)
    assert pushed.absorbed.max() < 1e-12
    assert abs(stopped.v_plus[5]) < 1e-6  # the leading leg stops


def test_the_collision_without_push_off_costs_more():
    alone, push = SPEED * math.sin(2 * ANGLE), SPEED * math.tan(ANGLE)
    lost = collide(0.0, alone).stages[0].absorbed[1]
    assert lost == pytest.approx(alone**2 / 2, abs=1e-7)
    assert lost / collide(push, push).stages[0].generated[0] == pytest.approx(4 * math.cos(ANGLE) ** 4, rel=1e-6)


def test_a_pull_on_the_stance_leg_lifts_its_foot_and_changes_nothing_else():
    pulled, *_ = collide(-0.1 * LIGHT, 0.0).stages
    assert pulled.outcome.mode("foot A").value == "free"
    assert not pulled.reaction.any()
    assert pulled.v_plus[:2] == pytest.approx(pulled.v_minus[:2], abs=1e-7)


@pytest.mark.parametrize("ends", [(0.0, 1.0), (-1.0, 0.4), (-1.0, -0.2), (0.3, 0.3), (-0.5, 0.5), (1.0, -0.5)])
@pytest.mark.parametrize("impulse", [0.7, -0.7])
def test_the_work_is_split_where_the_rate_changes_its_sign(impulse, ends):
    generated, absorbed = (part.item() for part in split_work(np.array([impulse]), *(np.array([end]) for end in ends)))
    zero = ends[0] / (ends[0] - ends[1]) if ends[0] * ends[1] < 0 else None

    def power(share):
        return impulse * (ends[0] + share * (ends[1] - ends[0]))

    points = None if zero is None else [zero]
    assert generated == pytest.approx(quad(lambda share: max(power(share), 0.0), 0, 1, points=points)[0], abs=1e-12)
    assert absorbed == pytest.approx(quad(lambda share: max(-power(share), 0.0), 0, 1, points=points)[0], abs=1e-12)


@functools.cache
def ankle_gait():
    """Return a gait of the compass with an impulse of each ankle, which absorbs and generates energy."""
    limits = PlanarLimits(torque={"ankle A": 6, "hip": 6, "ankle B": 0})
    grid = Collocation(intervals=6, tolerance=1e-6)
    return solve_planar(walk(friction=math.inf, impulses=ANKLES, limits=limits, transcription=grid))


@pytest.mark.slow
def test_a_gait_with_impulses_is_replayed_and_its_ledger_closes(tmp_path):
    gait = verify_planar(ankle_gait())
    assert gait.status.ok
    assert gait.verification.passed, gait.verification.reasons
    energy, event = gait.energy, gait.motion.events[-1]
    before, after = event.actuator_impulses
    assert before.impulse[0] + 1e-7 >= 0.05
    assert after.impulse[1] == pytest.approx(-0.1, abs=1e-6)
    assert energy.impulse_generated == pytest.approx(after.work) != 0
    assert energy.impulse_absorbed == pytest.approx(-before.work) != 0
    assert energy.relative_residual < 1e-6
    supplied = energy.actuator + energy.impulse_generated - energy.impulse_absorbed
    assert supplied == pytest.approx(energy.impact_loss, rel=1e-6)
    read = load(save(gait, tmp_path / "ankles.h5"))
    for stored, stage in zip(read.motion.events[-1].actuator_impulses, (before, after), strict=True):
        assert stored.outcome == stage.outcome
        for name in ("impulse", "reaction", "v_minus", "v_plus", "generated", "absorbed"):
            assert np.array_equal(getattr(stored, name), getattr(stage, name))
    assert verify_planar(read).verification.state_error == pytest.approx(gait.verification.state_error, abs=1e-9)


@pytest.mark.slow
def test_tables_and_json_state_the_impulses():
    gait = ankle_gait()
    facts = [text for name, text in tabulate_planar_gait(gait) if name == "impulse"]
    assert len(facts) == 2
    assert facts[1].startswith("ankle B -0.1 N m s just after the impact: generates 0.0")
    data = summarise_planar(gait)
    before, after = data["impact"]["actuator_impulses"]
    assert (before["moment"], after["moment"]) == ("before", "after")
    assert after["generated"]["ankle B"] == pytest.approx(gait.energy.impulse_generated)
    assert set(after["reaction"]) == {"foot B"}
    assert "impulses (" in dict(tabulate_planar_gait(gait))["energy"]
    assert data["energy"]["impulse_absorbed"] == pytest.approx(before["absorbed"]["ankle A"])
    assert "|ankle B after foot B closes| ≤ 0.1 N m s" in str(compass(*ANKLES))


@pytest.mark.slow
def test_an_exported_controller_and_the_second_replay_have_the_impulses(tmp_path):
    gait = ankle_gait()
    controller = write_python(gait.robot, planar_feedforward(gait), tmp_path / "law.py")
    before, after = gait.motion.events[-1].actuator_impulses
    exported = runpy.run_path(str(controller))["Controller"]().impulses("foot B")
    assert exported.tolist() == [before.impulse.tolist(), after.impulse.tolist()]
    assert replay_planar_again(gait).state_error < 1e-7


@pytest.mark.slow
def test_the_certificate_has_the_derivative_by_a_limit_of_an_impulse():
    """The derivative is compared with the difference of two optima."""
    gait, limits = ankle_gait(), PlanarLimits(torque={"ankle A": 6, "hip": 6, "ankle B": 0})
    wider = (ANKLES[0], replace(ANKLES[1], limits=(-0.1 - 1e-3, 0.1)))
    grid = Collocation(intervals=6, tolerance=1e-6)
    other = solve_planar(walk(friction=math.inf, impulses=wider, limits=limits, transcription=grid))
    slope = gait.certificate.derivative_of("lower limit of the impulse of ankle B after foot B closes")
    assert slope == pytest.approx((gait.objective - other.objective) / 1e-3, rel=0.02)


@pytest.mark.slow
def test_the_multipliers_contain_the_impulses():
    gait, robot = ankle_gait(), compass_with_two_feet()
    law, cycle = planar_feedforward(gait), assess_planar(gait)
    assert cycle.derivative == pytest.approx(planar_differences(robot, cycle, law), abs=1e-5)
    first = gait.motion.segments[0]
    two = simulate_planar(
        robot, first.q[:, 0], first.v[:, 0], gait.motion.parameters, torque=law, duration=2.2 * gait.period
    )
    first, second = (event.actuator_impulses for event in two.motion.events)
    assert second[0].impulse == pytest.approx(first[0].impulse[[1, 0, 2]])  # the ankles are exchanged
    assert two.motion.ledger().relative_residual < 1e-10


@pytest.mark.slow
def test_objectives_of_work_count_that_of_impulses():
    """The objective of the NLP is compared with the sum of the recorded works, which another function divides."""
    limits = PlanarLimits(torque={"ankle A": 6, "hip": 6, "ankle B": 0})
    gait = solve_planar(walk(friction=math.inf, impulses=ANKLES, limits=limits, objective=CostOfTransport()))
    assert gait.status.ok
    works = gait.motion.impulse_work
    assert min(works[1], gait.motion.events[-1].actuator_impulses[0].impulse[0]) > 0.01
    assert gait.objective == pytest.approx(gait.cost_of_transport, rel=1e-4)


@pytest.mark.parametrize("ends", [(-1.0, 0.4), (0.4, -1.0), (-1.0, -0.2), (0.2, 0.7), (0.0, 0.3), (0.0, 0.0)])
def test_the_expression_of_the_positive_part_and_its_derivative_are_exact(ends):
    before, after = ca.SX.sym("b"), ca.SX.sym("a")
    mean = mean_of_positive(before, after)
    function = ca.Function("mean", [before, after], [mean, ca.jacobian(mean, ca.vertcat(before, after))])
    value, slope = (np.array(part).ravel() for part in function(*ends))
    assert value == pytest.approx(split_work(np.ones(1), *(np.array([end]) for end in ends))[0])
    if ends != (0.0, 0.0):
        step = 1e-6
        for place in range(2):
            near = [[end + sign * step * (k == place) for k, end in enumerate(ends)] for sign in (1, -1)]
            rise = np.subtract(*(float(function(*point)[0]) for point in near))
            assert slope[place] == pytest.approx(rise / (2 * step), abs=1e-5)


SCRIPT = ROOT / "problems" / "telescoping_biped.py"


@pytest.mark.slow
def test_the_optimal_push_off_is_that_of_the_point_mass():
    """The excess over the closed form is that of feet with mass and of a double support of 5 ms."""
    gait = verify_planar(solve_planar(call_script(SCRIPT, ["impulse_limit=1", "foot_mass=1e-4", "intervals=8"])))
    assert gait.verification.passed, gait.verification.reasons
    before, after = gait.motion.events[-1].actuator_impulses
    assert before.generated[0] == pytest.approx(WALK, rel=0.03)
    assert before.impulse[0] == pytest.approx(math.sqrt(2 * WALK), rel=0.015)
    assert after.absorbed[1] == pytest.approx(before.generated[0], rel=0.01)
    torques = sum(np.abs(np.diff(segment.work[:2], axis=1)).sum() for segment in gait.motion.segments)
    assert torques < 0.02 * WALK  # between the touchdowns the legs do no work


@pytest.mark.slow
def test_the_multipliers_of_the_walk_with_a_push_off_are_those_of_its_return_map():
    """The derivative, with the impulses of both legs, is compared with differences of the simulated return map."""
    gait = solve_planar(call_script(SCRIPT, ["impulse_limit=1", "intervals=8"]))
    law, cycle = planar_feedforward(gait), assess_planar(gait)
    ((_, (before, after)),) = law.impulses
    assert min(before[0], after[1]) > 0.1
    coarse, fine = (planar_differences(gait.robot, cycle, law, step=step) for step in (1e-6, 1e-7))
    assert cycle.derivative == pytest.approx(coarse, abs=1e-5)
    assert cycle.derivative == pytest.approx(fine, abs=1e-6)  # the torques are linear between nodes: error ~ step
    assert np.sort_complex(cycle.multipliers) == pytest.approx(np.sort_complex(np.linalg.eigvals(fine)), abs=1e-5)
    assert cycle.radius > 5  # the walk is unstable with its torques and impulses in open loop


def compass(*impulses, **changes):
    limits = PlanarLimits(torque={"ankle A": 6, "hip": 6, "ankle B": 0})
    return walk(friction=math.inf, impulses=impulses, limits=limits, **changes)


@pytest.mark.parametrize(
    ("impulses", "message"),
    [
        ([ActuatorImpulse("knee", "foot B closes")], "no actuator 'knee'"),
        ([ActuatorImpulse("hip", "foot A closes")], "no impact with the event 'foot A closes'.*'foot B closes'"),
        ([ActuatorImpulse("hip", event) for event in ("foot B closes", "foot A opens")], "'hip' has two impulses"),
    ],
)
def test_wrong_impulses_get_a_sentence(impulses, message):
    with pytest.raises(InputError, match=message):
        compass(*impulses)


@pytest.mark.parametrize("limits", [(1, 0), (0, 0), (0, math.nan), (0, 1, 2), 3])
def test_wrong_limits_get_a_sentence(limits):
    with pytest.raises(InputError, match="limits"):
        ActuatorImpulse("hip", "foot B closes", limits=limits)


def test_a_wrong_moment_gets_a_sentence():
    with pytest.raises(InputError, match="moment"):
        ActuatorImpulse("hip", "foot B closes", moment="during")


@dataclass(frozen=True)
class SquaredPower(Objective):
    """Integral of the squared positive powers."""

    name, unit, uses_power = "squared_power", "W^2 s", True

    def integrand(self, point):
        return ca.sumsqr(point.positive)


def test_an_objective_that_cannot_count_the_work_is_refused():
    with pytest.raises(InputError, match="'squared_power' is not linear"):
        solve_planar(compass(*ANKLES, objective=SquaredPower()))
