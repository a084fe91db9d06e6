"""Motions made by hand, so that what should come out is known."""

import numpy as np
import pytest

from gaitopt import Mode, Motion
from gaitopt.motion import Jump, Segment


def make_segment(time, *, mode=Mode.STICK, step=0, power=None, work=None, **changes):
    """Return a segment of a robot with two actuators in which everything not given is zero."""
    count = time.size
    fields = {
        "mode": mode,
        "step": step,
        "time": time,
        "q": np.zeros((4, count)),
        "v": np.zeros((4, count)),
        "torque": np.zeros((2, count)),
        "force": np.vstack([np.zeros(count), np.ones(count)]),
        "power": np.zeros((2, count)) if power is None else power,
        "work": np.zeros((2, count)) if work is None else work,
        "friction_work": np.zeros(count),
        "kinetic": np.zeros(count),
        "potential": np.zeros(count),
        "points": np.zeros((2, 3, count)),
    }
    return Segment(**{**fields, **changes})


def make_jump(time, *, step=0, mode=Mode.STICK, energy_lost=0.0, **changes):
    fields = {
        "impulse": np.array([-1.0, 4.0]),
        "q": np.zeros(4),
        "v_minus": np.zeros(4),
        "v_plus": np.zeros(4),
        "q_next": np.zeros(4),
        "v_next": np.zeros(4),
        "separation": 0.1,
    }
    return Jump(step=step, time=time, mode=mode, energy_lost=energy_lost, **{**fields, **changes})


def make_motion(segments, jumps=(), **parameters):
    return Motion(
        angles=("th1", "th2"),
        actuators=("ankle", "hip"),
        points=("a", "b", "c"),
        links=((0, 1), (1, 2)),
        total_mass=2.0,
        parameters={"gravity": 10.0, "slope": 0.0, "friction": 0.5, **parameters},
        segments=tuple(segments),
        jumps=tuple(jumps),
    )


@pytest.fixture
def segment():
    return make_segment


@pytest.fixture
def jump():
    return make_jump


@pytest.fixture
def motion():
    return make_motion
