"""A law with discrete states: events, multipliers against finite differences, engines, gains."""

import numpy as np
import pytest

from gaitopt import (
    InputError,
    Law,
    ScipyEngine,
    by_stance_angle,
    compass_biped,
    computed_torque,
    find_cycles,
    gain_sensitivity,
    joint_pd,
    push_off,
    simulate,
)
from gaitopt.control import control_function, law_inputs, make_memory
from gaitopt.control.torque_noise import add_torque_noise
from gaitopt.model.contacts.event import EventKind, law_event
from gaitopt.simulation import default_engine
from gaitopt.simulation.delay import DelayedWalker
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.simulation.simulator import record_walk
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section

ROBOT, LEVEL = compass_biped(), {"slope": 0.0, "friction": 0.5}
START = np.array([0, 0, -0.15, -0.15, 0, 0, 0.75, -0.5])
ENGINES = [default_engine(), ScipyEngine()]

ACCURATE = ScipyEngine(relative=3e-14, absolute=1e-16) if default_engine().name == "scipy" else default_engine()
"""Engine of small differences: the error of scipy, 2e-10 in a walk that is 77 times more sensitive than its start, is
3e-6 of the derivative in differences over 1e-6, although its derivative is exact to 3e-11."""

every_engine = pytest.mark.parametrize("engine", ENGINES, ids=lambda engine: engine.name)


def differences(returning, z, step=1e-5):
    columns = []
    for unit in np.eye(z.size):
        one, two = (returning(z + k * step * unit).end - returning(z - k * step * unit).end for k in (1, 2))
        columns.append((8 * one - two) / (12 * step))
    return np.array(columns).T


@every_engine
def test_the_torque_lasts_from_the_retraction_for_the_duration(engine):
    law = push_off(ROBOT, torque=2.0, duration=0.1, actuator="hip")
    walk = simulate(ROBOT, START[:4], START[4:], {"slope": 0.017}, law=law, engine=engine, steps=2)
    for step in range(2):
        forward, begins, ends, landing = (event for event in walk.events if event.step == step)
        assert [forward.name, begins.name, ends.name] == ["swing leg goes forward", "push-off begins", "push-off ends"]
        assert landing.name == "touchdown"
        assert ends.time - begins.time == pytest.approx(0.1, abs=1e-12)
        (segment,) = (segment for segment in walk.motion.segments if segment.step == step)
        k = np.argmin(np.abs(segment.time - begins.time))
        assert segment.time[k] == begins.time
        assert segment.v[3, k] == pytest.approx(0, abs=1e-12)
        within = (segment.time > begins.time) & (segment.time <= ends.time)
        assert set(segment.torque[1, within]) == {2.0}
        assert not np.any(segment.torque[1, ~within & (segment.time != begins.time)])
    assert str(walk.motion.sequence()) == "stick | stick"


def test_a_swing_leg_that_goes_forward_already_is_ready_from_the_start():
    walker = make_walker(ROBOT, push_off(ROBOT, torque=2.0, duration=0.1), ROBOT.resolve({}))
    assert walker.begin(START)[8:].tolist() == [1, 0, 0, 0, 0]
    assert walker.begin(np.abs(START))[8:].tolist() == [0, 1, 0, 0, 0]
    pushing = make_walker(ROBOT, push_off(ROBOT, torque=2.0, duration=0.1, trigger="touchdown"), ROBOT.resolve({}))
    assert pushing.begin(START)[8:].tolist() == [0, 0, 1, 0, 0]


@every_engine
@pytest.mark.parametrize(("trigger", "radius"), [("retraction", 0.83706763), ("touchdown", 0.80727990)])
def test_a_gait_on_level_ground_has_the_multipliers_of_finite_differences(engine, trigger, radius):
    """Hip push-offs of 4 N m for 0.1 s replace the slope: stable walks on level ground."""
    law = push_off(ROBOT, torque=4.0, duration=0.1, actuator="hip", trigger=trigger)
    gait = find_cycles(ROBOT, LEVEL, law=law, starts=4, engine=engine)[0]
    assert (gait.sequence, gait.stable) == ("stick | stick", True)
    assert gait.radius == pytest.approx(radius, abs=1e-5)
    assert gait.energy.actuator == pytest.approx(gait.energy.impact_loss, rel=1e-8)
    returning = ReturnMap(make_walker(ROBOT, law, gait.parameters, engine=engine), gait.section)
    assert differences(returning, gait.z) == pytest.approx(gait.derivative, abs=1e-6)


@pytest.mark.parametrize("case", ["slip", "feedback", "limits", "angle", "model"])
def test_the_derivative_of_a_step_with_events_is_exact(slip_gait, case):
    """Slip caused by the push-off itself, events of a law with pieces, limits met, and events during a slide.

    The pieces of a plan have kinks, so finite differences are of first order in the step at best.
    """
    motion, parameters = slip_gait.motion, slip_gait.motion.parameters
    feedback = joint_pd(ROBOT, motion, stiffness=20, damping=5)
    law = {
        "slip": lambda: push_off(ROBOT, torque=25.0, duration=0.03, actuator="hip"),
        "feedback": lambda: push_off(ROBOT, feedback, torque=1.0, duration=0.1, actuator="hip"),
        "limits": lambda: push_off(ROBOT, feedback, torque=5.0, duration=0.1, actuator="hip", torque_limit=4),
        "angle": lambda: push_off(ROBOT, by_stance_angle(ROBOT, motion, feedback), torque=1.0, duration=0.1),
        "model": lambda: push_off(
            ROBOT, computed_torque(ROBOT, motion, damping=5), torque=3.0, duration=0.03, trigger="touchdown"
        ),
    }[case]()
    if case == "slip":
        parameters = ROBOT.resolve({"slope": 0.0175, "friction": 0.15})
        z = np.array([-0.147836890, 0.732796791, -0.500667882, 0.0])
    else:
        first = motion.segments[0]
        z = np.concatenate([first.q[2:3, 0], first.v[2:, 0] + [0.02, -0.03], first.v[:1, 0]])
    maps = []
    for engine in ENGINES:
        walker = make_walker(ROBOT, law, parameters, engine=engine)
        maps.append(ReturnMap(walker, Section(ROBOT, walker.p, sliding=True)))
    returning, reference = maps
    passage = returning(z)
    exact = returning.derivative(z, passage)
    scale = np.max(np.abs(exact))
    assert reference.derivative(z, reference(z)) == pytest.approx(exact, abs=1e-8 * scale)
    own = [arc.event for _, arc in passage.walk_steps[0].arcs if arc.event.kind is EventKind.LAW_EVENT]
    assert len(own) == {"model": 1, "feedback": 2}.get(case, 3)
    if case == "slip":
        modes = [mode for (mode, arc) in passage.walk_steps[0].arcs]
        pushed = next(k for k, (_, arc) in enumerate(passage.walk_steps[0].arcs) if arc.event == law_event(1))
        assert not modes[pushed].slips
        assert modes[pushed + 1].slips  # the torque jumps out of the friction cone
        exact = exact[:, :3]
    accurate = ReturnMap(make_walker(ROBOT, law, parameters, engine=ACCURATE), returning.section)
    assert differences(accurate, z, 1e-6)[:, : exact.shape[1]] == pytest.approx(exact, abs=1e-6 * scale)


@pytest.mark.slow
def test_engines_agree_on_late_readings_and_noise(slip_gait):
    law = push_off(ROBOT, joint_pd(ROBOT, slip_gait.motion, damping=2, torque_limit=8), torque=1.0, duration=0.1)
    first = slip_gait.motion.segments[0]
    start = np.concatenate([first.q[:, 0], first.v[:, 0]])
    p, noise = ROBOT.vector(slip_gait.motion.parameters), np.tile(np.linspace(-0.1, 0.1, 10), (2, 1))
    for make in (
        lambda engine: DelayedWalker(ROBOT, law, p, engine, delay=0.02),
        lambda engine: make_walker(
            ROBOT, add_torque_noise(law, noise, 0.6), slip_gait.motion.parameters, engine=engine
        ),
    ):
        walks = [record_walk(make(engine), start, 2) for engine in ENGINES]
        assert [event.name for event in walks[0].events] == [event.name for event in walks[1].events]
        assert "push-off begins" in [event.name for event in walks[0].events]
        ends = [walk.motion.jumps[-1].v_next for walk in walks]
        assert ends[0] == pytest.approx(ends[1], abs=1e-8)


def test_its_gains_move_the_gait_as_finite_differences_do():
    law = push_off(ROBOT, torque=4.0, duration=0.1, actuator="hip")
    gait = find_cycles(ROBOT, LEVEL, law=law, starts=4)[0]
    sensitivity = gain_sensitivity(gait, law)
    assert sensitivity.gains == ("push_off_torque", "push_off_duration")
    for k, (name, step) in enumerate((("push_off_torque", 1e-3), ("push_off_duration", 1e-5))):
        ends = []
        for sign in (1, -1):
            varied = law.with_gains({name: law.gain_values[name] + sign * step})
            ends.append(ReturnMap(make_walker(ROBOT, varied, gait.parameters), gait.section)(gait.z).end)
        assert sensitivity.return_map[:, k] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-6)


def test_events_without_end_are_refused():
    inputs = law_inputs(ROBOT, latched=1)
    flips = make_memory(inputs, inputs.v[2] * 0, values=["state"], events=["flip"], reset=1 - inputs.latched)
    control = control_function(inputs, inputs.q[2:] * 0, guards=-1 - inputs.latched)
    law = Law("flipping", control, np.zeros(1), np.zeros((0, 1)), memory=flips)
    with pytest.raises(
        InputError,
        match="more than 20 events at one instant, 0 s after the touchdown; its events trigger each other: flip",
    ):
        simulate(ROBOT, START[:4], START[4:], {}, law=law)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"actuator": "knee"}, "no actuator 'knee'"),
        ({"angle": "th3"}, "no angle 'th3'"),
        ({"trigger": "lift-off"}, "no trigger of a push-off 'lift-off'"),
        ({"duration": 0.0}, "push_off_duration must be"),
        ({"torque": np.inf}, "push_off_torque must be"),
        ({"law": push_off(ROBOT, torque=1.0, duration=0.1)}, "already has a push-off"),
    ],
)
def test_mistakes_are_explained(options, message):
    with pytest.raises(InputError, match=message):
        push_off(ROBOT, **{"torque": 1.0, "duration": 0.1, **options})


def test_a_law_of_another_form_is_refused():
    import casadi as ca

    clock, q, v, data = ca.SX.sym("t"), ca.SX.sym("q", 4), ca.SX.sym("v", 4), ca.SX.sym("d", 0)
    old = ca.Function("torque", [clock, q, v, data], [ca.vertcat(v[2], 0)])
    with pytest.raises(InputError, match="4 inputs and 1 outputs; build it with control_function"):
        Law("old", old, np.zeros(1), np.zeros((0, 1)))
    inputs = law_inputs(ROBOT, data=2)
    with pytest.raises(InputError, match="reads 2 rows of data, but its table has 1"):
        Law("short", control_function(inputs, inputs.data), np.zeros(1), np.zeros((1, 1)))
    inputs = law_inputs(ROBOT, latched=1)
    with pytest.raises(InputError, match="1 latched value and 0 guards, but its memory names 0 values and 0 events"):
        Law("forgetful", control_function(inputs, inputs.q[2:]), np.zeros(1), np.zeros((0, 1)))
