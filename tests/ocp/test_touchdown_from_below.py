"""Contacts that are below the ground while they are armed: depths, touchdowns from below, plan, replay and messages."""

from types import SimpleNamespace

import numpy as np
import pytest

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion import ground_penetration
from gaitopt.motion.ground_penetration import (
    Penetration,
    SampledPart,
    continue_swing,
    find_penetrations,
    find_penetrations_of_parts,
)
from gaitopt.motion.planar_gait_table import _describe_rise, tabulate_planar_gait
from gaitopt.ocp import solve_planar
from gaitopt.ocp.multicontact.grid_result import GridResult
from gaitopt.ocp.multicontact.planar_remarks import report_penetrations
from gaitopt.simulation import verify_planar
from gaitopt.simulation.planar_verification import replay_planar
from gaitopt.status import Status
from gaitopt.study.audit.contact_solver import Contacts, ContactSolver
from gaitopt.study.audit.second_planar_replay import replay_planar_again
from gaitopt.study.audit.swing_watch import SwingWatch
from tests.walkers.heel_toe import heel_toe_step, heel_toe_walker

HEEL = "heel b"
FREE = (Mode.FREE,) * 5


def pose(gap, angle, rate=0.0):
    """Return coordinates and rates with a gap of heel b [m], an angle of leg b [rad], and the rate of the gap."""
    robot, q = heel_toe_walker(0.2), np.array([0.0, 0.0, -0.1, angle])
    q[1] = gap - float(robot.gaps(q, robot.vector(robot.resolve({})))[0][robot.contact_index(HEEL)])
    return q, np.array([0.0, rate, 0.0, 0.0])


def part_of(gap, angle=0.2, *, time=(0.0, 1.0), closing=()):
    """Return a part in which the gap of heel b is a cubic polynomial of time; the heel is armed above 0.1 rad."""
    at, robot = np.linspace(*time, 7), heel_toe_walker(0.2)
    q, v = (np.array(rows).T for rows in zip(*(pose(gap(t), angle, gap.deriv()(t)) for t in at), strict=True))
    return SampledPart(FREE, at, q, v, frozenset(robot.contact_index(name) for name in closing))


def penetrations_of(*parts):
    robot = heel_toe_walker(0.2)
    penetrations = find_penetrations_of_parts(robot, robot.resolve({}), parts)
    return [each for each in penetrations if each.contact == HEEL]


def test_depth_and_rise_are_those_of_the_polynomial():
    """The gap 0.1 t (t - 0.5) (t - 1.3) - 0.001 has one minimum and is positive at first."""
    gap = -np.polynomial.Polynomial.fromroots([0.0, 0.5, 1.3]) * 0.1
    extrema = sorted(float(root) for root in gap.deriv().roots() if 0 < root < 1.3)
    (penetration,) = penetrations_of(part_of(gap, time=(0.0, 1.3), closing=[HEEL]))
    assert penetration.depth == pytest.approx(-gap(extrema[0]), rel=1e-2)
    assert penetration.rise == pytest.approx(gap(extrema[1]), rel=1e-2)
    assert penetration.deepest == pytest.approx(extrema[0], abs=0.06)
    assert penetration.lands
    assert penetration.is_touchdown_from_below is (penetration.rise <= penetration.depth)


@pytest.mark.parametrize("angle", [0.05, 0.15])
def test_only_an_armed_contact_counts(angle):
    below = np.polynomial.Polynomial([-0.002])
    assert len(penetrations_of(part_of(below, angle))) == (angle > 0.1)


def test_a_swing_continues_over_events_of_other_contacts_and_ends_with_its_touchdown():
    below, above = np.polynomial.Polynomial([-0.002]), np.polynomial.Polynomial([0.005])
    (penetration,) = penetrations_of(part_of(below), part_of(above, time=(1.0, 2.0), closing=[HEEL]))
    assert (penetration.rise, penetration.lands, penetration.is_touchdown_from_below) == (
        pytest.approx(0.005),
        True,
        False,
    )
    (penetration,) = penetrations_of(part_of(below, closing=[HEEL]), part_of(above, time=(1.0, 2.0)))
    assert (penetration.rise, penetration.lands, penetration.is_touchdown_from_below) == (
        pytest.approx(-0.002),
        True,
        True,
    )


@pytest.mark.parametrize(
    ("rise", "lands", "is_invalid"),
    [(1e-7, True, True), (1e-3, True, True), (3e-3, True, False), (1e-7, False, False), (-1e-4, False, True)],
)
def test_a_touchdown_is_from_below_unless_the_contact_rises_more_than_it_was_deep(rise, lands, is_invalid):
    penetration = Penetration(contact=HEEL, begin=0.3, deepest=0.4, depth=2e-3, rise=rise, lands=lands)
    assert penetration.is_touchdown_from_below is is_invalid
    assert penetration.describe().startswith(
        f"contact '{HEEL}' is below the ground while it is armed, from 0.3 s, by up to 2 mm"
    )
    sentences = report_penetrations([penetration])
    assert len(sentences) == is_invalid  # nothing has to be changed after a valid touchdown
    assert all(sentence.startswith(penetration.describe()) for sentence in sentences)
    assert all("touchdown from below is invalid" in sentence for sentence in sentences)


def least_armed_gap(gait):
    """Return the least gap of heel b while it is armed and free, at the samples of the replay."""
    robot, motion = gait.robot, replay_planar(gait).motion
    place, p, least = robot.contact_index(HEEL), robot.vector(motion.parameters), np.inf
    for segment in motion.segments:
        for q, v in zip(segment.q.T, segment.v.T, strict=True):
            if segment.state.mode(HEEL) is Mode.FREE and float(robot.arming(q, v, p)[place]) > 0:
                least = min(least, float(robot.gaps(q, p)[0][place]))
    return least


@pytest.mark.slow
@pytest.mark.parametrize(("threshold", "limits"), [(0.15, {}), (0.2, {}), (0.05, {"clearance": 0.002})])
def test_the_armed_heel_of_an_optimal_gait_is_above_the_ground(threshold, limits):
    gait = verify_planar(solve_planar(heel_toe_step(threshold, **limits)))
    assert gait.status.ok
    assert gait.verification.passed
    assert least_armed_gap(gait) > -1e-9
    assert gait.solver.warnings == ()
    if not limits:  # the gait of lowest cost is above the ground for both thresholds
        assert gait.cost_of_transport == pytest.approx(0.0721294670, rel=1e-7)


@pytest.fixture(scope="module")
def from_below():
    """Return a gait whose heel is 1.9 mm below the ground while armed, and rises by less than 1e-6 m to touch down."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(GridResult, "list_raised_rows", lambda self: {})
        return solve_planar(heel_toe_step(0.2, intervals=8))


@pytest.mark.slow
def test_a_touchdown_from_below_is_not_a_solution(from_below):
    assert from_below.status is Status.PLAN_INACCURATE
    assert any("touchdown from below is invalid" in warning for warning in from_below.solver.warnings)
    rows = [text for name, text in tabulate_planar_gait(from_below) if name == "below ground"]
    assert rows[0].startswith(HEEL)
    assert rows[0].endswith("1.91 mm while it is armed")


@pytest.mark.slow
def test_a_touchdown_from_below_does_not_pass_the_replay(from_below):
    gait = verify_planar(from_below.replace_fields(status=Status.SOLVED))
    assert gait.status is Status.NOT_VERIFIED
    assert gait.verification.sequence == str(gait.sequence)
    assert gait.verification.state_error < 1e-6
    (reason,) = gait.verification.reasons
    depth = -least_armed_gap(gait)
    assert depth == pytest.approx(1.9e-3, abs=1e-4)
    (penetration,) = find_penetrations(gait.robot, replay_planar(gait).motion)
    assert depth <= penetration.depth < 1.01 * depth  # it is evaluated between the samples, too
    assert reason == penetration.describe_touchdown()
    assert replay_planar_again(gait).reason


def test_the_second_replay_finds_a_touchdown_from_below():
    """Depth and rise are recorded while the heel is armed; a closed heel begins a new swing."""
    robot = heel_toe_walker(0.2)
    heel, p = robot.contact_index(HEEL), robot.vector(robot.resolve({}))
    watch = SwingWatch(ContactSolver(robot, p, (1.0, 1.0)))

    def record(gap, angle=0.2, closed=()):
        watch.record(closed, np.concatenate(pose(gap, angle)))
        return watch.find_touchdown_from_below(heel, last=True), watch.find_touchdown_from_below(None, last=True)

    assert record(-0.002, 0.05) == (None, None)
    assert record(-0.002) == (heel, heel)
    assert record(0.001) == (heel, None)
    assert record(0.003) == (None, None)
    assert record(-0.001) == (heel, heel)
    assert record(0.0, closed=(heel,)) == (None, None)


def test_the_second_replay_accepts_a_robot_with_one_actuator():
    robot = heel_toe_walker(0.2)
    solver = ContactSolver(robot, robot.vector(robot.resolve({})), (1.0, 1.0))
    q, v = pose(0.1, 0.2)
    state = np.concatenate([q, v])
    rates = [solver.accelerate(Contacts((), ()), state, np.array([torque]))[0] for torque in (0.0, 2.0)]
    mass, _, actuation = (np.array(part) for part in robot.dynamics(q, v, solver.p))
    assert mass @ (rates[1] - rates[0]) == pytest.approx(2 * actuation.ravel())


@pytest.mark.parametrize("lands", [False, True])
def test_the_rise_of_a_swing_that_lasts_into_the_next_period_includes_it(monkeypatch, lands):
    """Heel b is in the next period what heel a is in this one."""
    robot, values = heel_toe_walker(0.2), heel_toe_walker(0.2).resolve({})
    part = part_of(np.polynomial.Polynomial([-0.002]), 0.15, closing=["heel a"] if lands else [])
    monkeypatch.setattr(ground_penetration, "list_parts", lambda robot, motion: [part])
    (penetration,) = penetrations_of(part)
    swing = continue_swing(robot, SimpleNamespace(parameters=values), penetration)
    gap = float(robot.gaps(part.q[:, 0], robot.vector(values))[0][robot.contact_index("heel a")])
    assert penetration.rise == pytest.approx(-0.002)
    assert not penetration.lands
    assert swing.rise == pytest.approx(gap)
    assert swing.lands is lands
    assert continue_swing(robot, SimpleNamespace(parameters=values), swing).rise == swing.rise


@pytest.mark.parametrize(
    ("rise", "lands", "ending"),
    [
        (3e-3, True, "3 mm above the ground, a height greater than this depth, so that its touchdown is valid"),
        (1e-3, True, "1 mm above the ground, a height not greater than this depth"),
        (3e-3, False, "3 mm above the ground by the end of the motion"),
    ],
)
def test_the_table_states_the_swing_to_which_a_rise_belongs(rise, lands, ending):
    swing = Penetration(contact=HEEL, begin=0.3, deepest=0.4, depth=2e-3, rise=rise, lands=lands)
    assert _describe_rise(swing) == f"; it then rises to {ending}"
