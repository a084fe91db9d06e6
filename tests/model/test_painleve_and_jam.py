"""Sliding is well posed: Painleve's rod, the sleeve on a column, and the reaction of the mode choice to both."""

import numpy as np
import pytest

from gaitopt import InputError, Mode
from gaitopt.model import ClosedContact, is_well_posed, select_modes


def rod(theta, slip_speed=0.0):
    """Return the lower end of a uniform rod of half-length 1 at an angle from the ground, its centre to the right."""
    c, s = np.cos(theta), np.sin(theta)
    return ClosedContact("tip", np.array([0, 1, -c]), tangent_row=np.array([1, 0, s]), slip_speed=slip_speed)


ROD = np.diag([1, 1, 1 / 3])


@pytest.mark.parametrize("theta", np.linspace(0.1, 1.5, 8))
@pytest.mark.parametrize("mu", [0.5, 1.3, 1.4, 2.5])
@pytest.mark.parametrize("mode", [Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD])
def test_the_rod_is_well_posed_by_its_closed_form(theta, mu, mode):
    """A = 1 + 3 cos^2 + 3 s mu sin cos > 0; least mu 4/3 at tan(theta) = 2."""
    closed_form = 1 + 3 * np.cos(theta) ** 2 + 3 * mode.sign * mu * np.sin(theta) * np.cos(theta)
    assert is_well_posed(ROD, [rod(theta)], (mu, mu), {"tip": mode}) == (closed_form > 0)


def test_the_least_friction_of_painleves_rod_is_four_thirds():
    theta = np.arctan(2)
    for mu, posed in ((4 / 3 - 1e-12, True), (4 / 3 + 1e-12, False)):
        assert is_well_posed(ROD, [rod(theta)], (mu, mu), {"tip": Mode.SLIP_BACKWARD}) is posed
    others = np.linspace(0.01, 1.56, 500)
    assert all(is_well_posed(ROD, [rod(t)], (1.333, 1.333), {"tip": Mode.SLIP_BACKWARD}) for t in others)


def test_a_margin_ends_sliding_before_the_forces_are_unbounded():
    """Relative to its value 1 + 3 cos^2 without friction, A is 1 - mu / (4/3) at tan(theta) = 2."""
    tip = rod(np.arctan(2))
    for excess, posed in ((0.9e-6, False), (1.1e-6, True)):
        mu = 4 / 3 * (1 - excess)
        assert is_well_posed(ROD, [tip], (mu, mu), {"tip": Mode.SLIP_BACKWARD}, margin=1e-6) is posed


@pytest.mark.parametrize("mode", [Mode.STICK, Mode.FREE])
def test_a_tip_that_does_not_slip_is_well_posed(mode):
    assert is_well_posed(ROD, [rod(np.arctan(2))], (9, 9), {"tip": mode})


def sleeve(length, offset, slip_speed=0.0):
    """Return the two contacts of a sleeve on a thin vertical column, its mass beside the column."""
    return [
        ClosedContact(
            name,
            side * np.array([1, 0, -y]),
            tangent_row=np.array([0, 1, -offset]),
            slip_speed=slip_speed,
        )
        for name, side, y in (("top", 1, length / 2), ("bottom", -1, -length / 2))
    ]


@pytest.mark.parametrize(("length", "offset", "inertia", "mass"), [(0.4, 0.3, 0.1, 2.0), (0.1, 0.05, 0.02, 0.7)])
def test_the_sleeve_jams_from_its_length_over_twice_the_offset(length, offset, inertia, mass):
    """Sliding determinant L (L - 2 mu e) / (m I)."""
    matrix, limit = np.diag([mass, mass, inertia]), length / (2 * offset)
    for mode, jams in ((Mode.SLIP_FORWARD, True), (Mode.SLIP_BACKWARD, False)):
        for mu in (0.3 * limit, limit * (1 - 1e-9), limit * (1 + 1e-9), 2 * limit):
            contacts = sleeve(length, offset)
            normals = np.array([contact.normal_row for contact in contacts])
            directions = normals - mode.sign * mu * np.array([contact.tangent_row for contact in contacts])
            determinant = np.linalg.det(normals @ np.linalg.solve(matrix, directions.T))
            expected = length * (length - 2 * mode.sign * mu * offset) / (mass * inertia)
            assert determinant == pytest.approx(expected, rel=1e-9, abs=1e-9 * length**2 / (mass * inertia))
            posed = is_well_posed(matrix, contacts, (mu, mu), {"top": mode, "bottom": mode})
            assert posed == (not jams or mu < limit)


def test_a_sticking_contact_takes_part_with_both_rows():
    """One sticking and one slipping contact: positive determinants of both alone and of the three rows together."""
    rng, counts = np.random.default_rng(5), {True: 0, False: 0}
    for _ in range(400):
        factor, rows, mu = rng.normal(size=(4, 4)), rng.normal(size=(4, 4)), rng.uniform(0, 2)
        mass = factor @ factor.T + 0.3 * np.eye(4)
        contacts = [ClosedContact("A", rows[0], tangent_row=rows[2]), ClosedContact("B", rows[1], tangent_row=rows[3])]
        constraints, directions = rows[[0, 2, 1]], np.array([rows[0], rows[2], rows[1] - mu * rows[3]])
        matrix = constraints @ np.linalg.solve(mass, directions.T)
        expected = matrix[2, 2] > 0 and np.linalg.det(matrix) > 0
        modes = {"A": Mode.STICK, "B": Mode.SLIP_FORWARD}
        assert is_well_posed(mass, contacts, (mu, mu), modes) == expected
        without = matrix[2, 2] > 0 and np.linalg.det(matrix[np.ix_([0, 2], [0, 2])]) > 0
        counts[expected == without] += 1
    assert counts[False] > 10


@pytest.mark.parametrize("mode", [Mode.STICK, Mode.SLIP_FORWARD])
def test_three_points_of_one_body_are_no_jam(mode):
    """The normal forces are undetermined, the motion is not."""
    x = {"heel": -0.1, "middle": 0.02, "toe": 0.13}
    contacts = [
        ClosedContact(name, np.array([0, 1, x[name]]), tangent_row=np.array([1, 0, 0.3]), group="foot") for name in x
    ]
    mass, modes = np.diag([2.0, 2.0, 0.05]), dict.fromkeys(x, mode)
    assert is_well_posed(mass, contacts, (0.2, 0.2), modes)
    choice = select_modes(mass, np.array([-8.0 * mode.slips, 20.0, 0.0]), contacts, (0.2, 0.2))
    assert choice.status.value == "unique"
    assert choice.chosen == modes
    expected = [0 if mode is Mode.STICK else 2.0, 0, 0]
    np.testing.assert_allclose(choice.acceleration, expected, atol=1e-10)


def test_a_contact_without_a_mode_is_named():
    with pytest.raises(InputError, match="no entry for contact 'tip'"):
        is_well_posed(ROD, [rod(1.0)], (1, 1), {})


def test_a_well_posed_sliding_state_has_one_motion(rng):
    """The P-matrix property is uniqueness: no well-posed set of moving contacts is ambiguous or inconsistent."""
    ill = 0
    for _ in range(150):
        factor, rows = rng.normal(size=(4, 4)), rng.normal(size=(4, 4))
        speeds, mu = rng.choice([-1.0, 1.0], size=2), rng.uniform(0, 2)
        contacts = [
            ClosedContact(name, rows[i], tangent_row=rows[2 + i], slip_speed=speeds[i]) for i, name in enumerate("AB")
        ]
        mass = factor @ factor.T + 0.3 * np.eye(4)
        modes = {name: Mode.slipping(speeds[i]) for i, name in enumerate("AB")}
        posed = is_well_posed(mass, contacts, (mu, mu), modes)
        statuses = {
            select_modes(mass, force, contacts, (mu, mu)).status.value for force in 5 * rng.normal(size=(20, 4))
        }
        if posed:
            assert statuses == {"unique"}
        else:
            ill += statuses != {"unique"}
    assert ill > 10
