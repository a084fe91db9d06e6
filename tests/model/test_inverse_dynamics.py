"""Inverse dynamics by the recursive Newton-Euler method: equal to M a + h - E u, with fewer operations."""

import casadi as ca
import numpy as np
import pytest

from gaitopt import Robot, compass_biped, rimless_wheel
from gaitopt.cli.script import load_script
from gaitopt.model.mechanics import RigidLink, derive
from gaitopt.model.robot_record import RobotRecord
from gaitopt.model.robot_serialisation import read_fields
from tests.conftest import ROOT
from tests.walkers import round_compass, torso_biped
from tests.walkers.sprung_compass import sprung_compass

ROBOTS = {
    "compass biped": compass_biped,
    "rimless wheel": rimless_wheel,
    "five links": lambda: load_script(ROOT / "problems" / "five_link.py")().robot,
    "torso": torso_biped,
    "round feet": lambda: round_compass(0.3),
    "spring, damper and rotor": lambda: sprung_compass("spring", "damper", "rotor", rest=0.1),
    "hardening spring": lambda: sprung_compass("hardening"),
}


def largest_difference(robot, rng):
    """Return the largest difference of the inverse dynamics from M a + h - E u relative to its largest term."""
    p, worst = robot.vector(robot.resolve({"slope": 0.1})), 0.0
    for _ in range(5):
        q, v, a = rng.normal(size=(3, robot.n_q))
        u = rng.normal(size=robot.n_u)
        mass, bias, actuation = (np.asarray(part) for part in robot.dynamics(q, v, p))
        terms = mass @ a, bias.ravel(), -actuation @ u
        force = np.asarray(robot.inverse_dynamics(q, v, a, u, p)).ravel()
        worst = max(worst, np.max(np.abs(force - sum(terms))) / np.max(np.abs(terms)))
    return worst


@pytest.mark.parametrize("make", ROBOTS.values(), ids=ROBOTS.keys())
def test_inverse_dynamics_agree_with_mass_matrix_and_bias(make, rng):
    assert largest_difference(make(), rng) < 1e-14


def test_a_robot_stored_without_inverse_dynamics_has_them(rng):
    """Records of older files contain mass matrix and bias only."""
    record = torso_biped().record
    content = record.content()
    del content["functions"]["inverse_dynamics"]
    del content["name"]
    older = Robot(**read_fields(RobotRecord.of("torso", content, casadi=record.casadi)))
    assert largest_difference(older, rng) < 1e-14
    assert older.inverse_dynamics.name_in() == torso_biped().inverse_dynamics.name_in()


def chain(count):
    """Return the instructions of the inverse dynamics of a planar chain of links, and of M a + h."""
    q, v, a = (ca.SX.sym(name, count) for name in "qva")
    tip, links = ca.SX.zeros(2), []
    for angle in ca.vertsplit(ca.cumsum(q)):
        half = ca.vertcat(ca.sin(angle), ca.cos(angle)) / 2
        links.append(RigidLink(1.0, tip + half, 0.1, angle))
        tip += 2 * half
    mechanics = derive(links, q, v, ca.vertcat(0, -9.81))
    recursive, explicit = mechanics.require(a), mechanics.mass_matrix @ a + mechanics.bias
    return [ca.Function("f", [q, v, a], ca.cse([form])).n_instructions() for form in (recursive, explicit)]


def test_the_operations_grow_linearly_with_the_links():
    """M a + h grows with the square (Featherstone, Rigid Body Dynamics Algorithms, Springer, 2008, section 3.2)."""
    (five, explicit), (ten, _), (twenty, squared) = chain(5), chain(10), chain(20)
    assert five < 0.6 * explicit
    assert ten < 2.2 * five
    assert twenty < 2.2 * ten
    assert twenty < 0.25 * squared
