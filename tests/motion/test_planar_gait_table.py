"""Table of a gait of a robot with several contacts: the ratio of the impulses of its impacts."""

import dataclasses

import numpy as np
import pytest

from gaitopt import Collocation, solve
from gaitopt.motion.planar_gait_table import tabulate_planar_gait
from tests.ocp.multicontact_examples import roll_off, walk


def impacts_of(gait):
    events = [text.split("; ") for name, text in tabulate_planar_gait(gait) if name == "event"]
    return [part for parts in events for part in parts if "impulse ratio" in part]


def impulses_of(gait, members):
    """Return the sum of the impulses of some contacts, from the change of the momentum."""
    event, robot = gait.motion.events[-1], gait.robot
    p = robot.vector(gait.motion.parameters)
    mass = np.array(robot.dynamics(event.q, event.v_minus, p)[0])
    normal, tangent = (np.array(part) for part in robot.rows(event.q, event.v_minus, p)[:2])
    rows = np.vstack([tangent[members], normal[members]])
    found, *_ = np.linalg.lstsq(rows.T, mass @ (event.v_plus - event.v_minus), rcond=None)
    return found.reshape(2, -1).sum(axis=1)


def test_the_ratio_of_a_landing_foot_follows_from_the_momentum():
    gait = solve(walk("foot A stick |", transcription=Collocation(intervals=10)))
    tangential, normal = impulses_of(gait, [gait.robot.contact_index("foot B")])
    assert impacts_of(gait) == [f"foot B stick, impulse ratio {tangential / normal:+.4f}"]


def test_a_sum_of_squared_torques_and_forces_is_stated():
    gait = solve(walk("foot A stick |", transcription=Collocation(intervals=10)))
    mixed = dataclasses.replace(gait, problem=gait.problem | {"objective_unit": "N^2 m^2 s + N^2 s"})
    (text,) = (text for name, text in tabulate_planar_gait(mixed) if "adds squares of N m and of N" in text)
    assert " N^2 m^2 s + N^2 s (adds" in text
    assert not any("adds squares" in text for _, text in tabulate_planar_gait(gait))


@pytest.mark.slow
def test_heel_and_toe_of_a_foot_have_one_ratio():
    gait = solve(roll_off())
    tangential, normal = impulses_of(gait, [0, 1])
    assert impacts_of(gait) == [f"heel + toe stick, impulse ratio {tangential / normal:+.4f}"]
