"""Slip caused by a jump of the law's torque: its time is fixed, so it has no saltation."""

import math

import casadi as ca
import numpy as np
import pytest

from gaitopt import Law, compass_biped
from gaitopt.control.signature import torque_function
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.scipy_engine import ScipyEngine
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section


def test_derivative_across_a_jump_of_torque():
    robot = compass_biped()
    data = ca.SX.sym("d", 1)
    torque = torque_function(robot, data, lambda clock, q, v: ca.vertcat(0, data))
    law = Law("hip step", torque, np.array([0.0, 0.1, 0.12]), np.array([[0.0, -25.0, 0.0]]))
    p = robot.vector(robot.resolve({"slope": math.radians(1), "friction": 0.15}))
    walker, section = Walker(robot, law, p, ScipyEngine()), Section(robot, p, sliding=True)
    returning, z = ReturnMap(walker, section), np.array([-0.147836890, 0.732796791, -0.500667882, 0.0])
    passage = returning(z)
    modes = [mode.value for mode in passage.walk_steps[0].modes]
    assert any("slip" in mode for mode in modes[1:]), modes  # the jump made it slip
    exact, step = returning.derivative(z, passage)[:, :3], 1e-6
    columns = [(returning(z + step * e).end - returning(z - step * e).end) / (2 * step) for e in np.eye(4)[:3]]
    assert pytest.approx(exact, abs=1e-5 * np.max(np.abs(exact))) == np.array(columns).T
