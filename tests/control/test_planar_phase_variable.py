"""Laws of robots with several contacts as functions of a phase variable: plan, flight, exact derivatives, refusals."""

import functools
import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from gaitopt import Collocation, InputError
from gaitopt.control import PlanarLaw, by_phase_variable, planar_feedforward, planar_joint_pd, planar_step_to_step
from gaitopt.control.planar_laws.planar_reference import planar_references
from gaitopt.control.planar_laws.stretches import choose_stance_contact, find_stretches
from gaitopt.model import monopod
from gaitopt.ocp import solve_planar
from gaitopt.simulation import planar_engine_named, simulate_planar
from gaitopt.simulation.planar_simulation.phase_torque import LawState
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_simulator import follow
from gaitopt.simulation.planar_simulation.planar_torque import make_torque
from gaitopt.stability import assess_planar
from gaitopt.stability.planar_gaits.planar_linearisation import planar_derivative
from gaitopt.study.robustness.disturbed_gait import PlanarDisturbedGait
from gaitopt.tuning import planar_lqr, planar_step_lqr
from tests.ocp.multicontact_examples import drag, hop, knee_strike, walk
from tests.stability.difference_quotients import planar_differences

PROBLEMS = {
    "hop": lambda: hop(clearance=1e-2, intervals=(6, 16)),
    "walk": lambda: walk(transcription=Collocation(intervals=10)),
    "knee strike": lambda: knee_strike().replace(step_length=0.45),
}


@pytest.fixture(scope="module")
def gaits():
    return {name: solve_planar(problem()) for name, problem in PROBLEMS.items()}


@pytest.fixture(scope="module")
def control(gaits):
    """Return a function that gives an LQR by the phase variable and the periodic gait under it, computed once."""

    @functools.cache
    def compute(name):
        law = by_phase_variable(gaits[name], planar_lqr(gaits[name]))
        return law, assess_planar(gaits[name], law)

    return compute


@pytest.fixture(params=PROBLEMS)
def gait(request, gaits):
    return gaits[request.param]


def torque_of(gait, law, part, t, q, v, *, mirrored=False):
    memory = LawState(part, 0.0, (0.0,) * len(law.latched), mirrored)
    return make_torque(gait.robot, law).phase_torque(memory).value(t, q, v).copy()


def test_the_stretches_of_a_period(gaits):
    hop, walk, knee = (find_stretches(gaits[name]) for name in PROBLEMS)
    assert [(each.part, each.contact, each.ending) for each in hop] == [(0, "foot", "foot opens"), (0, None, None)]
    assert [(each.part, each.contact, each.ending) for each in walk] == [(0, "foot A", None)]
    assert [(each.part, each.contact, each.ending) for each in knee] == [(0, "foot A", None), (1, "foot A", None)]
    assert hop[0].span[1] == hop[1].span[0] == gaits["hop"].motion.segments[1].time[0]


def test_the_stance_contact_is_the_one_that_stays_longest():
    closed = [("A",), ("B", "A"), ("B",), ()]
    assert choose_stance_contact(closed, 0, shared=False) == ("A", 1)
    assert choose_stance_contact(closed, 1, shared=False) == ("B", 2)
    assert choose_stance_contact(closed, 0, shared=True) == ("B", 2)
    assert choose_stance_contact(closed, 3, shared=True) == (None, 3)
    assert choose_stance_contact([("heel", "toe"), ("heel", "toe")], 0, shared=False) == ("heel", 1)


def test_the_law_has_the_planned_torques_in_the_planned_states_at_any_time(gait):
    law, stretches = by_phase_variable(gait, planar_feedforward(gait)), find_stretches(gait)
    for part, stretch in enumerate(stretches):
        for number in stretch.phases:
            segment = gait.motion.segments[number]
            nodes = planar_references(gait)[stretch.part].breakpoints
            for k in np.flatnonzero(np.isin(segment.time, nodes)):
                for t in (segment.time[k], 100.0):  # the law depends on the state only
                    found = torque_of(gait, law, part, t, segment.q[:, k], segment.v[:, k])
                    np.testing.assert_allclose(found, segment.torque[:, k], rtol=1e-6, atol=1e-5)


def test_feedback_refers_to_the_planned_state_of_the_same_phase(gaits):
    """A joint that deviates across the phase variable demands the stiffness; one along it has another reference."""
    gait = gaits["walk"]
    law = by_phase_variable(gait, planar_joint_pd(gait, stiffness=7.0))
    segment = gait.motion.segments[0]
    k = segment.time.size // 2
    q, v = segment.q[:, k].copy(), segment.v[:, k]
    swing = gait.robot.coordinates.index("b")
    q[swing] += 1e-3
    change = torque_of(gait, law, 0, 0.0, q, v) - torque_of(gait, law, 0, 0.0, segment.q[:, k], v)
    hip = gait.robot.actuators.index("hip")
    assert abs(change[hip]) == pytest.approx(7e-3, rel=1e-6)


def test_the_phase_variable_of_a_flight_falls_with_gravity(gaits):
    gait = gaits["hop"]
    variable = by_phase_variable(gait, planar_feedforward(gait)).parts[1].phase_variable
    flight = gait.motion.segments[1]
    rates = [float(variable(q, v)) for q, v in zip(flight.q.T, flight.v.T, strict=True)]
    np.testing.assert_allclose(np.diff(rates) / np.diff(flight.time), 9.81, rtol=1e-5)


@pytest.mark.slow
def test_the_flight_begins_when_the_stance_contact_opens(gaits):
    gait = gaits["hop"]
    law = by_phase_variable(gait, planar_lqr(gait))
    first = gait.motion.segments[0]
    walk = simulate_planar(
        gait.robot, first.q[:, 0], first.v[:, 0], gait.motion.parameters, torque=law, duration=1.3 * gait.period
    )
    opening = next(k for k, event in enumerate(walk.motion.events) if event.includes("foot opens"))
    parts = [arc.start.memory.part for arc in walk.arcs]
    assert set(parts[: opening + 1]) == {0}
    assert parts[opening + 1] == 1
    closing = next(k for k, event in enumerate(walk.motion.events) if event.includes("foot closes"))
    assert parts[closing + 1] == 0


LAWS = {"open loop": planar_feedforward, "lqr": planar_lqr, "step_lqr": planar_step_lqr}
CASES = [("walk", "open loop"), ("walk", "lqr"), ("walk", "step_lqr"), ("knee strike", "lqr"), ("hop", "lqr")]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "kind"), CASES)
def test_multipliers_agree_with_differences_of_the_return_map(gaits, name, kind):
    gait, by_clock = gaits[name], LAWS[kind](gaits[name])
    law = by_phase_variable(gait, by_clock)
    cycle = assess_planar(gait, law)
    assert cycle.period == pytest.approx(gait.period, abs=1e-6)
    assert (cycle.radius < 1) is (kind != "open loop" or name == "walk")
    found = planar_differences(gait.robot, cycle, law, 1e-7)
    np.testing.assert_allclose(found, cycle.derivative, atol=1e-5 * max(1.0, np.max(np.abs(cycle.derivative))))
    clock = assess_planar(gait, by_clock).derivative
    assert np.max(np.abs(clock - cycle.derivative)) > 1e-2  # the phase variable is not the clock


def jump_law(gait, angle, jump):
    """Return a law whose hip torque jumps where the angle of the stance leg passes a value."""
    law = by_phase_variable(gait, planar_feedforward(gait))
    (part,) = law.parts
    finer = part.split([angle])
    row = 9 + 1 + gait.robot.actuators.index("hip")  # rows of the phase variable, start of the piece, torques
    table = finer.table.copy()
    table[row, finer.breakpoints >= angle] += jump
    return replace(law, parts=(replace(finer, table=table),))


@pytest.mark.slow
def test_a_torque_that_jumps_at_a_phase_has_an_exact_derivative(gaits):
    gait = gaits["walk"]
    law, robot = jump_law(gait, 0.0213, 0.5), gait.robot
    automaton = PlanarAutomaton(robot, gait.motion.parameters, law)
    first, n = gait.motion.segments[0], robot.n_q
    start = automaton.begin(first.q[:, 0], first.v[:, 0])
    rollout = follow(automaton, start, duration=5.0, until="foot B closes")
    exact = planar_derivative(automaton, rollout)
    for direction in (np.array([0, 0, 0, 0, 1, 0, 0, 0]), np.array([0, 0, 0, 0, 0, 0, 0, 1.0])):
        ends = []
        for sign in (1, -1):
            y = start.y + sign * 1e-6 * direction
            moved = automaton.phase(start).project(y, automaton.phase(start).anchors(start.y))
            ends.append(
                (
                    moved,
                    follow(
                        automaton, replace(start, q=moved[:n], v=moved[n:]), duration=5.0, until="foot B closes"
                    ).end.y,
                )
            )
        deviation, difference = (ends[0][0] - ends[1][0]) / 2e-6, (ends[0][1] - ends[1][1]) / 2e-6
        np.testing.assert_allclose(exact @ deviation, difference, rtol=1e-5, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["walk", "hop"])
def test_the_engines_agree(gaits, control, name):
    pytest.importorskip("heyoka")
    law, reference = control(name)
    fast = assess_planar(gaits[name], law, engine=planar_engine_named("heyoka"))
    assert fast.period == pytest.approx(reference.period, abs=1e-9)
    np.testing.assert_allclose(list(fast.state.values()), list(reference.state.values()), atol=1e-8)
    np.testing.assert_allclose(np.abs(fast.multipliers), np.abs(reference.multipliers), atol=1e-6)


@pytest.mark.slow
def test_a_perturbed_walk_returns_to_the_gait_over_exchanged_legs(gaits, control):
    gait, (law, cycle) = gaits["walk"], control("walk")
    automaton, start = PlanarAutomaton(gait.robot, gait.motion.parameters, law), cycle.start
    moved = replace(start, v=start.v + 1e-3 * (cycle.basis @ np.ones(cycle.basis.shape[1]))[gait.robot.n_q :])
    phase = automaton.phase(automaton.restart(moved))
    y = phase.project(moved.y, phase.anchors(moved.y))
    moved = automaton.restart(replace(moved, v=y[gait.robot.n_q :]))
    rollout = follow(automaton, moved, duration=60.0, until="foot B closes", steps=16)
    times = [event.time for event in rollout.motion.events if event.is_impact]
    assert len(times) == 16
    assert abs(times[0] - cycle.period) > 1e-4
    assert times[-1] - times[-2] == pytest.approx(cycle.period, abs=1e-6)


@pytest.mark.slow
def test_noise_and_delay_act_on_a_law_by_the_stance_angle(gaits, control, rng):
    gait, (law, cycle) = gaits["walk"], control("walk")
    disturbed = PlanarDisturbedGait(gait.robot, law, cycle)
    start, period = disturbed.start, disturbed.cycle.period
    ends = [
        walker.walk_step(start)
        for walker in (
            disturbed.walker({}),
            disturbed.noisy_walker(1e-9, rng),
            disturbed.noisy_walker(0.1, rng),
            disturbed.delayed_walker(0.01),
            disturbed.delayed_walker(0.04),
        )
    ]
    exact, quiet, noisy, prompt, late = (np.max(np.abs((each.following.y - start.y)[1:])) for each in ends)
    assert max(exact, quiet) < 1e-6
    assert 1e-4 < prompt < late
    assert noisy > 1e-4
    assert ends[0].rollout.motion.period == pytest.approx(period, abs=1e-7)


def test_a_coordinate_or_its_negative_is_the_same_phase_variable(gaits):
    gait = gaits["walk"]
    q = ca.SX.sym("q", gait.robot.n_q)
    other = ca.Function("negative_leg_angle", [q], [-q[2]])
    laws = [by_phase_variable(gait, planar_feedforward(gait), variable=each) for each in ("a", other)]
    assert [law.name for law in laws] == ["feedforward by a", "feedforward by negative_leg_angle"]
    segment = gait.motion.segments[0]
    for k in range(0, segment.time.size, 4):
        state = segment.q[:, k] + 1e-3, segment.v[:, k]
        np.testing.assert_allclose(*(torque_of(gait, law, 0, 0.0, *state) for law in laws), rtol=1e-7, atol=1e-7)


def test_a_phase_variable_that_turns_names_the_phase_and_the_time(gaits):
    gait = gaits["walk"]
    segment, place = gait.motion.segments[0], gait.robot.coordinates.index("a")
    k = segment.time.size // 2
    q = ca.SX.sym("q", gait.robot.n_q)
    parabola = ca.Function("parabola", [q], [(q[place] - segment.q[place, k]) ** 2])
    with pytest.raises(InputError) as info:
        by_phase_variable(gait, planar_feedforward(gait), variable=parabola)
    stated = "The phase variable 'parabola' is not strictly monotone in phase 1 (foot A stick): its rate is zero at "
    assert stated in str(info.value)
    assert float(str(info.value).partition("zero at ")[2].split()[0]) == pytest.approx(segment.time[k], abs=1e-3)


@pytest.mark.slow
def test_a_dragged_foot_moves_the_leg_backwards_in_double_support():
    gait = solve_planar(drag())
    with pytest.raises(InputError, match=r"from foot B' is not strictly monotone in phase \d \(.*foot B stick\): its"):
        by_phase_variable(gait, planar_feedforward(gait))


def test_wrong_phase_variables_are_rejected(gaits):
    gait = gaits["walk"]
    law = planar_feedforward(gait)
    with pytest.raises(InputError, match=r"has no coordinate 'aa'\. Did you mean"):
        by_phase_variable(gait, law, variable="aa")
    q = ca.SX.sym("q", 3)
    with pytest.raises(InputError, match="variable must be a Function q -> number of the 4 coordinates"):
        by_phase_variable(gait, law, variable=ca.Function("short", [q], [q[0]]))
    q = ca.SX.sym("q", 4)
    for place in ("x", ca.Function("hip", [q], [q[0] + ca.sin(q[2])])):
        with pytest.raises(InputError, match="must not depend on 'x', the position along the ground"):
            by_phase_variable(gait, law, variable=place)
    with pytest.raises(InputError, match=r"'b' is not strictly monotone in phase 1 \(foot A stick\)"):
        by_phase_variable(gait, law, variable="b")
    by_angle = by_phase_variable(gait, law)
    with pytest.raises(InputError, match="'feedforward by stance angle' has a phase variable already"):
        by_phase_variable(gait, by_angle)
    with pytest.raises(InputError, match="has the section 'foot B closes', but the gait has 'foot closes'"):
        by_phase_variable(gaits["hop"], law)
    with pytest.raises(InputError, match="has 1 part, but the gait has 2"):
        by_phase_variable(gaits["knee strike"], law)
    with pytest.raises(InputError, match="apply by_phase_variable to the result"):
        planar_step_to_step(
            gait.robot, by_angle, np.zeros(8), np.zeros((2, 8)), actuators=["hip"], windows=2, duration=1.0
        )
    with pytest.raises(InputError, match="has 1 part, but 2 endings"):
        PlanarLaw("law", "foot B closes", law.parts, endings=(None, None))


def test_a_robot_without_a_hip_needs_a_stated_variable(gaits):
    gait = gaits["hop"]
    nameless = replace(gait.robot, points=("knob", *gait.robot.points[1:]))
    with pytest.raises(InputError, match="has no point 'hip' or 'body' or 'trunk' or 'torso' in its drawing"):
        by_phase_variable(replace(gait, robot=nameless), planar_feedforward(gait))


def test_limits_and_gains_are_kept(gaits):
    gait = gaits["walk"]
    law = by_phase_variable(gait, planar_joint_pd(gait, stiffness=20, damping=2, torque_limit=3.0))
    assert law.gain_values["hip_stiffness"] == 20
    assert all(part.limited for part in law.parts)
    segment = gait.motion.segments[0]
    state = segment.q[:, 0] + np.array([0, 0, 0, 2.0]), segment.v[:, 0]
    assert np.max(np.abs(torque_of(gait, law.with_gains({"hip_stiffness": 50.0}), 0, 0.0, *state))) == 3.0


def test_the_slope_of_the_ground_turns_gravity():
    robot = monopod()
    values = robot.resolve({"slope": math.radians(10)})
    q, v, p = ca.SX.sym("q", 5), ca.SX.sym("v", 5), robot.vector(values)
    momentum = ca.Function("momentum", [q, v], [robot.momentum(q, v, p)[0][1] / robot.mass(p)])
    flight = simulate_planar(robot, [0, 2, 0, 0, 0.6], [1, 0, 0, 0, 0], {"slope": math.radians(10)}, duration=0.2)
    (segment,) = flight.motion.segments
    ends = [float(momentum(segment.q[:, k], segment.v[:, k])) for k in (0, -1)]
    assert (ends[0] - ends[1]) / 0.2 == pytest.approx(9.81 * math.cos(math.radians(10)), rel=1e-9)
