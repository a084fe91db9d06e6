"""Impacts with several closed contacts: compass, rimless wheel, block, push-off, joint stops.

The numbers of the compass were computed by enumeration and by a second method before this code was written.
"""

from collections import Counter

import numpy as np
import pytest

from gaitopt import InputError, Mode
from gaitopt.model import ClosedContact, Determinacy, PlasticFrictional, solve_multicontact_impact
from tests.model.contact_models import HipCompass, box_corners, spelling, wheel_contacts

COMPASS = HipCompass()


def land(th, rate, mu):
    """Return the outcome of the compass landing on B while A stands still."""
    q, v = COMPASS.landing(th, rate)
    return solve_multicontact_impact(COMPASS.mass_matrix(q), v, COMPASS.contacts(q, v), (mu, mu))


def test_the_compass_lands_and_its_trailing_foot_leaves():
    outcome = land(0.15, 0.1, 0.14)
    assert (outcome.status, spelling(outcome.modes)) == (Determinacy.UNIQUE, "0+")
    assert outcome.impulse["A"] == (0, 0)
    assert outcome.impulse["B"] == pytest.approx((-0.249931040758, 1.785221719703), abs=1e-12)
    assert outcome.energy_lost == pytest.approx(0.638584550216, abs=1e-12)
    expected = [1.449474427638, -0.057929599128, -0.802319104207, 0.242280861356]
    np.testing.assert_allclose(outcome.velocity_plus, expected, atol=1e-12)


def test_the_compass_lands_and_both_feet_slip():
    outcome = land(0.5, 0.5, 0.3)
    assert (outcome.status, spelling(outcome.modes)) == (Determinacy.UNIQUE, "++")
    assert outcome.impulse["A"] == pytest.approx((-0.068433127303, 0.228110424342), abs=1e-12)
    assert outcome.impulse["B"] == pytest.approx((-0.422289898954, 1.407632996512), abs=1e-12)
    assert outcome.energy_lost == pytest.approx(1.214225267088, abs=1e-12)


def test_the_outcomes_of_the_compass_over_angle_and_rate():
    counts = Counter()
    for th in np.linspace(0.05, 0.7, 27):
        for rate in np.linspace(-4, 4, 81):
            q, v = COMPASS.landing(th, rate)
            if COMPASS.contacts(q, v)[1].normal_row @ v < -1e-9:
                outcome = land(th, rate, 0.14)
                assert outcome.status is Determinacy.UNIQUE
                assert outcome.energy_lost >= 0
                counts[spelling(outcome.modes)] += 1
    assert counts == {
        **{"0-": 137, "0S": 65, "0+": 222, "+-": 90, "+S": 135},
        **{"++": 344, "SS": 20, "S+": 133, "-S": 6, "-+": 198},
    }


@pytest.mark.parametrize("rate", [-1.8, -1.0, 0.1, 0.4, 0.8])
def test_the_trailing_foot_stays_beyond_one_angle_if_the_front_foot_slips_forward(rate):
    """At mu 0.14 the angle is 0.278812391353 for all rates with this outcome."""
    below, above = (spelling(land(0.278812391353 + shift, rate, 0.14).modes) for shift in (-2e-12, 2e-12))
    assert below == "0+"
    assert above[1] == "+"
    assert above[0] != "0"


@pytest.mark.parametrize("kappa", [0.05, 0.1, 1 / 3, 1.0])
@pytest.mark.parametrize("n", [3, 4, 6, 10])
@pytest.mark.parametrize("mu", [0.05, 0.3, 0.61, 1.2, 3.0])
def test_the_wheel_with_two_contacts_follows_its_closed_form(n, kappa, mu):
    """Unit mass and radius, rotation at rate w about the rear spoke: four regimes."""
    a, w = np.pi / n, 1.7
    c, s = np.cos(a), np.sin(a)
    outcome = solve_multicontact_impact(np.diag([1, 1, kappa]), w * np.array([c, -s, 1]), wheel_contacts(a), (mu, mu))
    sigma, lift = np.sin(2 * a) / (2 * (kappa + c * c)), s * (s - mu * c)
    beta = (np.cos(2 * a) + kappa) / (1 + kappa)
    modes, velocity = (outcome.modes["rear"].value, outcome.modes["front"].value), outcome.velocity_plus
    if mu >= sigma and beta > 0:
        assert modes == ("free", "stick")
        assert velocity[2] == pytest.approx(beta * w, rel=1e-12)
    elif mu < sigma and lift < kappa:
        assert modes == ("free", "slip+")
        assert velocity[2] == pytest.approx(w * (kappa - lift) / (kappa + lift), rel=1e-12)
    elif mu < c / s:
        assert modes == ("slip+", "slip+")
        np.testing.assert_allclose(velocity, [w * (c - mu * s), 0, 0], atol=1e-13)
    else:
        assert modes == ("stick", "stick")
        np.testing.assert_allclose(velocity, 0, atol=1e-13)


def test_the_rocking_block_keeps_its_share_of_the_rate():
    """Rate ratio 1 - 1.5 sin^2(atan(b/h)) if it sticks: 0.85 for b/h = 1/3 (Housner 1963)."""
    b, h, rate = 0.1, 0.3, 0.4  # counter-clockwise, about the front corner at (b, -h)
    mass = np.diag([1, 1, (b * b + h * h) / 3])
    before = rate * np.array([-h, -b, 1])
    rear, front = box_corners(b, h)
    assert (front.normal_row @ before, front.tangent_row @ before) == pytest.approx((0, 0), abs=1e-15)
    outcome = solve_multicontact_impact(mass, before, [rear, front], (2, 2))
    assert (outcome.modes["rear"], outcome.modes["front"]) == (Mode.STICK, Mode.FREE)
    assert outcome.velocity_plus[2] / rate == pytest.approx(0.85, rel=1e-13)


def test_a_push_off_saves_most_of_the_collision():
    """Kuo (2002): point mass on massless legs, P = v tan(al) along the trailing leg restores the speed."""
    v, al = 1.3, 0.2
    trailing, leading = (np.array([-sign * np.sin(al), np.cos(al)]) for sign in (-1, 1))
    leg = ClosedContact("leading leg", leading)
    start = v * np.array([np.cos(al), -np.sin(al)])
    assert trailing @ start == pytest.approx(0, abs=1e-15)
    passive = solve_multicontact_impact(np.eye(2), start, [leg], {})
    pushed = solve_multicontact_impact(np.eye(2), start + v * np.tan(al) * trailing, [leg], {})
    assert pushed.modes["leading leg"] is Mode.CLOSED
    assert np.linalg.norm(pushed.velocity_plus) == pytest.approx(v, rel=1e-13)
    assert passive.energy_lost / pushed.energy_lost == pytest.approx(4 * np.cos(al) ** 4, rel=1e-12)


def test_a_latched_stop_pulls_and_a_closed_one_lets_go():
    """Two unit masses on a line; the joint between them is at its limit and the first one is pulled back."""
    before, limit, wall = np.array([-1.0, 0.0]), np.array([-1.0, 1.0]), np.array([1.0, 0.0])
    for latched, velocity in ((False, [0, 0]), (True, [0, 0])):
        contacts = [ClosedContact("knee", limit, latched=latched), ClosedContact("wall", wall)]
        outcome = solve_multicontact_impact(np.eye(2), before, contacts, {})
        np.testing.assert_allclose(outcome.velocity_plus, velocity, atol=1e-15)
    apart = np.array([-1.0, 1.0])
    free = solve_multicontact_impact(np.eye(2), apart, [ClosedContact("knee", limit)], {})
    latched = solve_multicontact_impact(np.eye(2), apart, [ClosedContact("knee", limit, latched=True)], {})
    assert (free.modes["knee"], free.impulse["knee"]) == (Mode.FREE, (0, 0))
    assert latched.modes["knee"] is Mode.LATCHED
    assert latched.impulse["knee"] == pytest.approx((0, -1))
    np.testing.assert_allclose(latched.velocity_plus, 0, atol=1e-15)


def test_one_contact_agrees_with_the_law_of_the_landing_foot(rng):
    modes = Counter()
    for _ in range(500):
        factor, normal, tangent = rng.normal(size=(3, 3)), *rng.normal(size=(2, 3))
        mass, before, mu = factor @ factor.T + np.eye(3), rng.normal(size=3), rng.uniform(0, 0.8)
        rows = np.array([tangent, normal])
        mobility = rows @ np.linalg.solve(mass, rows.T)
        if mobility[1, 1] <= mu * abs(mobility[0, 1]):
            continue
        before = before - 2 * max(normal @ before, 0) * normal / (normal @ normal)  # approaching
        outcome = solve_multicontact_impact(
            mass, before, [ClosedContact("foot", normal, tangent_row=tangent)], (mu, mu)
        )
        ((mode, impulse),) = PlasticFrictional().outcomes(tuple((rows @ before).tolist()), mobility.tolist(), mu)
        assert (outcome.status, outcome.modes["foot"]) == (Determinacy.UNIQUE, mode)
        assert outcome.impulse["foot"] == pytest.approx(impulse, rel=1e-9, abs=1e-12)
        modes[mode] += 1
    assert min(modes[mode] for mode in (Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD)) > 20


@pytest.mark.parametrize("others", [[], [ClosedContact("stop", np.array([0.0, 0.0, 1.0]))]])
def test_an_impact_uses_kinetic_friction(others):
    foot = ClosedContact("foot", np.array([0.0, 1.0, 0.0]), tangent_row=np.array([1.0, 0.0, 0.0]))
    outcome = solve_multicontact_impact(np.eye(3), np.array([0.4, -1, -1]), [foot, *others], {"foot": (0.5, 0.3)})
    assert outcome.modes["foot"] is Mode.SLIP_FORWARD
    assert outcome.impulse["foot"] == pytest.approx((-0.3, 1.0))


def test_ties_are_one_outcome():
    """A foot that touches the ground without speed: free and every closed mode have the same velocity."""
    foot = ClosedContact("foot", np.array([0.0, 1.0]), tangent_row=np.array([1.0, 0.0]))
    outcome = solve_multicontact_impact(np.eye(2), np.zeros(2), [foot], (0.5, 0.5))
    assert outcome.status is Determinacy.UNIQUE
    assert len(outcome.candidates[0].tied) == 4
    assert outcome.modes["foot"] is Mode.STICK
    assert outcome.energy_lost == 0


def test_a_contact_above_the_ground_is_rejected():
    with pytest.raises(InputError, match=r"'B' is not closed: its gap must be at most 1e-06 m, got 0.01 m"):
        ClosedContact("B", np.array([0.0, 1.0]), gap=0.01)
