"""A controller as Python code has the torques of its law, and imports NumPy only."""

import subprocess
import sys

import casadi as ca
import numpy as np
import pytest

from gaitopt import InputError, by_stance_angle, feedforward, joint_pd, lqr, passive, push_off, step_to_step
from gaitopt.export import write_python
from gaitopt.export.python_code import write_function
from gaitopt.simulation.hybrid_automaton import make_walker


def run_module(path):
    namespace = {}
    exec(compile(path.read_text(encoding="utf-8"), str(path), "exec"), namespace)
    return namespace


LAWS = {
    "feedforward": lambda robot, gait: feedforward(robot, gait.motion),
    "joint_pd": lambda robot, gait: joint_pd(robot, gait.motion, stiffness=20, damping=5, torque_limit=6),
    "lqr": lambda robot, gait: lqr(robot, gait.motion, torque_limit=6),
    "stance_angle": lambda robot, gait: by_stance_angle(robot, gait.motion, feedforward(robot, gait.motion)),
    "step_to_step": lambda robot, gait: step_to_step(
        robot, feedforward(robot, gait.motion), np.ones(4), np.ones((4, 4)), windows=2, duration=gait.period
    ),
}


@pytest.mark.parametrize("name", LAWS)
def test_torques_at_random_states_are_those_of_the_law(tmp_path, compass, slip_gait, rng, name):
    law = LAWS[name](compass, slip_gait)
    controller = run_module(write_python(compass, law, tmp_path / "controller.py"))["Controller"]()
    for _ in range(20):
        q, v, clock = rng.uniform(-0.3, 0.3, 4), rng.uniform(-1, 1, 4), rng.uniform(0, 0.8)
        controller.begin(q, v)
        latched = np.asarray(law.memory.latch(q, v, law.table[:, 0])).ravel()
        assert controller.latched == pytest.approx(latched, rel=1e-12)
        expected = law.torque_at(clock, q, v, latched=latched, slide=1)
        assert controller.step(clock, q, v, 1) == pytest.approx(expected, rel=1e-10, abs=1e-10)


def test_a_law_with_discrete_states_steps_as_in_the_simulator(tmp_path, compass, slip_gait):
    base = joint_pd(compass, slip_gait.motion, stiffness=20, damping=5, torque_limit=6)
    law = push_off(compass, base, torque=2.0, duration=0.07, actuator="hip", trigger="retraction")
    controller = run_module(write_python(compass, law, tmp_path / "pushing.py"))["Controller"]()
    walker = make_walker(compass, law, slip_gait.motion.parameters, period=slip_gait.period)
    first = slip_gait.motion.segments[0]
    state = np.concatenate([first.q[:, 0], first.v[:, 0] + np.array([0, 0, 0.01, -0.02])])
    controller.begin(state[:4], state[4:])
    states = set()
    for mode, arc in walker.walk_step(state, record=True).arcs:
        for clock, y in zip(arc.time[1:-1], arc.states.T[1:-1], strict=True):
            torque = controller.step(clock, y[:4], y[4:8], mode.sign)
            assert torque == pytest.approx(np.asarray(walker.torque(mode, clock, y)), abs=1e-12)
            states.add(int(np.argmax(controller.latched[:4])))
    assert states == {0, 1, 2, 3}


def test_the_module_imports_numpy_only(tmp_path, compass, slip_gait):
    write_python(compass, feedforward(compass, slip_gait.motion), tmp_path / "walk_controller.py")
    code = (
        "import sys, walk_controller\n"
        "torque = walk_controller.Controller().step(0.1, [0, 0, -0.1, -0.1], [0, 0, 0.7, 0.7])\n"
        "print(torque.shape, [name for name in ('casadi', 'gaitopt', 'scipy') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout == "(2,) []\n"


def test_every_operation_has_the_value_of_casadi(rng):
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    values = [
        *(f(x) for f in (ca.sin, ca.tanh, ca.fabs, ca.sign, ca.floor, ca.ceil, ca.exp, ca.sqrt, ca.erf, ca.log1p)),
        *(x + y, x - y, x * y, x / y, x**y, x**3, -x, x**2, 2 * x, 1 / x, ca.atan2(x, y), ca.fmin(x, y)),
        *(ca.fmax(x, y), x < y, x <= y, x == y, x != y, ca.logic_not(x), ca.logic_and(x, y), ca.logic_or(x, y)),
        *(ca.if_else(x > y, x, y), ca.fmod(x, y), ca.copysign(x, -y), ca.hypot(x, y)),
    ]
    function = ca.Function("f", [x, y], [ca.vertcat(*values)], ["x", "y"], ["z"])
    namespace = {}
    exec("import math\n" + write_function(function, "evaluate"), namespace)
    for a, b in rng.uniform(0.1, 2, (20, 2)):
        assert namespace["evaluate"]([a], [b])[0] == pytest.approx(np.asarray(function(a, b)).ravel(), rel=1e-13)


def test_a_name_of_no_module_and_a_law_of_another_robot(tmp_path, compass, wheel):
    with pytest.raises(InputError, match=r"such as controller\.py, whose name begins with a letter and contains"):
        write_python(compass, passive(compass), tmp_path / "my-law.py")
    with pytest.raises(InputError, match="does not belong"):
        write_python(compass, passive(wheel), tmp_path / "law.py")


def test_a_script_is_not_overwritten_but_a_controller_is(tmp_path, compass):
    path = tmp_path / "law.py"
    write_python(compass, passive(compass), write_python(compass, passive(compass), path))
    path.write_text("import precious\n")
    with pytest.raises(InputError, match="a script, which is not overwritten"):
        write_python(compass, passive(compass), path)
    assert path.read_text() == "import precious\n"
