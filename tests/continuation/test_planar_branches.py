"""Branches of robots with several contacts: closed forms, other computations of the same gaits, finite differences."""

import json
import math
from dataclasses import replace

import attrs
import numpy as np
import pytest

from gaitopt import InputError, WalkProblem, compass_biped, joint_pd, load, load_diagram, trace
from gaitopt.cli.script import call_script
from gaitopt.continuation import ArclengthOptions, TraceOptions, gaits_at, save_diagram, trace_curve, two_parameters
from gaitopt.continuation.gait_source import make_gait_source
from gaitopt.continuation.parameter_values import check_range
from gaitopt.continuation.planar_changes import classify_planar_change, ends_early
from gaitopt.model import compass_with_two_feet
from gaitopt.simulation import default_engine, planar_engine_named
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.stability import PlanarWalkProblem, assess_stability
from gaitopt.stability.planar_gaits.planar_linearisation import event_derivative
from tests.conftest import ROOT

ONE_START = TraceOptions(starts=1, arclength=ArclengthOptions(first_step=0.2, longest_step=0.4))
LONG_STEPS = TraceOptions(starts=1, arclength=ArclengthOptions(first_step=0.5, longest_step=1.0))


@pytest.fixture(scope="module")
def hopper():
    return call_script(ROOT / "problems" / "hopper.py", [])


@pytest.fixture(scope="module")
def hopper_diagram(hopper):
    return trace(hopper, {"thrust": (0.02, 0.03)}, options=ONE_START)


@pytest.fixture(scope="module")
def kneed_walker():
    return call_script(ROOT / "problems" / "kneed_walker.py", ["friction=0.6"])


@pytest.fixture(scope="module")
def two_feet():
    return PlanarWalkProblem(
        robot=compass_with_two_feet(),
        section="foot B closes",
        coordinates={"x": 0, "a": 0.1478, "b": -0.1478},
        rates={"a": -0.7328, "b": -0.5007},
        on=("foot A",),
        parameters={"slope": math.radians(1)},
    )


def test_the_hopper_follows_the_closed_form(hopper_diagram):
    # As in tests/stability/test_planar_cycles.py: the work of the thrust is the energy lost at landing and lift-off.
    (branch,) = hopper_diagram.branches
    body, ratio, stiffness, gravity = 8.0, 0.8, 4000.0, 9.81
    assert (branch.names, branch.units, branch.end) == (("body_rate",), ("m/s",), "range_end")
    height = branch.states[:, 0] ** 2 / (2 * gravity)
    root = np.sqrt((body * gravity) ** 2 + 2 * stiffness * body * gravity * height)
    assert branch.multipliers[:, 0].real == pytest.approx(ratio**2 * (1 + stiffness * branch.values / root), abs=1e-9)
    assert set(branch.sequences) == {"sole closed > sole closed | full length latched | sole closed"}


def test_the_fast_engine_follows_the_same_hops(hopper, hopper_diagram):
    pytest.importorskip("heyoka")
    fast = attrs.evolve(ONE_START, engine=planar_engine_named("heyoka"))
    (branch,) = trace(hopper, {"thrust": (0.02, 0.03)}, options=fast).branches
    (reference,) = hopper_diagram.branches
    assert branch.sequences == reference.sequences
    assert branch.values[[0, -1]] == pytest.approx(reference.values[[0, -1]])
    for row in (0, -1):
        assert branch.states[row] == pytest.approx(reference.states[row], abs=1e-8)
        assert branch.multipliers[row] == pytest.approx(reference.multipliers[row], abs=1e-8)


def test_a_diagram_of_a_planar_robot_is_read_as_it_was_written(hopper_diagram, tmp_path):
    restored = load_diagram(save_diagram(hopper_diagram, tmp_path / "hopper.nc"))
    assert json.dumps(restored.records()) == json.dumps(hopper_diagram.records())
    assert restored.branches[0].units == ("m/s",)


def test_gaits_at_a_value_are_those_of_newtons_method(hopper, hopper_diagram):
    (gait,) = gaits_at(hopper, hopper_diagram, 0.02)
    assert gait.state["body_rate"] == pytest.approx(hopper_diagram.branches[0].states[0, 0], abs=1e-9)
    assert gait.multipliers == pytest.approx([0.78107619584119], abs=1e-9)  # closed form


def test_the_derivatives_of_the_kneed_walker_agree_with_differences(kneed_walker):
    cycle = next(kneed_walker.search(1))
    source = make_gait_source(kneed_walker, {"slope": (0.0504, 0.06)})
    family, z, value = source.start(cycle)
    assert family.names == ("a", "a_rate", "b_rate", "foot A slip speed")
    sample = family.evaluate(z, value)
    exact = family.derivative(z, value, sample)
    assert np.max(np.abs(sample.residual)) < 1e-12
    assert family.multipliers(exact, sample) == pytest.approx(cycle.multipliers, abs=1e-8)
    for place in range(3):  # the foot sticks: its slip speed has no effect
        shift = 1e-6 * np.eye(4)[place]
        ends = [family.evaluate(z + sign * shift, value).residual for sign in (1, -1)]
        assert (ends[0] - ends[1]) / 2e-6 == pytest.approx(exact[:, place], abs=2e-7)
    ends = [family.evaluate(z, value + sign * 1e-6).residual for sign in (1, -1)]
    assert (ends[0] - ends[1]) / 2e-6 == pytest.approx(exact[:, -1], abs=2e-6)
    assert family.measures(z, value, sample)["scuffing"] > 0


def test_the_clearance_is_the_lowest_gap_in_mid_swing(kneed_walker):
    cycle = next(kneed_walker.search(1))
    source = make_gait_source(kneed_walker, {"slope": (0.0504, 0.06)})
    family, z, value = source.start(cycle)
    clearance = family.measures(z, value, family.evaluate(z, value))["scuffing"]
    gaps = np.concatenate([segment.kinematics.gap[3] for segment in cycle.motion.segments])
    inner = [k for k in range(1, gaps.size - 1) if gaps[k - 1] >= gaps[k] <= gaps[k + 1]]
    assert clearance == pytest.approx(min(gaps[inner]), abs=1e-4)
    assert clearance <= min(gaps[inner]) + 1e-12


@pytest.fixture(scope="module")
def two_feet_diagram(two_feet):
    return trace(two_feet, {"friction": (0.1755, 0.1743)}, options=LONG_STEPS)


@pytest.mark.slow
def test_two_feet_slip_where_one_contact_at_a_time_slips(two_feet_diagram):
    # The value of the robot with one foot on the ground at a time, from another simulator: docs/howto/branches.md.
    (branch,) = two_feet_diagram.branches
    (onset,) = branch.special
    assert onset.kind.key == "slip_onset"
    assert onset.value == pytest.approx(0.174918491, abs=1e-8)
    assert onset.after == "foot A slip+ > foot A stick | foot B stick"
    assert np.abs(onset.multipliers_before) == pytest.approx(np.abs(onset.multipliers_after), abs=1e-5)


@pytest.mark.slow
def test_the_fast_engine_follows_the_same_branch(two_feet, two_feet_diagram):
    pytest.importorskip("heyoka")
    fast = attrs.evolve(LONG_STEPS, engine=default_engine())  # which names the engine of robots with several contacts
    assert fast.engine.name == "heyoka"
    (branch,) = trace(two_feet, {"friction": (0.1755, 0.1743)}, options=fast).branches
    (reference,) = two_feet_diagram.branches
    assert branch.values[[0, -1]] == pytest.approx(reference.values[[0, -1]])
    for row in (0, -1):
        assert branch.states[row] == pytest.approx(reference.states[row], abs=1e-8)
        assert np.abs(branch.multipliers[row]) == pytest.approx(
            np.abs(reference.multipliers[row]), abs=1e-8, nan_ok=True
        )
    (onset,), (other,) = branch.special, reference.special
    assert (onset.kind, onset.after) == (other.kind, other.after)
    assert onset.value == pytest.approx(other.value, abs=1e-9)
    assert np.abs(onset.multipliers_after) == pytest.approx(np.abs(other.multipliers_after), abs=1e-8)


ONSET_AT_TOUCHDOWN = 0.17308079724
MULTIPLIERS_AT_TOUCHDOWN = [0.4833284242 + 0.5195586268j, 0.4833284242 - 0.5195586268j, 0.3855601631]
"""Friction at which the slip of the second onset begins exactly at the touchdown, and the multipliers on both sides:
`trace` of the robot with one foot on the ground at a time, another simulator (docs/howto/branches.md)."""


@pytest.mark.parametrize("beside", [2e-10, -2e-10])
def test_multipliers_are_exact_where_slip_begins_at_the_touchdown(two_feet, beside):
    z = np.array([0.147836746684, -0.732796271041, -0.500668250391, 0.0])
    family = make_gait_source(two_feet, {"friction": (0.174, 0.173)}).start(next(two_feet.search(1))).family
    value = ONSET_AT_TOUCHDOWN + beside
    for _ in range(4):
        sample = family.evaluate(z, value)
        derivative = family.derivative(z, value, sample, by_value=np.zeros(4))
        z = z - np.linalg.solve(derivative[:, :4], sample.residual)
    onset = sample.structure.endswith("foot A stick > foot A slip- | foot B stick")
    assert onset is (beside < 0)
    assert family.multipliers(derivative, sample) == pytest.approx(MULTIPLIERS_AT_TOUCHDOWN, abs=1e-8)


def test_the_time_of_an_impact_is_that_of_the_contact_that_closes(two_feet):
    cycle = next(two_feet.search(1))
    family, z, value = make_gait_source(two_feet, {"friction": (0.3, 0.2)}).start(cycle, 0.25)
    rollout = family.evaluate(z, value).passage[0]
    arc, event = rollout.arcs[-1], rollout.motion.events[-1]
    automaton = PlanarAutomaton(two_feet.robot, {**cycle.parameters, "friction": value})
    exact = event_derivative(automaton, arc, event, None)
    kinds = automaton.phase(arc.start).equations.guards
    coincident = arc._replace(ended_by=next(kind for kind in kinds if kind.name == "slips-"))
    assert arc.ended_by.name == "closes"
    assert event_derivative(automaton, coincident, event, None) == pytest.approx(exact, abs=1e-14)


@pytest.mark.slow
def test_gains_of_a_law_are_parameters():
    gait = load(ROOT / "docs/examples/compass_slip.h5")
    law = joint_pd(gait.robot, gait.motion, stiffness=2.0, damping=0.2)
    start = assess_stability(gait, law)
    problem = WalkProblem(robot=gait.robot, parameters=gait.motion.parameters, law=law)
    branch = trace(problem, {"hip_stiffness": (2.0, 1.0)}, start=start, options=LONG_STEPS).branches[0]
    assert branch.values[[0, -1]] == pytest.approx([2.0, 1.0])
    expected = assess_stability(gait, law.with_gains({"hip_stiffness": 1.0}))
    assert np.abs(branch.multipliers[-1]) == pytest.approx(np.abs(expected.multipliers), abs=1e-7)
    with pytest.raises(InputError, match=r"under the law 'joint_pd' has no parameter 'hip_stifness'. Did you mean"):
        trace(problem, {"hip_stifness": (2.0, 1.0)}, start=start)


def test_a_gain_without_a_law_is_explained():
    problem = WalkProblem(robot=compass_biped(), parameters={"slope": 0.05})
    with pytest.raises(InputError, match=r"has no parameter 'hip_stiffness'.* which --law states\.$"):
        check_range(problem, "hip_stiffness", (1.0, 2.0))


def test_a_whole_number_is_no_parameter_of_a_branch():
    from gaitopt import rimless_wheel

    with pytest.raises(InputError, match="spokes is a whole number"):
        trace(WalkProblem(robot=rimless_wheel()), {"spokes": (8, 12)})


@pytest.mark.parametrize(
    ("before", "after", "kind"),
    [
        ("A stick | B stick", "A stick > A slip- | B stick", "slip_onset"),
        ("A stick | B stick", "A slip+ > A stick | B slip+", "impact_cone"),
        ("A slip+ > A stick > A slip- | B stick", "A slip+ > A slip- | B stick", "loss_of_stick"),
        ("A stick | A stick, K latched | B stick", "A stick | B stick", "joint_stop"),
        ("A stick > flight > A stick | B stick", "A stick | B stick", "sequence_change"),
        ("A stick | A stick, B stick > B stick | A stick", "A stick | B stick | A stick", "event_coincidence"),
        ("A stick | B stick", "A stick | A stick, B stick", "double_support"),
        ("A stick | B stick", "A stick | A stick, B stick | B stick", "scuffing"),
        ("A stick | B stick; A stick | B stick", "A stick | B stick; A stick > A slip- | B stick", "slip_onset"),
    ],
)
def test_changes_are_named_by_what_appears(before, after, kind):
    assert classify_planar_change(before, after, ["K"]).key == kind


def test_a_step_that_ends_before_the_knee_strikes_ends_early():
    assert ends_early("A stick | A stick, K latched | B stick", "A stick | B stick")
    assert not ends_early("A stick | B stick", "A stick | A stick, K latched | B stick")


@pytest.mark.slow
def test_a_special_point_is_followed_over_a_second_parameter(two_feet, two_feet_diagram, monkeypatch):
    monkeypatch.setattr(two_parameters, "MOST_POINTS", 1)  # each point is located by bisection
    slope = math.radians(1)
    curve = trace_curve(two_feet, two_feet_diagram, {"slope": (slope, slope + 1e-4)}, options=ONE_START)
    assert curve.kind.key == "slip_onset"
    assert curve.begin == "range_end"
    assert min(curve.values[:, 1]) == pytest.approx(slope, abs=1e-12)  # the start is on the border of the range
    place = int(np.argmin(np.abs(curve.values[:, 1] - slope)))
    assert curve.values[place] == pytest.approx([0.174918491, slope], abs=1e-8)
    moved, known = curve.values[-1], curve.values[place]
    assert moved[1] > slope
    across = replace(two_feet, parameters={**two_feet.parameters, "slope": moved[1]})
    critical = next(across.search(1)).critical_friction
    assert known[0] < moved[0] == pytest.approx(critical.friction, abs=1e-8)
