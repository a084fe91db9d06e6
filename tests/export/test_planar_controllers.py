"""Controllers of robots with several contacts as C and as Python have the torques of the simulator."""

import ctypes
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from gaitopt import Collocation, InputError, feedforward
from gaitopt.control import PlanarLaw, by_phase_variable, planar_feedforward, planar_joint_pd
from gaitopt.control.planar_laws.planar_law import PlannedImpulses
from gaitopt.export import write_python
from gaitopt.model import compass_with_two_feet
from gaitopt.motion.actuator_impulses import EventImpulses
from gaitopt.ocp import PlanarLimits, PlanarProblem, solve_planar
from gaitopt.simulation.planar_simulation.planar_torque import make_torque
from gaitopt.tuning import planar_lqr, planar_step_lqr
from tests.export.test_c_code import build, call, compiled, pointer
from tests.export.test_python_controller import run_module


@pytest.fixture(scope="module")
def walk():
    """A gait whose legs are exchanged at its section."""
    return solve_planar(
        PlanarProblem(
            robot=compass_with_two_feet(),
            sequence="foot A stick |",
            friction=1.0,
            speed=0.633,
            step_length=0.4713,
            objective="torque_squared",
            limits=PlanarLimits(torque={"ankle B": 0}),
            transcription=Collocation(intervals=10),
        )
    )


def two_parts(gait):
    """Return a law whose torque is doubled after the first impact that does not end its period."""
    (part,) = planar_joint_pd(gait, stiffness=20, damping=5).parts
    other = part.with_gains({name: 2 * value for name, value in part.gain_values.items()})
    return PlanarLaw("two parts", "foot B closes", (part, other))


def with_impulses(gait):
    """Return a law of two parts with impulses at the impacts that end them."""
    first = EventImpulses(np.array([0.1, 0.2, 0.0]), np.array([0.0, 0.0, -0.3]))
    second = EventImpulses(np.array([0.0, -0.5, 0.0]), np.array([1 / 3, 0.0, 0.0]))
    planned = PlannedImpulses("hip point", first), PlannedImpulses("foot B", second)
    return replace(two_parts(gait), impulses=planned)


LAWS = {
    "feedforward": planar_feedforward,
    "two parts": two_parts,
    "step_lqr": planar_step_lqr,
    "stance angle": lambda gait: by_phase_variable(gait, planar_lqr(gait)),
}


@pytest.fixture(scope="module", params=LAWS)
def law(request, walk):
    return LAWS[request.param](walk)


def list_samples(robot, law, rng):
    """Yield an event (1 ends a period, 2 another impact, 0 none), time, clock, state and torque of the simulator."""
    source, memory, time = make_torque(robot, law), None, 0.0
    ends = {False: "foot B", True: "foot A"}
    for event in (1, 0, 2, 0, 1, 0, 2, 0, 1, 0):
        time += 0.1
        q, v = rng.uniform(-0.3, 0.3, robot.n_q), rng.uniform(-1, 1, robot.n_q)
        closing = [ends[memory.mirrored]] if memory is not None and event == 1 else ["hip point"]
        if event:
            memory = source.pass_impact(memory, closing, time, q, v)
        yield event, time, time - memory.begin, q, v, source.phase_torque(memory).value(time, q, v).copy()


def test_the_python_controller_has_the_torques_of_the_simulator(tmp_path, walk, law, rng):
    controller = run_module(write_python(walk.robot, law, tmp_path / "controller.py"))["Controller"]()
    sections = []
    for event, _, clock, q, v, torque in list_samples(walk.robot, law, rng):
        if event == 1:
            controller.begin(q, v)
            sections.append(controller.section)
        elif event == 2:
            controller.impact()
        assert controller.step(clock, q, v) == pytest.approx(torque, rel=1e-12, abs=1e-12)
    assert sections == ["foot B", "foot A", "foot B"]


@compiled
@pytest.mark.slow
def test_the_c_controller_has_the_torques_of_the_simulator(tmp_path, walk, law, rng):
    library = build(walk.robot, law, walk.motion.parameters, tmp_path, "walker")
    library.walker_update.restype = None
    state, following, torque = (
        np.zeros(3 + max(len(law.latched), 1)),
        np.zeros(3 + max(len(law.latched), 1)),
        np.zeros(3),
    )
    for event, time, _, q, v, expected in list_samples(walk.robot, law, rng):
        numbers = ctypes.c_double(time), ctypes.c_double(event)
        outputs = [array.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for array in (following, torque)]
        library.walker_update(pointer(state), *numbers, pointer(q), pointer(v), *outputs)
        assert torque == pytest.approx(expected, rel=1e-12, abs=1e-12)
        state[:] = following


@compiled
def test_the_c_code_has_the_dynamics_and_gaps_of_the_robot(tmp_path, walk, rng):
    robot, law = walk.robot, planar_feedforward(walk)
    library = build(robot, law, walk.motion.parameters, tmp_path, "walker")
    q, v, p = rng.uniform(-0.3, 0.3, robot.n_q), rng.uniform(-1, 1, robot.n_q), robot.vector(walk.motion.parameters)
    n, n_c = robot.n_q, len(robot.contacts)
    mass, bias, _ = call(library.walker_dynamics, (q, v, p), (n * n, n, n * robot.n_u))
    gap, _ = call(library.walker_gaps, (q, p), (n_c, n_c))
    expected = robot.dynamics(q, v, p)
    state, following, torque = np.zeros(4), np.zeros(4), np.zeros(3)
    outputs = [array.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for array in (following, torque)]
    library.walker_update.restype = None
    library.walker_update(pointer(state), ctypes.c_double(0), ctypes.c_double(1), pointer(q), pointer(v), *outputs)
    assert torque == pytest.approx(walk.motion.segments[0].torque[:, 0], rel=1e-12)
    assert following.tolist()[:3] == [0, 0, 1]
    assert mass.reshape(n, n, order="F") == pytest.approx(np.array(expected[0]), rel=1e-13)
    assert bias == pytest.approx(np.array(expected[1]).ravel(), rel=1e-12, abs=1e-12)
    assert gap == pytest.approx(np.array(robot.gaps(q, p)[0]).ravel(), rel=1e-13)


def list_impulses(robot, law, rng):
    """Yield an event, its state, and the impulses of the simulator at the impact of each contact after it."""
    source, memory, time = make_torque(robot, law), None, 0.0
    for event in (1, 2, 1, 2, 1):
        time += 0.1
        q, v = rng.uniform(-0.3, 0.3, robot.n_q), rng.uniform(-1, 1, robot.n_q)
        section = "foot A" if memory is not None and memory.mirrored else "foot B"
        memory = source.pass_impact(memory, [section if event == 1 else "hip point"], time, q, v)
        acting = {name: source.impulses(memory, [name]) for name in robot.contact_names}
        yield event, q, v, {name: np.zeros((2, 3)) if each is None else np.array(each) for name, each in acting.items()}


def test_the_python_controller_has_the_impulses_of_the_simulator(tmp_path, walk, rng):
    law = with_impulses(walk)
    controller = run_module(write_python(walk.robot, law, tmp_path / "controller.py"))["Controller"]()
    acted = []
    for event, q, v, expected in list_impulses(walk.robot, law, rng):
        if event == 1:
            controller.begin(q, v)
        else:
            controller.impact()
        for name, values in expected.items():
            assert controller.impulses(name).tolist() == values.tolist()
        acted += [name for name, values in expected.items() if values.any()]
    assert acted == ["hip point", "foot B", "hip point", "foot A", "hip point"]
    table = (tmp_path / "controller.py").read_text()
    assert "# part 1, foot B closes, ankle B, before: -0.5 N m s" in table.splitlines()


@compiled
@pytest.mark.slow
def test_the_c_controller_has_the_impulses_of_the_simulator(tmp_path, walk, rng):
    law, names = with_impulses(walk), walk.robot.contact_names
    library = build(walk.robot, law, walk.motion.parameters, tmp_path, "walker")
    library.walker_update.restype = library.walker_next_impulses.restype = None
    state, following, torque = np.zeros(4), np.zeros(4), np.zeros(3)
    contact, before, after = np.zeros(1), np.zeros(3), np.zeros(3)
    for event, q, v, expected in list_impulses(walk.robot, law, rng):
        numbers = ctypes.c_double(0.0), ctypes.c_double(event)
        outputs = [array.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for array in (following, torque)]
        library.walker_update(pointer(state), *numbers, pointer(q), pointer(v), *outputs)
        state[:] = following
        outputs = [array.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for array in (contact, before, after)]
        library.walker_next_impulses(pointer(state), *outputs)
        (acting,) = [name for name, values in expected.items() if values.any()]
        assert names[int(contact[0])] == acting
        assert np.array([before, after]).tolist() == expected[acting].tolist()


def by_angle(gait):
    """Return a law by the stance angle whose first part ends at the opening of the foot, and its samples of a period.

    A sample is an event (1 begins the period, 2 an impact, 3 the opening), a state and the torque of the simulator.
    """
    law, robot = by_phase_variable(gait, planar_feedforward(gait)), gait.robot
    source, samples = make_torque(robot, law), []
    stance, flight = gait.motion.segments
    memory = source.start(0.0, stance.q[:, 0], stance.v[:, 0])
    for event, segment, k in ((1, stance, 0), (0, stance, 4), (2, stance, 5), (3, flight, 0), (0, flight, 7)):
        if event == 2:
            memory = source.pass_impact(memory, ["hip point"], 0.0, segment.q[:, k], segment.v[:, k])
        if event == 3:
            memory = source.pass_event(memory, ("foot opens",))
        q, v = segment.q[:, k].copy(), segment.v[:, k].copy()
        samples.append((event, q, v, source.phase_torque(memory).value(9.0, q, v).copy()))
    assert memory.part == 1
    return law, samples


def test_the_python_controller_passes_the_opening_of_a_foot(tmp_path, hop_gait):
    law, samples = by_angle(hop_gait)
    controller = run_module(write_python(hop_gait.robot, law, tmp_path / "hop.py"))["Controller"]()
    endings = []
    for event, q, v, torque in samples:
        if event == 1:
            controller.begin(q, v)
        elif event == 2:
            controller.impact()  # has no effect: the part does not end with an impact
        elif event == 3:
            endings.append(controller.ending)
            controller.pass_ending()
        assert controller.step(9.0, q, v) == pytest.approx(torque, rel=1e-9, abs=1e-9)
    assert [*endings, controller.ending] == ["foot opens", None]


@compiled
@pytest.mark.slow
def test_the_c_controller_passes_the_opening_of_a_foot(tmp_path, hop_gait):
    law, samples = by_angle(hop_gait)
    library = build(hop_gait.robot, law, hop_gait.motion.parameters, tmp_path, "hopper")
    library.hopper_update.restype = None
    state, following, torque = np.zeros(4), np.zeros(4), np.zeros(2)
    for event, q, v, expected in samples:
        outputs = [array.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for array in (following, torque)]
        library.hopper_update(
            pointer(state), ctypes.c_double(9.0), ctypes.c_double(event), pointer(q), pointer(v), *outputs
        )
        assert torque == pytest.approx(expected, rel=1e-9, abs=1e-9)
        state[:] = following
    assert "part 0: foot opens" in (tmp_path / "hopper.h").read_text()


def test_code_without_impulses_has_no_table(tmp_path, walk):
    text = write_python(walk.robot, planar_feedforward(walk), tmp_path / "plain.py").read_text()
    assert "impulse" not in text.lower()


def test_the_controller_of_a_hop_replays_the_plan(tmp_path, hop_gait):
    write_python(hop_gait.robot, planar_feedforward(hop_gait), tmp_path / "hop_controller.py")
    first = hop_gait.motion.segments[0]
    code = (
        "import sys, hop_controller\n"
        "controller = hop_controller.Controller()\n"
        f"q, v = {first.q[:, 0].tolist()}, {first.v[:, 0].tolist()}\n"
        "controller.begin(q, v)\n"
        f"for clock in {first.time.tolist()}:\n"
        "    print(*controller.step(clock, q, v))\n"
        "print([name for name in ('casadi', 'gaitopt', 'scipy') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    *torques, modules = done.stdout.splitlines()
    assert modules == "[]"
    np.testing.assert_allclose(
        [[float(text) for text in row.split()] for row in torques], first.torque.T, rtol=1e-12, atol=1e-9
    )


def test_a_law_of_another_robot_is_refused(tmp_path, walk, hop_gait, compass, slip_gait):
    with pytest.raises(InputError, match="does not belong to the robot 'compass_with_two_feet'"):
        write_python(walk.robot, planar_feedforward(hop_gait), tmp_path / "law.py")
    with pytest.raises(InputError, match="law must be a PlanarLaw such as"):
        write_python(walk.robot, feedforward(compass, slip_gait.motion), tmp_path / "law.py")
    with pytest.raises(InputError, match="law must be a Law such as"):
        write_python(compass, planar_feedforward(walk), tmp_path / "law.py")
