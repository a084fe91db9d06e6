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


def test_a_contact_without_a_mode_is_named():
    with pytest.raises(InputError, match="no entry for contact 'tip'"):
        is_well_posed(ROD, [rod(1.0)], (1, 1), {})


def test_a_well_posed_sliding_state_has_one_motion(rng):
    """The P-matrix property is uniqueness: no well-posed set of moving contacts is ambiguous or inconsistent."""
    ill = 0
    for _ in range(400):
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
    assert ill > 30
