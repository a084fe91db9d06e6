"""Walks whose law reads the state late."""

import numpy as np
import pytest

from gaitopt import (
    InputError,
    ScipyEngine,
    by_stance_angle,
    compass_biped,
    feedforward,
    joint_pd,
    step_lqr,
)
from gaitopt.simulation import default_engine
from gaitopt.simulation.delay import READINGS, DelayedWalker
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.simulator import record_walk
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section


@pytest.fixture(scope="module")
def law(slip_gait):
    return joint_pd(compass_biped(), slip_gait.motion, stiffness=20, damping=5, torque_limit=8)


def start(gait):
    first = gait.motion.segments[0]
    return np.concatenate([first.q[:, 0], first.v[:, 0]]) + np.array([0, 0, 0, 0, 0, 0, 0.02, -0.01])


def late_walker(gait, law, delay, engine=None):
    robot, engine = compass_biped(), engine or default_engine(law)
    return DelayedWalker(robot, law, robot.vector(gait.motion.parameters), engine, delay=delay)


def ends(walker, state, steps):
    found = []
    for _ in range(steps):
        state = walker.walk_step(state).following
        found.append(state)
    return np.array(found)


def test_what_does_not_read_the_state_does_not_feel_a_delay(slip_gait):
    robot = compass_biped()
    played = feedforward(robot, slip_gait.motion)
    plain = Walker(robot, played, robot.vector(slip_gait.motion.parameters), default_engine())
    state = start(slip_gait)
    assert ends(late_walker(slip_gait, played, 0.05), state, 3) == pytest.approx(ends(plain, state, 3), abs=1e-10)


@pytest.mark.slow
def test_small_delays_shift_a_walk_in_proportion(slip_gait, law):
    """The walk without delay is the limit; a law that reads its state d late is off by O(d)."""
    robot, state = compass_biped(), start(slip_gait)
    plain = ends(Walker(robot, law, robot.vector(slip_gait.motion.parameters), default_engine(law)), state, 2)
    off = [np.max(np.abs(ends(late_walker(slip_gait, law, d), state, 2) - plain)) for d in (4e-3, 2e-3, 1e-3)]
    assert off[0] < 0.05
    assert off[0] / off[1] == pytest.approx(2, rel=0.15)
    assert off[1] / off[2] == pytest.approx(2, rel=0.1)


@pytest.mark.slow
def test_the_law_reads_states_between_one_and_a_quarter_more_delays_old(slip_gait, law):
    delay, oldest = 0.04, 0.04 * (1 + 1 / READINGS)
    motion = record_walk(late_walker(slip_gait, law, delay), start(slip_gait), 1).motion
    time = np.concatenate([segment.time for segment in motion.segments])
    q, v, torque = (motion.channel(name) for name in ("q", "v", "torque"))
    after_arrival = 1 + np.flatnonzero((time[1:-1] > oldest) & (np.diff(time)[1:] > 1e-6))
    for k in after_arrival:
        column = law.table[:, law.piece(time[k] + 1e-9)]
        read = np.flatnonzero((time < time[k] - delay + 1e-9) & (time > time[k] - oldest - 1e-9))
        demanded = [np.asarray(law.torque(time[k], q[:, j], v[:, j], [], 0, column)[0]).ravel() for j in read]
        assert min(np.max(np.abs(each - torque[:, k])) for each in demanded) < 1e-9
    assert after_arrival.size > 50


@pytest.mark.parametrize("kind", ["clock", "angle", "step"])
def test_both_engines_agree(slip_gait, law, kind):
    robot = compass_biped()
    chosen = {
        "clock": lambda: law,
        "angle": lambda: by_stance_angle(robot, slip_gait.motion, law),
        "step": lambda: step_lqr(robot, slip_gait.motion, torque_limit=8),
    }[kind]()
    walks = [
        ends(late_walker(slip_gait, chosen, 0.06, engine), start(slip_gait), 2)
        for engine in (default_engine(chosen), ScipyEngine())
    ]
    assert walks[0] == pytest.approx(walks[1], abs=1e-8)


def test_it_has_no_derivative(slip_gait, law):
    """The state of the walk is more than (q, v): nothing that differentiates steps takes the walker of one."""
    walker = late_walker(slip_gait, law, 0.01)
    section = Section(walker.robot, walker.p, sliding=True)
    with pytest.raises(InputError, match="no derivative"):
        ReturnMap(walker, section)


def test_each_walk_remembers_its_own_readings(slip_gait, law):
    state, steps = start(slip_gait), 3
    one = ends(late_walker(slip_gait, law, 0.05), state, steps)
    walkers = [late_walker(slip_gait, law, 0.05) for _ in range(2)]
    states = [state, state]
    for step in range(steps):  # two walks in turn
        states = [walker.walk_step(each).following for walker, each in zip(walkers, states, strict=True)]
        assert states[0] == pytest.approx(one[step], abs=1e-12)
        assert states[1] == pytest.approx(one[step], abs=1e-12)
