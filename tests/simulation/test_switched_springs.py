"""The exchange of the legs exchanges their switched springs as well."""

import casadi as ca
import numpy as np
import pytest

from gaitopt.model import PlanarCoordinates, PointContact, PointMass, SwitchedSpring, assemble_planar
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.simulation.planar_simulation.planar_state import PlanarState
from gaitopt.simulation.planar_simulation.planar_walker import exchange_legs

MIRROR = {"a": "b", "length_a": "length_b", "foot a": "foot b"}


def sprung_biped(order):
    """A body on two telescoping legs, each with a spring of its length and one of its angle, in some order."""
    c = PlanarCoordinates(("x", "y", "a", "length_a", "b", "length_b"))
    hip = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    bodies, contacts, springs = [PointMass(10.0, hip)], {}, {}
    for leg in "ab":
        angle, length, name = c.coordinate(leg), c.coordinate(f"length_{leg}"), f"foot {leg}"
        foot = hip + length * ca.vertcat(ca.sin(angle), -ca.cos(angle))
        bodies.append(PointMass(1.0, foot))
        contacts[name] = PointContact(foot)
        springs[f"length {leg}"] = SwitchedSpring(length, 3000.0, 0.6, 0.05, contact=name)
        springs[f"angle {leg}"] = SwitchedSpring(angle, 20.0, 0.0, 0.3, contact=name)
    forces = [springs[name] for name in order]
    return assemble_planar("sprung biped", c, bodies=bodies, contacts=contacts, forces=forces, mirror=MIRROR)


@pytest.mark.parametrize(
    "order",
    [
        ("length a", "length b"),
        ("length b", "length a"),
        ("length a", "angle a", "length b", "angle b"),
        ("length a", "length b", "angle a", "angle b"),
    ],
)
def test_the_exchange_of_the_legs_changes_no_energy(order):
    robot = sprung_biped(order)
    extended = tuple(name.endswith("a") for name in order)
    modes = ContactState((("foot a", Mode.STICK), ("foot b", Mode.FREE)))
    before = PlanarState(0.0, np.array([0.1, 0.55, 0.2, 0.57, -0.3, 0.52]), np.zeros(6), modes, extended)
    after = exchange_legs(before, robot, robot.mirror)
    energies = [
        float(robot.energy(state.q, state.v, robot.vector(robot.resolve({}), state.extended))[1])
        for state in (before, after)
    ]
    assert energies[1] == pytest.approx(energies[0], rel=1e-12)
    assert after.extended == tuple(name.endswith("b") for name in order)
    assert [mode for _, mode in after.contacts.modes] == [Mode.FREE, Mode.STICK]


def test_springs_stay_as_they_are_without_an_exchange():
    robot = sprung_biped(("length a", "length b"))
    modes = ContactState((("foot a", Mode.STICK), ("foot b", Mode.FREE)))
    state = PlanarState(0.3, np.ones(6), np.zeros(6), modes, (True, False))
    assert exchange_legs(state, robot, None).extended == (True, False)
