"""C code, compiled and run beside the Functions it was made from."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest

from gaitopt import InputError, Mode, by_stance_angle, feedforward, joint_pd, passive, push_off, step_to_step, write_c
from gaitopt.control.inverse_dynamics import prescribed_angles
from gaitopt.model.contacts.mode import PHYSICAL
from gaitopt.simulation.hybrid_automaton import make_walker

CC = shutil.which("cc") or shutil.which("gcc")
compiled = pytest.mark.skipif(CC is None, reason="needs a C compiler on the PATH (Debian: apt-get install gcc)")


def build(robot, law, parameters, folder, name):
    """Return the compiled library of a robot and a law, without one warning of the compiler."""
    source = write_c(robot, law, parameters, folder / f"{name}.c")
    library = folder / f"{name}.so"
    flags = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-shared", "-fPIC"]
    subprocess.run([CC, *flags, str(source), "-o", str(library), "-lm"], check=True, capture_output=True, text=True)
    return ctypes.CDLL(str(library))


def pointer(values):
    return np.ascontiguousarray(values, dtype=float).ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def call(function, inputs, sizes):
    """Return the outputs of a C function, flat and column by column."""
    given = [np.array(value, dtype=float) for value in inputs]
    outputs = [np.full(size, np.nan) for size in sizes]
    function.restype = None
    function(*map(pointer, given), *[output.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for output in outputs])
    return outputs


def call_first(function, inputs, size):
    """Return the output of a C function that writes into its first argument, as a controller into its state."""
    state = np.full(size, np.nan)
    function.restype = None
    function(pointer(state), *map(pointer, inputs))
    return state


@pytest.fixture(scope="module")
def library(tmp_path_factory, compass, slip_gait):
    law = feedforward(compass, slip_gait.motion)
    return build(compass, law, slip_gait.motion.parameters, tmp_path_factory.mktemp("c"), "walker")


@compiled
@pytest.mark.parametrize("mode", PHYSICAL)
def test_accelerations_and_forces_are_those_of_the_model(library, compass, slip_gait, rng, mode):
    p = compass.vector(slip_gait.motion.parameters)
    function = getattr(library, f"walker_acceleration_{mode.name.lower()}")
    for _ in range(20):
        q, v, u = rng.uniform(-1, 1, 4), rng.uniform(-2, 2, 4), rng.uniform(-6, 6, 2)
        ours = call(function, (q, v, u, p), (4, 2))
        expected = [np.asarray(part).ravel() for part in compass.acceleration[mode](q, v, u, p)]
        for our, their in zip(ours, expected, strict=True):
            assert our == pytest.approx(their, rel=1e-13, abs=1e-13)


@compiled
def test_matrices_come_column_by_column(library, compass, slip_gait, rng):
    p = compass.vector(slip_gait.motion.parameters)
    q, v = rng.uniform(-1, 1, 4), rng.uniform(-2, 2, 4)
    mass, bias, actuation = call(library.walker_dynamics, (q, v, p), (16, 4, 8))
    expected = compass.dynamics(q, v, p)
    assert mass.reshape(4, 4, order="F") == pytest.approx(np.asarray(expected[0]), abs=1e-14)
    assert bias == pytest.approx(np.asarray(expected[1]).ravel(), abs=1e-13)
    assert actuation.reshape(4, 2, order="F") == pytest.approx(np.asarray(expected[2]))


@compiled
def test_parameters_are_in_the_library(library, compass, slip_gait):
    inside = (ctypes.c_double * len(compass.parameters)).in_dll(library, "walker_parameters")
    assert list(inside) == compass.vector(slip_gait.motion.parameters).tolist()


def torque_of(library, prefix, clock, q, v, latched=None, slide=0):
    torque = np.full(2, np.nan)
    control = getattr(library, f"{prefix}_control")
    control.restype = None
    control(
        ctypes.c_double(clock),
        pointer(q),
        pointer(v),
        None if latched is None else pointer(latched),
        ctypes.c_double(slide),
        torque.ctypes.data_as(ctypes.POINTER(ctypes.c_double)),
    )
    return torque


@compiled
def test_the_controller_plays_the_torques_back(library, compass, slip_gait, rng):
    law = feedforward(compass, slip_gait.motion)
    q, v = rng.uniform(-1, 1, 4), rng.uniform(-2, 2, 4)
    clocks = [-0.1, 0.0, *rng.uniform(0, slip_gait.period, 50), *law.breakpoints[:5], 10.0]
    for clock in clocks:
        expected = law.torque_at(clock, q, v)
        assert torque_of(library, "walker", clock, q, v) == pytest.approx(expected, rel=1e-13, abs=1e-13)


@compiled
def test_a_feedback_law_sees_the_state(tmp_path, compass, slip_gait, rng):
    law = joint_pd(compass, slip_gait.motion, stiffness=20, damping=5, torque_limit=6)
    library = build(compass, law, slip_gait.motion.parameters, tmp_path, "fed_back")
    for _ in range(20):
        clock, q, v = rng.uniform(0, 0.8), rng.uniform(-0.3, 0.3, 4), rng.uniform(-1, 1, 4)
        expected = law.torque_at(clock, q, v)
        assert torque_of(library, "fed_back", clock, q, v) == pytest.approx(expected, rel=1e-12, abs=1e-12)


@compiled
def test_a_law_by_the_stance_angle(tmp_path, compass, slip_gait, rng):
    law = by_stance_angle(compass, slip_gait.motion, feedforward(compass, slip_gait.motion))
    library = build(compass, law, slip_gait.motion.parameters, tmp_path, "angle")
    for th1 in rng.uniform(-0.2, 0.2, 20):
        q = [0, 0, th1, 0.1]
        expected = law.torque_at(0.0, q, np.zeros(4))
        ours = torque_of(library, "angle", 0.3, q, np.zeros(4))
        assert ours == pytest.approx(np.asarray(expected).ravel(), rel=1e-9, abs=1e-9)


@compiled
def test_a_law_that_keeps_values_over_a_step(tmp_path, compass, slip_gait, rng):
    base, gains = feedforward(compass, slip_gait.motion), rng.uniform(-2, 2, (4, 4))
    law = step_to_step(
        compass, base, rng.uniform(-1, 1, 4), gains, windows=2, duration=slip_gait.period, torque_limit=6
    )
    library = build(compass, law, slip_gait.motion.parameters, tmp_path, "stepping")
    for _ in range(20):
        q, v = rng.uniform(-1, 1, 4), rng.uniform(-1, 1, 4)
        latched = call_first(library.stepping_begin, (q, v), 4)
        assert latched == pytest.approx(np.asarray(law.memory.latch(q, v, law.table[:, 0])).ravel(), rel=1e-13)
        clock = rng.uniform(0, 0.8)
        expected = law.torque_at(clock, q, v, latched=latched, slide=1)
        ours = torque_of(library, "stepping", clock, q, v, latched, 1)
        assert ours == pytest.approx(np.asarray(expected).ravel(), rel=1e-12, abs=1e-12)


@compiled
def test_a_sliding_foot_is_told_to_the_law(tmp_path, compass, slip_gait, rng):
    law = prescribed_angles(compass, slip_gait.motion, slip_gait.motion.parameters)
    library = build(compass, law, slip_gait.motion.parameters, tmp_path, "angles")
    for slide in (1, 0, -1):
        clock, q, v = rng.uniform(0, 0.7), rng.uniform(-0.2, 0.2, 4), rng.uniform(-1, 1, 4)
        expected = law.torque_at(clock, q, v, slide=slide)
        ours = torque_of(library, "angles", clock, q, v, np.zeros(0), slide)
        assert ours == pytest.approx(np.asarray(expected).ravel(), rel=1e-9, abs=1e-9)


def start_of(state, slide):
    """Return the state after a touchdown and the sign of the slide as arguments."""
    return pointer(state[:4]), pointer(state[4:]), ctypes.c_double(slide)


@compiled
@pytest.mark.parametrize("trigger", ["retraction", "touchdown"])
def test_a_law_with_discrete_states_steps_as_in_the_simulator(tmp_path, compass, slip_gait, trigger):
    """Two steps of a walk, sample by sample: the C controller sees only clock, q, v and the sign of the slide."""
    base = joint_pd(compass, slip_gait.motion, stiffness=20, damping=5, torque_limit=6)
    law = push_off(compass, base, torque=2.0, duration=0.07, actuator="hip", trigger=trigger)
    library = build(compass, law, slip_gait.motion.parameters, tmp_path, "pushing")
    walker = make_walker(compass, law, slip_gait.motion.parameters, period=slip_gait.period)
    first, memory, torque, differences, states = slip_gait.motion.segments[0], np.zeros(5), np.zeros(2), [], set()
    state = np.concatenate([first.q[:, 0], first.v[:, 0] + np.array([0, 0, 0.01, -0.02])])
    library.pushing_begin.restype = library.pushing_step.restype = library.pushing_update.restype = None
    plain, following, updated, start = np.zeros(6), np.zeros(6), np.zeros(2), 0.0
    for _ in range(2):
        walk_step, touchdown = walker.walk_step(state, record=True), 1.0
        library.pushing_begin(pointer(memory), pointer(state[:4]), pointer(state[4:]))
        for mode, arc in walk_step.arcs:
            for clock, y in zip(arc.time[1:-1], arc.states.T[1:-1], strict=True):
                inputs = ctypes.c_double(clock), pointer(y[:4]), pointer(y[4:8]), ctypes.c_double(mode.sign)
                library.pushing_step(pointer(memory), *inputs, pointer(torque))
                differences.append(np.max(np.abs(torque - walker.torque(mode, clock, y))))
                if touchdown:
                    start += 10.0  # the controller subtracts the time of the touchdown
                    library.pushing_update(
                        pointer(plain),
                        *map(ctypes.c_double, (start, 1.0)),
                        *start_of(state, 0.0),
                        pointer(following),
                        pointer(updated),
                    )
                    plain, touchdown = following.copy(), 0.0
                library.pushing_update(
                    pointer(plain),
                    *map(ctypes.c_double, (start + clock, 0.0)),
                    *inputs[1:],
                    pointer(following),
                    pointer(updated),
                )
                plain = following.copy()
                assert updated == pytest.approx(torque, abs=1e-9)
                assert plain[1:] == pytest.approx(memory, abs=1e-9)
                assert memory == pytest.approx(y[8:], abs=0.01)  # the release is noticed at the next sample
                states.add(int(np.argmax(memory[:4])))
        state = walk_step.following
    assert max(differences) < 1e-12
    assert len(differences) > 50
    assert states == ({0, 1, 2, 3} if trigger == "retraction" else {2, 3})


def test_the_code_allocates_no_memory(tmp_path, compass, slip_gait):
    path = write_c(compass, feedforward(compass, slip_gait.motion), slip_gait.motion.parameters, tmp_path / "gait.c")
    text = path.read_text(encoding="utf-8")
    assert "alloc(" not in text
    assert "#define GAIT_STATE_SIZE 2" in path.with_suffix(".h").read_text(encoding="utf-8")


@compiled
def test_a_robot_without_actuators(tmp_path, wheel):
    library = build(wheel, passive(wheel), {"slope": 0.2}, tmp_path, "wheel")
    p = wheel.vector(wheel.resolve({"slope": 0.2}))  # friction is infinite here
    q, v = [0, 0, 0.1], [0, 0, 0.9]
    ours = call(library.wheel_acceleration_stick, (q, v, [], p), (3, 2))
    expected = wheel.acceleration[Mode.STICK](q, v, [], p)
    assert ours[0] == pytest.approx(np.asarray(expected[0]).ravel(), rel=1e-13)


@compiled
def test_the_header_serves_cpp(tmp_path, compass, slip_gait):
    write_c(compass, feedforward(compass, slip_gait.motion), slip_gait.motion.parameters, tmp_path / "gait.c")
    program = tmp_path / "main.cpp"
    program.write_text('#include <cstddef>\n#include "gait.h"\nint main() { return gait_parameters[0] > 0 ? 0 : 1; }\n')
    compiler = shutil.which("c++") or shutil.which("g++")
    if compiler is None:
        pytest.skip("needs a C++ compiler")
    subprocess.run([compiler, "-fsyntax-only", "-Wall", "-Wextra", "-Werror", str(program)], check=True)


@pytest.mark.parametrize("name", ["gait.txt", "2steps.c", "my-gait.c", "größe.c"])
def test_a_name_that_c_cannot_have(tmp_path, compass, name):
    with pytest.raises(InputError, match=r"needs a file such as gait\.c"):
        write_c(compass, passive(compass), {}, tmp_path / name)


def test_a_law_of_another_robot(tmp_path, compass, wheel):
    with pytest.raises(InputError, match="does not belong"):
        write_c(compass, passive(wheel), {}, tmp_path / "gait.c")
