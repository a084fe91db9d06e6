"""define_law: custom laws of robots with one foot on the ground and with several contacts, from one function."""

import math

import casadi as ca
import numpy as np
import pytest

from gaitopt import InputError, compass_biped, feedforward, find_cycles, joint_pd, load
from gaitopt.control import define_law, planar_feedforward, planar_joint_pd
from gaitopt.stability import assess_planar, assess_stability
from gaitopt.tuning import ControllerFamily, tune_feedback
from tests.stability.difference_quotients import planar_differences

COMPASS = load("docs/examples/compass_slip.h5")
HEEL_TOE = load("docs/examples/heel_toe.h5")


@define_law
def foot_placement(state, plan, stiffness=100.0, damping=10.0, placement=0.3):
    """The faster the hip moves, the further ahead the swing leg is placed."""
    target = plan.q["b"] + placement * (state.v["x"] - plan.v["x"])
    error, rate_error = state.q["b"] - target, state.v["b"] - plan.v["b"]
    return {"motor": plan.torque["motor"] + stiffness * error + damping * rate_error}


@define_law
def hip_servo(state, plan, stiffness=20.0, damping=5.0):
    error = state.q["th1"] + state.q["th2"] - plan.q["th1"] - plan.q["th2"]
    rate_error = state.v["th1"] + state.v["th2"] - plan.v["th1"] - plan.v["th2"]
    return {"hip": plan.torque["hip"] - stiffness * error - damping * rate_error}


@define_law
def replay(state, plan):
    return {}


def random_states(robot, count=5):
    random = np.random.default_rng(0)
    return [(random.uniform(0, 0.6), *random.normal(size=(2, robot.n_q))) for _ in range(count)]


def test_foot_placement_stabilises_the_walker_with_heel_and_toe():
    law = foot_placement(HEEL_TOE.robot, HEEL_TOE)
    assert assess_planar(HEEL_TOE).radius > 3
    cycle = assess_planar(HEEL_TOE, law)
    assert cycle.radius < 0.75
    assert cycle.period == pytest.approx(HEEL_TOE.period, abs=1e-6)


def test_the_multipliers_agree_with_differences():
    law = foot_placement(HEEL_TOE.robot, HEEL_TOE, torque_limit=1e3)
    cycle = assess_planar(HEEL_TOE, law)
    differences = planar_differences(HEEL_TOE.robot, cycle, law, 1e-7)
    scale = max(1.0, np.max(np.abs(cycle.derivative)))
    np.testing.assert_allclose(differences, cycle.derivative, atol=1e-5 * scale)


@pytest.mark.parametrize(("law", "other"), [(replay, planar_feedforward), (None, planar_joint_pd)])
def test_a_custom_law_of_several_contacts_is_the_built_in_law_with_the_same_torque(law, other):
    @define_law
    def servo(state, plan, stiffness=8.0, damping=2.0):
        error, rate_error = (x["a"] - x["b"] - y["a"] + y["b"] for x, y in ((state.q, plan.q), (state.v, plan.v)))
        return [plan.torque["motor"] - stiffness * error - damping * rate_error]

    robot, options = HEEL_TOE.robot, {} if law else {"stiffness": 8.0, "damping": 2.0}
    made, expected = (law or servo)(robot, HEEL_TOE), other(HEEL_TOE, **options)
    assert (made.section, len(made.parts)) == (expected.section, 2)
    for part, known in zip(made.parts, expected.parts, strict=True):
        for state in random_states(robot):
            np.testing.assert_allclose(part.torque_at(*state), known.torque_at(*state), rtol=1e-12, atol=1e-12)


def test_a_custom_law_of_one_foot_is_joint_feedback_with_the_same_torque():
    robot = COMPASS.robot
    made = hip_servo(robot, COMPASS, torque_limit=6.0)
    expected = joint_pd(robot, COMPASS.motion, stiffness=20, damping=5, torque_limit=6.0)
    expected = expected.with_gains({"ankle_stiffness": 0.0, "ankle_damping": 0.0})
    for state in random_states(robot):
        np.testing.assert_allclose(made.torque_at(*state), expected.torque_at(*state), rtol=1e-12, atol=1e-12)
    assert made.gain_values == {"stiffness": 20.0, "damping": 5.0}
    open_loop, plan = feedforward(robot, COMPASS.motion), replay(robot, COMPASS.motion)
    assert plan.torque_at(0.2, [0] * 4, [0] * 4) == pytest.approx(open_loop.torque_at(0.2, [0] * 4, [0] * 4))
    assert assess_stability(COMPASS, plan).radius == pytest.approx(assess_stability(COMPASS).radius, rel=1e-6)


def test_a_law_without_a_plan():
    @define_law
    def spring(state, plan, stiffness=0.0):
        return {"hip": -stiffness * (state.q["th1"] + state.q["th2"])}

    robot, parameters = compass_biped(), {"slope": 0.02, "friction": 1.0}
    assert spring(robot).is_passive is False
    (passive,) = find_cycles(robot, parameters, starts=4)[:1]
    (gait,) = find_cycles(robot, parameters, law=spring(robot), starts=4)[:1]
    assert gait.multipliers == pytest.approx(passive.multipliers, abs=1e-6)
    with pytest.raises(InputError, match=r"There is no planned value 'hip'. The law has no planned motion; pass one"):
        define_law(lambda state, plan: [plan.torque["hip"], 0])(robot)


def test_gains_are_tuned_and_limits_apply():
    law = foot_placement(HEEL_TOE.robot, HEEL_TOE, stiffness=50.0)
    family = ControllerFamily.from_law(law)
    assert [(gain.name, gain.start, gain.upper) for gain in family.gains] == [
        ("stiffness", 50.0, 150.0),
        ("damping", 10.0, 30.0),
        ("placement", 0.3, pytest.approx(0.9)),
    ]
    limited = family.with_torque_limit(HEEL_TOE.robot, 5.0).law({"stiffness": 60.0})
    assert limited.gain_values == {"stiffness": 60.0, "damping": 10.0, "placement": 0.3}
    assert all(part.limited for part in limited.parts)
    assert abs(limited.parts[0].torque_at(0.1, [0, 1, 2.0, -2.0], [0] * 4)[0]) == 5.0


def test_the_function_is_presented_with_its_gains():
    import inspect

    assert str(inspect.signature(foot_placement)).endswith("*, stiffness=100.0, damping=10.0, placement=0.3)")
    assert list(inspect.signature(foot_placement).parameters)[:3] == ["robot", "motion", "torque_limit"]


def attempt(torque, gait=COMPASS):
    return define_law(torque)(gait.robot, gait)


def test_an_entry_as_an_attribute_is_named_with_its_brackets():
    with pytest.raises(AttributeError, match=r"^write state.q\['th1'\] in place of state.q.th1\.$"):
        attempt(lambda state, plan: [state.q.th1, 0])
    with pytest.raises(AttributeError, match=r"write plan.torque\['hp'\] in .* Did you mean 'hip'"):
        attempt(lambda state, plan: [plan.torque.hp, 0])


MADE = {
    "too few torques": (lambda state, plan: [0.0], r"returns 1 torque, but the robot has 2 actuators \(ankle, hip\)"),
    "nothing": (lambda state, plan: None, "returns nothing; it must return the torques by actuator"),
    "text": (lambda state, plan: {"hip": "much"}, "returns a str as the torque of 'hip'"),
    "vector": (lambda state, plan: {"hip": state.q.vector}, "returns 4 numbers as the torque of 'hip'"),
    "actuator": (lambda state, plan: {"hop": 0}, "'hop', which is not an actuator of the robot. Did you mean 'hip'"),
    "coordinate": (lambda state, plan: [state.q["th3"], 0], "Law <lambda>: There is no coordinate 'th3'"),
    "plan": (lambda state, plan: [plan.q["x"], 0], "There is no planned coordinate 'x'"),
    "math": (
        lambda state, plan: [math.sin(state.time), 0],
        "'ankle' in <lambda> contains nan: either a number in it is nan, or a function of the module math was applied",
    ),
    "nan": (lambda state, plan: [0, math.nan * state.time], "'hip' in <lambda> contains nan: either a number in it is"),
    "division by zero": (
        lambda state, plan: [0, state.time / 0],
        r"'hip' in <lambda> contains an infinite number, such as a division by 0 or inf\.$",
    ),
    "condition": (lambda state, plan: [1 if state.time > 0.3 else 0, 0], "uses an expression as a condition"),
    "maximum": (
        lambda state, plan: [max(state.time, 0), 0],
        "Use casadi.if_else for a condition on the time",
    ),
    "numpy": (lambda state, plan: [np.polyval([1, 2], state.time), 0], "that accepts numbers only. Use that of casadi"),
    "sign": (lambda state, plan: [np.sign(state.time), 0], "contains sign, which jumps"),
    "symbol": (lambda state, plan: [ca.SX.sym("k") * state.time, 0], "depends on the symbol k; accepted are"),
    "other symbols": (lambda state, plan: [ca.MX.sym("k"), 0], "must return the torques by actuator"),
}


@pytest.mark.parametrize("name", MADE)
def test_invalid_torques_get_a_sentence(name):
    torque, message = MADE[name]
    with pytest.raises(InputError, match=message):
        attempt(torque)


STATE_JUMPS = {
    "less": (lambda q, v, t: q < v, "a comparison of the state"),
    "at most": (lambda q, v, t: 2.0 * (q <= t), "a comparison of the state"),
    "equal": (lambda q, v, t: q == 0, "a comparison of the state"),
    "different": (lambda q, v, t: ca.sin(v) != t, "a comparison of the state"),
    "if_else": (lambda q, v, t: ca.if_else(v > 0, q, t), "a comparison of the state"),
    "far corner": (
        lambda q, v, t: ca.if_else(ca.logic_and(q > 0, v > 30), v - 30, 0),
        "a comparison of the state",
    ),
    "step in a sum": (lambda q, v, t: ca.if_else(q > 0, q, 0) + 1e-3 * (v > 0), "a comparison of the state"),
    "unreachable": (lambda q, v, t: ca.if_else(q**2 < -1, q, t), "a comparison of the state"),
    "condition": (lambda q, v, t: ca.if_else(v, 1.0, t), "if_else with a condition on the state"),
    "not": (lambda q, v, t: ca.logic_not(v), "if_else with a condition on the state"),
    "and": (lambda q, v, t: ca.logic_and(t > 0, q), "if_else with a condition on the state"),
    "or": (lambda q, v, t: ca.logic_or(q, t > 0), "if_else with a condition on the state"),
    "fmod": (lambda q, v, t: ca.fmod(q, 0.1), "fmod of the state"),
    "remainder": (lambda q, v, t: ca.remainder(q, 0.1), "remainder of the state"),
    "copysign": (lambda q, v, t: ca.copysign(t, v), "copysign with the sign of the state"),
}


@pytest.mark.parametrize("name", STATE_JUMPS)
def test_operations_that_jump_at_a_state_are_rejected(name):
    torque, text = STATE_JUMPS[name]
    with pytest.raises(InputError, match=rf"The torque of 'hip' in <lambda> contains {text}, which jumps; the"):
        attempt(lambda state, plan: [0, torque(state.q["th1"] - plan.q["th1"], state.v["x"], state.time)])


CONTINUOUS = {
    "fmin": lambda q, v, t: ca.fmin(q, v),
    "fmax": lambda q, v, t: ca.fmax(0, q),
    "fabs": lambda q, v, t: ca.fabs(v),
    "copysign": lambda q, v, t: ca.copysign(q, 1.0),
    "time": lambda q, v, t: ca.if_else(t > 0.1, q, v),
    "positive part": lambda q, v, t: ca.if_else(q > 0, q, 0),
    "square": lambda q, v, t: ca.if_else(v <= t, (v - t) ** 2, 0) + ca.if_else(t > 0.1, q, v),
    "saturation": lambda q, v, t: ca.if_else(q > 1, 1, ca.if_else(q < -1, -1, q)),
    "product": lambda q, v, t: ca.if_else(ca.logic_and(q > 0, v > 30), q * (v - 30), 0),
    "wave": lambda q, v, t: ca.fmod(t, 0.1) * q,
}


@pytest.mark.parametrize("name", CONTINUOUS)
def test_continuous_operations_and_those_of_the_time_are_accepted(name):
    torque = CONTINUOUS[name]
    law = attempt(lambda state, plan: [0, torque(state.q["th1"] - plan.q["th1"], state.v["x"], state.time)])
    assert np.all(np.isfinite(law.torque_at(0.2, np.full(4, 0.3), np.full(4, 0.1))))


def test_a_sentence_names_the_line_of_the_function():
    with pytest.raises(InputError, match=r"<lambda> \(test_custom_laws.py, line \d+\) uses an expression"):
        attempt(MADE["condition"][0])


class Spring:
    """Not a function."""


FORMS = {
    "one argument": (lambda state: 0, "must be applied to a function"),
    "class": (Spring, "got the class Spring"),
    "number": (3, "got 3"),
    "no default": (lambda state, plan, k: 0, "is a gain and needs a default value, such as k=1.0"),
    "text": (lambda state, plan, k="high": 0, "default of k must be a number, got 'high'"),
    "reserved": (lambda state, plan, torque_limit=3: 0, "'torque_limit' of .* needs another name"),
}


@pytest.mark.parametrize("name", FORMS)
def test_invalid_functions_get_a_sentence(name):
    function, message = FORMS[name]
    with pytest.raises(InputError, match=message):
        define_law(function)


def test_invalid_arguments_get_a_sentence():
    with pytest.raises(InputError, match=r"has no gain 'stifness'. Did you mean 'stiffness'"):
        hip_servo(COMPASS.robot, COMPASS, stifness=3)
    with pytest.raises(InputError, match="stiffness"):
        hip_servo(COMPASS.robot, COMPASS, stiffness=math.nan)
    with pytest.raises(InputError, match="must be the PlanarGait of a robot with several contacts, not its motion"):
        foot_placement(HEEL_TOE.robot, HEEL_TOE.motion)
    with pytest.raises(InputError, match="must be the Gait of a robot with one foot on the ground"):
        hip_servo(COMPASS.robot, HEEL_TOE)


KINKS = {
    "fabs": lambda x: ca.fabs(x),
    "if_else": lambda x: ca.if_else(x > 0, 2 * x, x),
    "fmax": lambda x: ca.fmax(x, 3 * x),
}


def curved_servo(shape):
    """Return a law whose torque depends on the error by a function."""

    @define_law
    def servo(state, plan, stiffness=5.0):
        (name, actuator) = ("b", "motor") if "motor" in plan.torque.names else ("th2", "hip")
        return {actuator: plan.torque[actuator] - stiffness * shape(state.q[name] - plan.q[name])}

    return servo


@pytest.mark.parametrize("gait", [COMPASS, HEEL_TOE], ids=["one foot", "several contacts"])
@pytest.mark.parametrize("shape", KINKS.values(), ids=KINKS)
def test_a_law_with_a_kink_along_the_plan_is_rejected_immediately(gait, shape):
    law = curved_servo(shape)(gait.robot, gait)
    with pytest.raises(InputError, match=r"has a kink at the planned motion: .* the coordinate '(b|th2)' on both"):
        assess_stability(gait, law)
    with pytest.raises(InputError, match="has a kink at the planned motion"):
        tune_feedback(gait, ControllerFamily.from_law(law))


@pytest.mark.parametrize("gait", [COMPASS, HEEL_TOE], ids=["one foot", "several contacts"])
def test_kinks_apart_from_the_plan_and_smooth_laws_are_accepted(gait):
    for shape in (lambda x: ca.fmax(x, -0.5), lambda x: ca.sqrt(x**2 + 1e-2) - 0.1):
        assert np.isfinite(assess_stability(gait, curved_servo(shape)(gait.robot, gait)).radius)


def test_a_kink_that_the_motion_crosses_is_accepted():
    @define_law
    def crossed(state, plan, stiffness=1.0):
        return {"hip": plan.torque["hip"] + stiffness * ca.fmax(state.q["th1"], 0) * (state.q["th2"] - plan.q["th2"])}

    assert np.isfinite(assess_stability(COMPASS, crossed(COMPASS.robot, COMPASS)).radius)


@pytest.mark.parametrize("gait", [COMPASS, HEEL_TOE], ids=["one foot", "several contacts"])
def test_a_law_whose_torque_is_undefined_along_the_plan_is_named(gait):
    law = curved_servo(lambda x: ca.log(-1 - x**2))(gait.robot, gait)
    message = r"The law 'servo' returns nan as the torque of '(hip|motor)' at 0 s of the planned motion. Check the law"
    with pytest.raises(InputError, match=message):
        assess_stability(gait, law)
    with pytest.raises(InputError, match=message):
        tune_feedback(gait, ControllerFamily.from_law(law))
