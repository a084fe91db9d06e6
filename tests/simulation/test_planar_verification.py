"""Optimal gaits of planar robots, replayed by the simulator from their first state and torques alone."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gaitopt import Collocation, Margins, load, verify
from gaitopt.errors import InputError
from gaitopt.model import monopod, vertical_hopper
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.planar_gait_summary import find_depths
from gaitopt.motion.planar_gait_table import tabulate_planar_gait
from gaitopt.ocp import PlanarLimits, solve_planar
from gaitopt.simulation import Tolerances, replay_planar, simulate_planar, verify_planar
from gaitopt.simulation.planar_verification import _compare_modes
from gaitopt.simulation.replay_difference import describe_differences, describe_first_difference
from gaitopt.status import Status
from tests.conftest import ROOT
from tests.ocp.multicontact_examples import drag, hop, inchworm, roll_off, stride, walk

COARSE = Collocation(intervals=10)
SLIPPING = {
    "friction": 0.14,
    "margins": Margins(),
    "limits": PlanarLimits(torque={"ankle A": 6, "hip": 6, "ankle B": 0}),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "problem",
    [
        walk(transcription=COARSE),
        walk("slip+ stick | slip+", **SLIPPING, transcription=Collocation(intervals=(5, 20))),
        walk("stick slip- | stick", **SLIPPING, transcription=Collocation(intervals=(20, 5))),
        hop(clearance=1e-3),
        hop("foot slip+ > foot stick > flight |", 0.3, 2e-3, (4, 8, 24)),
        roll_off(),
        drag(),
        stride(transcription=Collocation(intervals=12)),
    ],
    ids=lambda problem: f"{problem.robot.name}: {problem.sequence}",
)
def test_an_optimal_gait_is_replayed(problem):
    gait = verify_planar(solve_planar(problem))
    assert gait.verification.reasons == ()
    assert gait.status is Status.SOLVED
    assert gait.verification.state_error < 1e-6
    assert gait.verification.energy_residual < 1e-10


def test_a_foot_that_follows_the_ground_fails_its_replay():
    gait = verify(solve_planar(hop(clearance=0.0)))
    assert gait.status is Status.NOT_VERIFIED
    assert not gait.verification.passed
    assert any("state after the last event" in reason for reason in gait.verification.reasons)


def test_a_gait_with_other_torques_fails_its_replay():
    gait = solve_planar(walk(transcription=COARSE))
    segment = gait.motion.segments[0]
    changed = replace(gait.motion, segments=(replace(segment, torque=1.001 * segment.torque),))
    verified = verify_planar(gait.replace_fields(motion=changed))
    assert verified.status is Status.NOT_VERIFIED
    assert 1e-6 < verified.verification.state_error < 0.1


def test_a_replay_that_stops_names_the_time_the_event_and_the_contacts():
    gait = solve_planar(walk(transcription=COARSE))
    slippery = replace(gait.motion, parameters={**gait.motion.parameters, "friction": 0.05})
    stop, other = verify_planar(gait.replace_fields(motion=slippery)).verification.reasons
    assert re.fullmatch(
        r"the replay stopped at 0\.\d+ s, before the first event, with foot A slip\+: The walker fell\.", stop
    )
    assert other == "the replay has the contact sequence 'foot A slip+' instead of 'foot A stick |'"


def test_the_replay_has_the_motion_of_the_plan():
    gait = solve_planar(drag())
    rollout = replay_planar(gait)
    assert rollout.motion.sequence == gait.motion.sequence
    for plan, real in zip(gait.motion.segments, rollout.motion.segments, strict=True):
        foot = [np.interp(plan.time, part.time, part.points[0, 1]) for part in (plan, real)]
        assert np.abs(foot[0] - foot[1]).max() < 1e-3
        assert real.work[:, -1] == pytest.approx(plan.work[:, -1], abs=1e-6)
        assert real.friction_work[:, -1] == pytest.approx(plan.friction_work[:, -1], abs=1e-6)
    assert rollout.motion.events[-1].energy_lost == pytest.approx(gait.motion.events[-1].energy_lost, abs=1e-5)
    assert rollout.motion.events[-1].impulse == pytest.approx(gait.motion.events[-1].impulse, abs=1e-5)
    # The trailing foot receives no impulse and does not leave: the forces after the impact keep it on the ground.
    assert np.abs(rollout.motion.events[-1].impulse[1]).max() < 1e-6
    assert rollout.end.contacts.mode("foot B") is Mode.SLIP_FORWARD


INCHWORM = ["rear stick, front stick", "rear stick, front slip+", "rear stick, front stick", "rear slip+, front stick"]


@pytest.mark.slow
@pytest.mark.parametrize("first", range(4))
def test_the_replay_of_a_cyclic_sequence_is_independent_of_its_first_phase(first):
    """A period that begins at the onset of slip begins on the friction cone, where stick is consistent as well."""
    gait = verify_planar(solve_planar(inchworm(" > ".join([*INCHWORM[first:], *INCHWORM[:first]]) + " >")))
    assert gait.verification.reasons == ()
    assert gait.verification.sequence == gait.motion.sequence
    assert gait.verification.period_error < 1e-7


@pytest.mark.slow
def test_a_period_that_begins_inside_the_friction_cone_does_not_begin_with_slip():
    gait = solve_planar(inchworm(" > ".join([*INCHWORM[1:], INCHWORM[0]]) + " >"))
    rough = replace(gait.motion, parameters={**gait.motion.parameters, "friction": 0.301})
    first = replay_planar(gait.replace_fields(motion=rough)).motion.segments[0]
    assert first.state.mode("front") is Mode.STICK
    assert first.time[-1] > 1e-6
    assert not verify_planar(gait.replace_fields(motion=rough)).verification.passed


def test_tolerances_and_types_are_checked():
    gait = solve_planar(walk(transcription=COARSE))
    assert not verify_planar(gait, tolerances=Tolerances(state=1e-14)).verification.passed
    with pytest.raises(InputError, match="gait must be a PlanarGait"):
        verify_planar(3)


def test_the_depth_of_a_foot_that_swings_through_the_ground_is_reported():
    gait = solve_planar(walk(transcription=COARSE))  # straight legs, whose foot swings through the ground
    gaps = gait.motion.segments[0].kinematics.gap
    foot = gait.motion.contacts.index("foot B")
    depth = find_depths(gait)["foot B"]
    assert depth == -gaps[foot].min() > 1e-4
    rows = [text for name, text in tabulate_planar_gait(gait) if name == "below ground"]
    assert rows == [f"foot B by up to {1e3 * depth:.3g} mm in swing, while it is not armed"]
    assert find_depths(solve_planar(hop()))["foot"] < 1e-6
    inaccurate = tabulate_planar_gait(gait.replace_fields(status=Status.PLAN_INACCURATE))  # it may be armed there
    assert dict(inaccurate)["below ground"] == f"foot B by up to {1e3 * depth:.3g} mm in swing"


def test_the_first_event_that_differs_is_described_with_the_gap_of_the_contact_in_the_plan():
    robot, rest = monopod(), np.zeros(5)
    walked, planned = (
        simulate_planar(robot, [0, height, 0, 0, 0.6], rest, {}, until="foot closes").motion for height in (0.7, 0.701)
    )
    assert describe_first_difference(robot, walked, walked) is None
    lifted = replace(planned, events=(replace(planned.events[0], names=("foot opens",)),))
    assert describe_first_difference(robot, lifted, walked) == (
        f"the first event that differs is 'foot closes' at {walked.period:.4g} s of the replay, instead of 'foot "
        f"opens' at {planned.period:.4g} s of the plan; foot is then 1 mm above the ground in the plan"
    )


def test_an_unplanned_slip_has_the_margin_that_avoids_it_as_its_remedy():
    motion = simulate_planar(monopod(), [0, 0.7, 0, 0, 0.6], np.zeros(5), {}, until="foot closes").motion
    closes = motion.events[0]
    sticks = replace(closes.after, modes=tuple((name, Mode.STICK) for name, _ in closes.after.modes))
    slips = replace(closes, names=("foot slip+",), before=sticks, outcome=None)
    impact, free = replace(slips, outcome=closes.after), replace(slips, before=closes.before)
    assert impact.is_impact
    assert not slips.is_impact
    for event, advised in ((slips, True), (impact, False), (free, False)):
        text = describe_first_difference(monopod(), motion, replace(motion, events=(event,)))
        assert text.endswith("; use a larger Margins.cone") is advised


@pytest.mark.parametrize(("is_impact", "advised"), [(True, True), (False, False)])
def test_an_impact_that_slips_instead_of_sticking_has_its_margin_as_remedy(is_impact, advised):
    sticks = ContactState((("foot", Mode.STICK),))
    plan = SimpleNamespace(after=sticks, impulse=np.array([[0.1, 1.0]]), is_impact=is_impact)
    end = SimpleNamespace(contacts=ContactState((("foot", Mode.SLIP_FORWARD),)))
    (text,) = _compare_modes(plan, end)
    assert text.startswith("foot is slip+ after the last event instead of stick")
    assert text.endswith("use a larger Margins.impact_cone") is advised


def test_an_early_touchdown_of_an_armed_contact_has_its_remedy():
    gait = solve_planar(walk(transcription=COARSE))  # straight legs, whose foot swings through the ground
    motion, (segment,) = gait.motion, gait.motion.segments
    arming = [
        float(gait.robot.arming(q, v, gait.robot.vector(motion.parameters))[motion.contacts.index("foot B")])
        for q, v in zip(segment.q.T, segment.v.T, strict=True)
    ]
    remedy = ", and armed: use a larger PlanarLimits.clearance, or a larger threshold in `armed` of the contact"
    armed, unarmed = (int(np.flatnonzero(kind)[2]) for kind in (np.greater(arming, 0), np.less(arming, 0)))
    for sample, ending in ((armed, remedy), (unarmed, " in the plan, and not armed")):
        early = replace(motion.events[0], names=("foot B closes",), time=segment.time[sample])
        late = replace(motion.events[0], names=("foot A opens",))
        planned, walked = (replace(motion, events=(event,)) for event in (late, early))
        assert describe_first_difference(gait.robot, planned, walked).endswith(ending)


def test_the_gap_of_a_stop_that_closes_early_is_its_distance_from_the_limit():
    robot = vertical_hopper()
    motion = simulate_planar(robot, [0.7, 0.2], [0, 0], {}, duration=0.5).motion
    segment = next(each for each in motion.segments if each.state.mode("full length") is Mode.FREE)
    body, foot = segment.q[:, segment.time.size // 2]
    early = replace(motion.events[0], names=("full length closes",), time=segment.time[segment.time.size // 2])
    walked = replace(motion, events=(early,))
    assert describe_first_difference(robot, motion, walked).endswith(
        f"; full length is then {0.5 - (body - foot):.2g} m before its limit in the plan"
    )


def test_an_early_touchdown_is_described_even_if_the_sequences_agree():
    """If another point of the landing foot touches down first, the contact sequence of the replay may be the plan's."""
    robot = monopod()
    planned = simulate_planar(robot, [0, 0.7, 0, 0, 0.6], np.zeros(5), {}, until="foot closes").motion
    walked = replace(planned, events=(replace(planned.events[0], names=("toe closes",)),))
    assert walked.sequence == planned.sequence
    (text,) = describe_differences(robot, planned, walked)
    assert text.startswith("the first event that differs is 'toe closes' at")


def test_the_replay_of_a_soft_touchdown_states_its_reason_and_its_whole_sequence():
    gait = solve_planar(walk(transcription=COARSE))
    (event,) = gait.motion.events
    soft = replace(gait.motion, events=(replace(event, outcome=None),))
    failed = verify_planar(gait.replace_fields(motion=soft))
    reason, other, *_ = failed.verification.reasons
    assert reason.startswith(f"the touchdown 'foot B closes' at {event.time:.4g} s of the plan is soft ('>')")
    assert "on any grid" in reason
    assert "Margins(touchdown_rate=0.1)" in reason
    assert other == "the replay has the contact sequence 'foot A stick |' instead of 'foot A stick >'"
    assert "Unless the reported reasons state another remedy" in failed.status.hint
    assert not any("soft" in text for text in verify_planar(gait).verification.reasons)


def test_the_former_names_of_the_release_of_a_latched_contact_are_no_difference():
    """Earlier versions stated that a latched knee opens, or that it is closed if it can push from then on."""
    robot = vertical_hopper()
    walked = simulate_planar(robot, [0.7, 0.2], [0, 0], {}, until="sole opens").motion
    (event, *others), latch = walked.events, robot.contact_names[0]
    before = ContactState.of({name: "latched" if name == latch else "free" for name in robot.contact_names})
    first = replace(event, names=(f"{latch} opens",), before=before)
    simulated = replace(walked, events=(first, *others))
    planned = replace(walked, events=(replace(first, names=(f"{latch} released",)), *others))
    assert describe_first_difference(robot, planned, simulated) is None
    closed = replace(walked, events=(replace(first, names=(f"{latch} closed",)), *others))
    assert describe_first_difference(robot, planned, closed) is None
    other = replace(walked, events=(replace(first, names=("sole closes",)), *others))
    assert "'sole closes'" in describe_first_difference(robot, planned, other)


def test_a_contact_that_sinks_beside_another_one_of_its_body_is_not_in_swing():
    gait = load(ROOT / "docs" / "examples" / "heel_toe.h5")
    *others, last = gait.motion.segments
    heel, toe = (gait.motion.contacts.index(name) for name in ("heel a", "toe a"))
    assert [last.state.modes[place][1] for place in (heel, toe)] == [Mode.FREE, Mode.STICK]
    gap = last.kinematics.gap.copy()
    gap[heel, 3] = -2e-3
    sinking = last.replace_fields(kinematics=replace(last.kinematics, gap=gap))
    motion = replace(gait.motion, segments=(*others, sinking))
    rows = [text for name, text in tabulate_planar_gait(gait.replace_fields(motion=motion)) if name == "below ground"]
    assert "heel a by up to 2 mm while toe a of the same body is on the ground, and is not armed there" in rows
