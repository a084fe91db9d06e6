"""A custom feedback law in one script, with gains, memory and an event, used by the commands and by Python."""

import importlib.util
import json
import math
from pathlib import Path

import numpy as np
import pytest

from gaitopt import ScipyEngine, load, simulate
from gaitopt.simulation import default_engine
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section

SCRIPT = '''
import casadi as ca
import numpy as np

from gaitopt import Law, feedforward
from gaitopt.control import control_function, law_inputs, make_memory


def hip_brake(robot, motion, torque_limit):
    """The planned torques; a spring and a damper act on the swing leg once the stance leg has been upright."""
    base = feedforward(robot, motion)
    rows = base.table.shape[0]
    inputs = law_inputs(robot, data=rows + 2, latched=1)
    data, braking = inputs.data, inputs.latched
    planned = base.control(*inputs._replace(data=data[:rows], latched=ca.SX(0, 1)))[0]
    brake = -data[rows] * (inputs.q[3] - 0.1) - data[rows + 1] * inputs.v[3]
    control = control_function(
        inputs,
        planned + ca.vertcat(0, braking * brake),
        guards=braking - (1 - braking) * inputs.q[2],  # counts only before the brake acts
    )
    memory = make_memory(inputs, ca.SX(0), values=["braking"], events=["stance leg upright"], reset=ca.SX(1))
    numbers = np.repeat([[0.2], [0.1]], base.breakpoints.size, axis=1)
    table = np.vstack([base.table, numbers])
    gains = {"stiffness": rows, "damping": rows + 1}
    return Law("hip brake", control, base.breakpoints, table, gains, memory)
'''
GAIT = Path("docs/examples/compass_slip.h5").resolve()
RECORDED = load(GAIT)


@pytest.fixture
def script(folder):
    (folder / "brake.py").write_text(SCRIPT)
    return folder / "brake.py"


@pytest.fixture
def law(script):
    specification = importlib.util.spec_from_file_location("brake", script)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module.hip_brake(RECORDED.robot, RECORDED.motion, math.inf)


@pytest.mark.slow
def test_the_commands_name_tune_simulate_and_export_it(script, command):
    name = f"{script.name}:hip_brake"
    tuned = command("tune", GAIT, "--law", name, "--starts", "1", "-o", "gains.json", "--json")
    assert tuned.status == 0, tuned.err
    assert tuned.json["law"] == name
    assert set(tuned.json["gains"]) == {"stiffness", "damping"}
    assert tuned.json["radius_after"] <= tuned.json["radius_before"]
    stability = command("stability", GAIT, "--law", "gains.json", "--json")
    assert stability.status == 0, stability.err
    assert stability.json["gaits"][0]["radius"] == pytest.approx(tuned.json["radius_after"], rel=1e-9)
    for arguments in (
        ("simulate", GAIT, "--law", name, "--gain", "stiffness=0.1", "--steps", "2"),
        ("export", GAIT, "--law", "gains.json", "-o", "controller.c"),
        ("export", GAIT, "--law", "gains.json", "-o", "torques.json"),
    ):
        done = command(*arguments)
        assert done.status == 0, done.err
    table = json.loads((script.parent / "torques.json").read_text(encoding="utf-8"))
    assert (table["gains"], table["events"]) == (tuned.json["gains"], ["stance leg upright"])


@pytest.mark.parametrize("engine", [default_engine(), ScipyEngine()], ids=lambda engine: engine.name)
def test_the_event_is_located(law, engine):
    first = RECORDED.motion.segments[0]
    walk = simulate(
        RECORDED.robot, first.q[:, 0], first.v[:, 0], RECORDED.motion.parameters, law=law, engine=engine, steps=2
    )
    for step in range(2):
        (event,) = (event for event in walk.events if event.name == "stance leg upright" and event.step == step)
        (segment,) = (
            one for one in walk.motion.segments if one.step == step and one.time[0] < event.time < one.time[-1]
        )
        assert segment.q[2, np.argmin(np.abs(segment.time - event.time))] == pytest.approx(0.0, abs=1e-10)


def test_multipliers_contain_the_event(law):
    first, robot = RECORDED.motion.segments[0], RECORDED.robot
    walker = make_walker(robot, law, RECORDED.motion.parameters, period=RECORDED.period)
    section = Section(robot, walker.p, sliding=True)
    returning = ReturnMap(walker, section)
    z = section.project(np.concatenate([first.q[:, 0], first.v[:, 0]]))
    exact, step = returning.derivative(z, returning(z)), 1e-6 * np.eye(z.size)
    differences = np.column_stack([(returning(z + h).end - returning(z - h).end) / 2e-6 for h in step])
    np.testing.assert_allclose(exact, differences, atol=1e-5 * np.max(np.abs(exact)))
