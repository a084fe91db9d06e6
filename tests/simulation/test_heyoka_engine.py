"""The fast engine against the reference engine: states, times, energies, sequences and stops, on guards and off."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import casadi as ca
import numpy as np
import pytest

from gaitopt import InputError, Law, Mode, compass_biped, feedforward, ledger, passive, replay, rimless_wheel, simulate
from gaitopt.control.signature import torque_function
from gaitopt.model.contacts.event import TOUCHDOWN
from gaitopt.simulation import StepLimits, engine_choice
from gaitopt.simulation.closed_loop import ClosedLoop
from gaitopt.simulation.engine_choice import default_engine, engine_named
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.scipy_engine import ScipyEngine
from gaitopt.simulation.taylor import expression_conversion
from gaitopt.simulation.taylor.compiled_programs import program_with_events
from gaitopt.simulation.taylor.expression_conversion import convert, heyoka_module
from gaitopt.simulation.taylor.heyoka_engine import HeyokaEngine
from tests.simulation.test_trigonometric_form import pulled

heyoka = pytest.importorskip("heyoka")

FAST, REFERENCE = HeyokaEngine(), ScipyEngine()
COMPASS, WHEEL = compass_biped(), rimless_wheel()
DOWNHILL, STEEP = {"slope": np.deg2rad(1)}, {"slope": np.deg2rad(13)}
GAIT_A = [0, 0, -0.147836890, -0.147836890, 0, 0, 0.732796791, -0.500667882]
GAIT_B = [0, 0, -0.140807105, -0.140807105, 0, 0, 0.710208797, -0.516847656]
GAIT_C = [0, 0, -0.079038, -0.079038, 0.634174, 0, 0.043777, -0.431761]
UNIT = np.sqrt((1 + 1 / 3) / 9.8)  # the wheel's natural time [s]


def wheel_state(rate, slide=0.0):
    """Return the start of a step from speeds in natural units."""
    return [0, 0, -np.pi / 10, slide / UNIT, 0, rate / UNIT]


def law_of(torque):
    """Return the law with a torque (clock, q, v) of the compass."""
    return Law("custom", torque_function(COMPASS, ca.SX.sym("data", 0), torque), np.zeros(1), np.zeros((0, 1)))


def vector(robot, parameters):
    return robot.vector(robot.resolve(parameters))


def assert_same_walk(robot, parameters, state, tolerance=1e-9, **options):
    """Simulate with both engines and compare everything that can be compared; return the walk."""
    q, v = np.split(np.array(state, dtype=float), 2)
    fast, reference = (simulate(robot, q, v, parameters, engine=engine, **options) for engine in (FAST, REFERENCE))
    assert fast.engine == "heyoka"
    assert fast.stop is reference.stop
    assert [(e.name, e.before, e.after, e.step) for e in fast.events] == [
        (e.name, e.before, e.after, e.step) for e in reference.events
    ]
    np.testing.assert_allclose([e.time for e in fast.events], [e.time for e in reference.events], atol=tolerance)
    for one, other in zip(fast.motion.segments, reference.motion.segments, strict=True):
        for name in ("q", "v", "work", "friction_work", "kinetic", "torque", "force"):
            ends = getattr(one, name)[..., -1], getattr(other, name)[..., -1]
            # Forces may be large: they grow without bound where a slide ceases to be well posed.
            near = 100 * tolerance if name == "force" else tolerance
            np.testing.assert_allclose(*ends, rtol=near, atol=near)
    for one, other in zip(fast.motion.jumps, reference.motion.jumps, strict=True):
        np.testing.assert_allclose(one.v_next, other.v_next, atol=tolerance)
    return fast


def both_arcs(robot, law, mode, state, parameters, *, clock=0.0, until=2.0):
    """Return the arcs of both engines from a state, after checking that recording does not change the fast one."""
    p, state = vector(robot, parameters), np.array(state, dtype=float)
    arcs = [engine.flow(ClosedLoop(robot, law, p), mode, clock, state, until=until) for engine in (FAST, REFERENCE)]
    recorded = FAST.flow(ClosedLoop(robot, law, p), mode, clock, state, until=until, record=True)
    assert recorded.event == arcs[0].event
    assert recorded.time[-1] == arcs[0].time[-1]
    np.testing.assert_array_equal(recorded.states[:, [0, -1]], arcs[0].states)
    return arcs


def assert_same_arc(*problem, **options):
    fast, reference = both_arcs(*problem, **options)
    assert fast.event == reference.event
    np.testing.assert_allclose(fast.time, reference.time, atol=1e-9)
    np.testing.assert_allclose(fast.states, reference.states, atol=1e-9)
    return fast


# Published gaits, and walks of every kind


@pytest.mark.parametrize(
    ("friction", "state", "sequence"),
    [
        (0.3, GAIT_A, "stick | stick"),
        (np.inf, GAIT_A, "stick | stick"),
        (0.14, GAIT_B, "slip+ stick slip- | stick"),
        (0.14, GAIT_C, "slip+ stick | slip+"),
    ],
)
def test_passive_compass_gaits(friction, state, sequence):
    walk = assert_same_walk(COMPASS, DOWNHILL | {"friction": friction}, state, steps=3)
    assert {str(walk.motion.sequence(step)) for step in range(3)} == {sequence}


@pytest.mark.parametrize(
    ("friction", "rate", "slide", "sequences"),
    [
        (1.0, 0.876031, 0.0, {"stick | stick"}),
        (0.3, 0.88075, 0.0, {"stick slip+ | stick"}),
        (0.24, 0.88, 0.1, {"slip+ | slip+", "slip+ stick slip+ | slip+"}),
        (0.3, 1.12, 0.7, {"slip+ | slip+", "slip+ | stick", "stick slip+ | stick"}),
        (0.1, 1.07, 1.5, {"slip+ | slip+"}),
        (np.inf, 0.876031, 0.0, {"stick | stick"}),
    ],
    ids=["A", "B", "C", "cascade D to B", "complete slip", "unlimited"],
)
def test_wheel_gaits(friction, rate, slide, sequences):
    walk = assert_same_walk(WHEEL, STEEP | {"friction": friction}, wheel_state(rate, slide), steps=20)
    assert {str(walk.motion.sequence(step)) for step in range(20)} == sequences


def test_slip_reversal():
    parameters = {"slope": 0.2, "friction": 0.05}
    walk = assert_same_walk(WHEEL, parameters, [0, 0, -0.3, -0.3, 0, 1.5], steps=1)
    assert [segment.mode.value for segment in walk.motion.segments][:2] == ["slip-", "slip+"]


def test_optimised_gait_replayed_open_loop(slip_gait):
    first = slip_gait.motion.segments[0]
    state, law = np.concatenate([first.q[:, 0], first.v[:, 0]]), feedforward(COMPASS, slip_gait.motion)
    walk = assert_same_walk(COMPASS, slip_gait.motion.parameters, state, law=law, steps=2)
    assert str(walk.motion.sequence()) == str(slip_gait.sequence)


@pytest.mark.parametrize("seed", range(40))
def test_random_walks(seed):
    rng = np.random.default_rng(seed)
    friction = rng.choice([0.05, 0.1, 0.14, 0.2, 0.3, 0.5, 0.8, 1.5, np.inf])
    slide = rng.normal() / 2 if np.isfinite(friction) and rng.random() < 0.5 else 0.0
    if seed % 2:
        th = rng.uniform(-0.3, 0.3, 2) if rng.random() < 0.3 else np.full(2, -rng.uniform(0.02, 0.35))
        parameters = {"slope": rng.uniform(-0.02, 0.1), "friction": friction}
        state = [*rng.normal(size=2), *th, slide, 0, rng.uniform(0, 2), rng.uniform(-2, 1)]
        assert_same_walk(COMPASS, parameters, state, steps=2, step_limits=StepLimits(duration=3.0))
    else:
        parameters = {
            "slope": rng.uniform(0, 0.4),
            "friction": friction,
            "inertia_ratio": rng.uniform(0, 0.6),
        }
        state = [0, rng.normal(), -np.pi / 10, slide, 0, rng.uniform(-0.5, 4)]
        assert_same_walk(WHEEL, parameters, state, steps=3, step_limits=StepLimits(duration=3.0))


# Every reason to stop


@pytest.mark.parametrize(
    ("key", "robot", "parameters", "state", "options"),
    [
        ("fell", COMPASS, DOWNHILL | {"friction": 0.3}, [0, 0, -0.2, -0.2, 0, 0, 1.5, 0.8], {}),
        ("fell", WHEEL, {"slope": 0.0}, [0, 0, -np.pi / 10, 0, 0, 0.1], {}),
        ("lift_off", WHEEL, STEEP | {"friction": 0.5}, wheel_state(1.4), {"steps": 9}),
        ("lift_off", WHEEL, STEEP, wheel_state(1.4), {"steps": 9}),
        ("double_support", COMPASS, DOWNHILL | {"friction": 0.3}, [0, 0, -0.2, -0.2, 0, 0, 0.9, 1.5], {}),
        ("painleve", WHEEL, {"slope": 0.2, "friction": 9.0, "inertia_ratio": 0.02}, [0, 0, 0.7, 2, 0, 2], {}),
        ("no_touchdown", WHEEL, STEEP, wheel_state(0.876031), {"step_limits": StepLimits(duration=0.1)}),
        (
            "too_many_events",
            COMPASS,
            DOWNHILL | {"friction": 0.14},
            GAIT_B,
            {"step_limits": StepLimits(duration=3.0, events=2)},
        ),
        ("steps_done", COMPASS, DOWNHILL, GAIT_A, {}),
    ],
)
def test_every_stop(key, robot, parameters, state, options):
    walk = assert_same_walk(robot, parameters, state, **{"step_limits": StepLimits(duration=3.0), **options})
    assert walk.stop.key == key


def test_time_limit_is_met_exactly():
    for mode in (Mode.STICK, Mode.SLIP_FORWARD):
        state = np.array(GAIT_A) + np.eye(8)[4] * 2 * mode.sign
        friction = {"friction": 0.3 if mode is Mode.STICK else 0.05}
        arc = assert_same_arc(COMPASS, passive(COMPASS), mode, state, DOWNHILL | friction, clock=0.1, until=0.4)
        assert arc.event is None
        assert arc.time.tolist() == [0.1, 0.4]
    arc = assert_same_arc(COMPASS, passive(COMPASS), Mode.STICK, GAIT_A, DOWNHILL, clock=0.4, until=0.4)
    assert (arc.event, arc.time.tolist()) == (None, [0.4, 0.4])


@pytest.mark.parametrize(
    "torque",
    [lambda clock: 0.01 / (clock - 0.3), lambda clock: ca.sqrt(0.3 - clock), lambda clock: ca.sqrt(clock - 9)],
    ids=["pole", "root", "never finite"],
)
def test_motion_that_cannot_go_on(torque):
    law = law_of(lambda clock, q, v: ca.vertcat(0, torque(clock)))
    # The reference engine needs minutes to creep up to the pole at small tolerances.
    rough = ScipyEngine(relative=1e-6, absolute=1e-8)
    loop = ClosedLoop(COMPASS, law, vector(COMPASS, DOWNHILL))
    arcs = [e.flow(loop, Mode.STICK, 0.0, np.array(GAIT_A), until=2.0, record=True) for e in (FAST, rough)]
    assert [arc.event.label for arc in arcs] == ["singular", "singular"]
    assert arcs[0].time[-1] == pytest.approx(arcs[1].time[-1], abs=1e-3)
    assert np.all(np.isfinite(arcs[0].states))


# Starts on a guard


def edge_friction(state):
    """Return the friction for which the force that keeps a foot at rest lies on the edge of its cone."""
    tangential, normal = np.asarray(
        COMPASS.acceleration[Mode.STICK](state[:4], state[4:], [0, 0], vector(COMPASS, DOWNHILL))[1]
    ).ravel()
    return abs(tangential) / normal


def test_force_on_the_edge_of_the_cone_that_moves_inside_is_no_event():
    # Gait A: the force ratio is largest just after the impact.
    for factor in (1.0, 1 + 1e-15, 1 - 1e-15):
        parameters = DOWNHILL | {"friction": factor * edge_friction(GAIT_A)}
        assert assert_same_arc(COMPASS, passive(COMPASS), Mode.STICK, GAIT_A, parameters).event == TOUCHDOWN


def test_force_on_the_edge_of_the_cone_that_moves_outside_is_an_event_at_once():
    state = np.array(GAIT_A)
    state[4:] *= -1  # the same orbit backwards
    for factor in (1.0, 1 + 1e-15, 1 - 1e-15):
        parameters = DOWNHILL | {"friction": factor * edge_friction(state)}
        arc = assert_same_arc(COMPASS, passive(COMPASS), Mode.STICK, state, parameters)
        assert arc.event.label in ("slip+", "slip-")
        assert arc.time[-1] == pytest.approx(0, abs=1e-12)


def test_slide_from_rest_is_no_event_unless_the_force_stops_it():
    parameters = DOWNHILL | {"friction": 0.14}
    forward = assert_same_arc(COMPASS, passive(COMPASS), Mode.SLIP_FORWARD, GAIT_B, parameters)
    assert forward.event.label == "at rest"
    assert forward.time[-1] > 0.01
    backward = assert_same_arc(COMPASS, passive(COMPASS), Mode.SLIP_BACKWARD, GAIT_B, parameters)
    assert backward.event.label == "at rest"
    assert backward.time[-1] == pytest.approx(0, abs=1e-12)


def test_onset_of_slip_where_the_slide_starts_without_acceleration():
    # At the edge of the cone sticking and sliding force agree, so the sliding acceleration is zero to rounding.
    parameters, law = DOWNHILL | {"friction": 0.14}, passive(COMPASS)
    arc = FAST.flow(
        ClosedLoop(COMPASS, law, vector(COMPASS, parameters)), Mode.SLIP_FORWARD, 0.0, np.array(GAIT_B), until=2.0
    )
    rested = arc.states[:, -1] * (np.arange(8) != 4)
    stick = assert_same_arc(COMPASS, law, Mode.STICK, rested, parameters, clock=float(arc.time[-1]))
    assert stick.event.label == "slip-"
    clock, onset = float(stick.time[-1]), stick.states[:, -1]
    acceleration, _ = COMPASS.acceleration[Mode.SLIP_BACKWARD](
        onset[:4], onset[4:], [0, 0], vector(COMPASS, parameters)
    )
    assert abs(float(acceleration[0])) < 1e-12
    slide = assert_same_arc(COMPASS, law, Mode.SLIP_BACKWARD, onset, parameters, clock=clock)
    assert slide.time[-1] - clock > 1e-3


def test_force_that_pulls_at_the_start_is_lift_off():
    parameters = STEEP | {"friction": 0.5}
    arc = assert_same_arc(WHEEL, passive(WHEEL), Mode.STICK, wheel_state(2.0), parameters)
    assert (arc.event.label, arc.time[-1]) == ("lift-off", 0.0)


@pytest.mark.parametrize("gap", [0.0, 1e-16, -1e-16, 1e-12, -1e-12, 1e-9, -1e-9, 1e-6])
def test_both_feet_on_the_ground_is_no_touchdown(gap):
    state = np.array(GAIT_A)
    state[3] += gap
    assert assert_same_arc(COMPASS, passive(COMPASS), Mode.STICK, state, DOWNHILL).time[-1] > 0.7


def test_armed_touchdown_guard_counts_only_from_above():
    # Both legs in front of the hip, the swing foot coming down through the stance foot's line.
    for gap, event in ((0.0, "lift-off"), (1e-15, "touchdown"), (1e-3, "touchdown")):
        arc = assert_same_arc(COMPASS, passive(COMPASS), Mode.STICK, [0, 0, 0.2, 0.2 + gap, 0, 0, 1.0, -1.0], DOWNHILL)
        assert arc.event.label == event


def test_touchdown_at_the_end_of_a_piece_of_the_law():
    # Torques of a simulated step end exactly at its touchdown.
    walk = simulate(COMPASS, GAIT_A[:4], GAIT_A[4:], DOWNHILL, engine=FAST)
    law = feedforward(COMPASS, walk.motion)
    assert law.breakpoints[-1] == walk.motion.jumps[0].time
    for shift in (0.0, 1e-16, -1e-16, 2e-16, -2e-16):
        moved = Law("moved", law.torque, law.breakpoints + shift, law.table)
        arc = FAST.flow(
            ClosedLoop(COMPASS, moved, vector(COMPASS, DOWNHILL)), Mode.STICK, 0.0, np.array(GAIT_A), until=3.0
        )
        assert arc.event.label == "touchdown"
        assert arc.time[-1] == pytest.approx(law.breakpoints[-1], abs=1e-12)


def test_law_that_jumps_out_of_the_cone():
    data = ca.SX.sym("data", 2)
    torque = torque_function(COMPASS, data, lambda clock, q, v: data)
    law = Law("switched", torque, np.array([0.0, 0.2]), np.array([[0.0, 60.0], [0.0, 0.0]]))
    arc = assert_same_arc(COMPASS, law, Mode.STICK, GAIT_A, DOWNHILL | {"friction": 0.3})
    assert (arc.event.label, arc.time[-1]) == ("slip-", 0.2)


def test_paradox_within_a_slide():
    parameters = {"slope": 0.2058, "friction": 2.8844, "inertia_ratio": 0.024397}
    state = [0, 0, 0.6003652, 2.8251185, 0, -1.4288159]
    arc = assert_same_arc(WHEEL, passive(WHEEL), Mode.SLIP_FORWARD, state, parameters)
    assert arc.event.label == "painleve"
    assert arc.time[-1] > 0.1


# What is recorded, and sensitivities


def test_recorded_arc(slip_gait):
    first, law = slip_gait.motion.segments[0], feedforward(COMPASS, slip_gait.motion)
    state, p = np.concatenate([first.q[:, 0], first.v[:, 0]]), vector(COMPASS, slip_gait.motion.parameters)
    fast, reference = (
        engine.flow(ClosedLoop(COMPASS, law, p), Mode.SLIP_FORWARD, 0.0, state, until=2.0, record=True)
        for engine in (FAST, REFERENCE)
    )
    assert fast.energy.shape == (3, fast.time.size)
    assert np.all(np.diff(fast.time) > 0)
    assert set(law.breakpoints[law.breakpoints < fast.time[-1]]) <= set(fast.time)
    np.testing.assert_allclose(fast.energy[:, -1], reference.energy[:, -1], atol=1e-10)
    # Between its ends: the reference arc, stopped at a recorded time.
    k = fast.time.size // 2
    until = float(fast.time[k])
    middle = REFERENCE.flow(ClosedLoop(COMPASS, law, p), Mode.SLIP_FORWARD, 0.0, state, until=until, record=True)
    np.testing.assert_allclose(fast.states[:, k], middle.states[:, -1], atol=1e-9)
    np.testing.assert_allclose(fast.energy[:, k], middle.energy[:, -1], atol=1e-9)


@pytest.mark.parametrize("gap", [8e-10, 1e-12])
def test_work_of_a_stretch_however_short_is_counted(slip_gait, gap):
    """A breakpoint of the law immediately before the touchdown: the joints work there too, and the ledger closes."""
    first, law = slip_gait.motion.segments[0], feedforward(COMPASS, slip_gait.motion)
    walk = simulate(COMPASS, first.q[:, 0], first.v[:, 0], slip_gait.motion.parameters, law=law, engine=FAST)
    early = walk.motion.jumps[0].time - gap - law.breakpoints[-1]
    moved = Law("moved", law.torque, np.append(law.breakpoints[:-1], law.breakpoints[-1] + early), law.table)
    walk = assert_same_walk(COMPASS, walk.motion.parameters, [*first.q[:, 0], *first.v[:, 0]], 1e-12, law=moved)
    assert abs(ledger(walk.motion).residual) < 1e-13


@pytest.mark.parametrize("mode", [Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD])
@pytest.mark.parametrize("case", ["compass", "wheel", "feedforward", "feedback"])
def test_sensitivity(mode, case, slip_gait, rng):
    robot = WHEEL if case == "wheel" else COMPASS
    law = {
        "feedforward": lambda: feedforward(COMPASS, slip_gait.motion),
        # A law that feels entries of the state that rest.
        "feedback": lambda: law_of(lambda t, q, v: ca.vertcat(q[0] * v[2] - v[0] * (1 + v[1]), ca.sin(q[1] + 3 * t))),
    }.get(case, lambda: passive(robot))()
    angles = robot.n_q - 2
    state = np.concatenate([[0.3, 0.2], rng.uniform(-0.2, 0.2, angles), [mode.sign * 0.5, 0], rng.normal(size=angles)])
    p = vector(robot, {"friction": 0.2, "slope": 0.05})
    one, other = (e.sensitivity(ClosedLoop(robot, law, p), mode, 0.05, state, until=0.4) for e in (FAST, REFERENCE))
    np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(
        FAST.sensitivity(ClosedLoop(robot, law, p), mode, 0.4, state, until=0.4), np.eye(2 * robot.n_q)
    )


def test_a_robot_whose_accelerations_are_no_sums_of_waves():
    robot = pulled()
    for mode in (Mode.STICK, Mode.SLIP_FORWARD):
        state = [0, 0, -0.2, 0.1 * mode.sign, 0, 0.9]
        arc = assert_same_arc(robot, passive(robot), mode, state, {"friction": 0.8, "slope": 0.1}, until=0.1)
        assert arc.time[-1] > 0.01


# Compilation


def test_law_made_anew_is_not_compiled_anew(slip_gait):
    one, two = feedforward(COMPASS, slip_gait.motion), feedforward(COMPASS, slip_gait.motion)
    p = vector(COMPASS, DOWNHILL)
    FAST.flow(ClosedLoop(COMPASS, one, p), Mode.STICK, 0.0, np.array(GAIT_A), until=0.1)
    before = program_with_events.cache_info().misses
    FAST.flow(ClosedLoop(COMPASS, two, p * 1.01), Mode.STICK, 0.0, np.array(GAIT_A), until=0.1)
    assert program_with_events.cache_info().misses == before


def test_threads_do_not_disturb_each_other():
    def walk(friction):
        """Return where ten steps, slips and stops among them, end, and how the last depends on its start."""
        walker = Walker(WHEEL, passive(WHEEL), vector(WHEEL, STEEP | {"friction": friction}), FAST)
        y = np.array(wheel_state(0.88, 0.1))
        for _ in range(10):
            y = walker.walk_step(y).following
        y[WHEEL.n_q] = 0.3
        sensitivity = FAST.sensitivity(ClosedLoop(WHEEL, walker.law, walker.p), Mode.SLIP_FORWARD, 0.0, y, until=0.2)
        return np.concatenate([y, sensitivity.ravel()])

    frictions, interval = np.linspace(0.25, 0.3, 12), sys.getswitchinterval()
    expected = [walk(friction) for friction in frictions]
    sys.setswitchinterval(1e-5)
    try:
        with ThreadPoolExecutor(3) as pool:
            np.testing.assert_array_equal(list(pool.map(walk, frictions)), expected)
    finally:
        sys.setswitchinterval(interval)


def test_full_mode_and_looser_tolerance_agree():
    p, state = vector(WHEEL, STEEP | {"friction": 0.3}), np.array(wheel_state(1.12, 0.7))
    arcs = [
        engine.flow(ClosedLoop(WHEEL, passive(WHEEL), p), Mode.SLIP_FORWARD, 0.0, state, until=2.0)
        for engine in (FAST, HeyokaEngine(compact_mode=False), HeyokaEngine(tolerance=1e-10))
    ]
    for arc in arcs[1:]:
        assert arc.event == arcs[0].event
        np.testing.assert_allclose(arc.states, arcs[0].states, atol=1e-8)


def test_converted_operations_equal_those_of_casadi(rng):
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    unary = [ca.sin, ca.cos, ca.tan, ca.asin, ca.acos, ca.atan, ca.sinh, ca.cosh, ca.tanh, ca.asinh, ca.atanh, ca.exp]
    unary += [ca.log, ca.sqrt, ca.erf, ca.expm1, ca.log1p, lambda a: ca.acosh(1 + a), lambda a: -a, lambda a: 1 / a]
    unary += [lambda a: 2 * a, lambda a: a * a, lambda a: a**3, lambda a: a**-2.5]
    results = [f(x) for f in unary]
    results += [x + y, x - y, x * y, x / y, x**y, ca.atan2(x, y), ca.hypot(x, y), ca.SX(0.5), 3 * x - 1]
    function = ca.Function("all", [x, y], results)
    z, w = heyoka.make_vars("z", "w")
    compiled = heyoka.cfunc([e for output in convert(function, [[z], [w]]) for e in output], [z, w])
    for point in rng.uniform(0.1, 0.9, (20, 2)):
        np.testing.assert_allclose(compiled(point), [float(value) for value in function(*point)], rtol=1e-14)


@pytest.mark.parametrize(
    ("name", "torque"),
    [("fabs", lambda v: ca.fabs(v)), ("lt", lambda v: ca.if_else(v < 0, 1, v)), ("fmin", lambda v: ca.fmin(v, 1))],
)
def test_operations_a_taylor_integrator_cannot_follow_are_refused(name, torque):
    law = law_of(lambda clock, q, v: ca.vertcat(torque(v[2]), 0))
    with pytest.raises(InputError, match=rf"does not support the operation '{name}' in 'stick'\. Use the scipy engine"):
        FAST.flow(ClosedLoop(COMPASS, law, vector(COMPASS, DOWNHILL)), Mode.STICK, 0.0, np.array(GAIT_A), until=1.0)


# Which engine


def test_engines_by_name():
    assert default_engine().name == engine_named("heyoka").name == engine_named("auto").name == "heyoka"
    assert engine_named("scipy") == ScipyEngine()
    with pytest.raises(InputError, match="Did you mean 'heyoka'"):
        engine_named("heyoca")


def test_simulate_takes_the_fastest_engine_and_replay_the_reference(slip_gait):
    assert simulate(COMPASS, GAIT_A[:4], GAIT_A[4:], DOWNHILL).engine == "heyoka"
    assert replay(slip_gait).engine == "scipy"


def test_a_law_that_heyoka_cannot_follow_is_left_to_the_reference_engine():
    law = law_of(lambda clock, q, v: ca.vertcat(ca.fabs(v[2]), 0))
    assert (default_engine(law).name, engine_named("auto", law).name) == ("scipy", "scipy")
    assert simulate(COMPASS, GAIT_A[:4], GAIT_A[4:], DOWNHILL, law=law).engine == "scipy"


def test_a_heyoka_that_cannot_be_imported_is_reported_once_and_not_used(monkeypatch, caplog):
    def refuse():
        raise InputError("The package heyoka is installed but cannot be imported: libheyoka.so is missing.")

    monkeypatch.setattr(expression_conversion, "heyoka_module", refuse)
    engine_choice._imports_heyoka.cache_clear()
    try:
        assert (default_engine().name, engine_named("auto").name) == ("scipy", "scipy")
        messages = [record.getMessage() for record in caplog.records]
        assert len(messages) == 1
        assert "libheyoka.so is missing. The engine scipy is used" in messages[0]
    finally:
        engine_choice._imports_heyoka.cache_clear()


def test_a_broken_package_heyoka_is_named(tmp_path):
    (tmp_path / "heyoka.py").write_text("raise ImportError('libheyoka.so is missing')")
    code = "from gaitopt.simulation.engine_choice import engine_named as make; print(make().name); make('heyoka')"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])}
    run = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert run.stdout == "scipy\n"
    assert run.stderr.startswith("The package heyoka is installed but cannot be imported: libheyoka.so is missing. The")
    assert "InputError: The package heyoka is installed but cannot be imported: libheyoka" in run.stderr


def test_without_heyoka_the_reference_engine_runs(monkeypatch):
    monkeypatch.setattr(engine_choice, "find_spec", lambda name: None)
    monkeypatch.setitem(sys.modules, "heyoka", None)
    heyoka_module.cache_clear()
    try:
        assert engine_named().name == "scipy"
        assert simulate(COMPASS, GAIT_A[:4], GAIT_A[4:], DOWNHILL).engine == "scipy"
        with pytest.raises(InputError, match=r"pip install 'gaitopt\[fast\]'"):
            engine_named("heyoka")
        with pytest.raises(InputError, match=r"pip install 'gaitopt\[fast\]'"):
            HeyokaEngine(tolerance=1e-9).flow(
                ClosedLoop(COMPASS, passive(COMPASS), vector(COMPASS, DOWNHILL)),
                Mode.STICK,
                0.0,
                np.array(GAIT_A),
                until=1.0,
            )
    finally:
        heyoka_module.cache_clear()
