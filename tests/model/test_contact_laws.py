"""Random contact states: energy, the law itself, an independent complementarity solver, and invariances."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gaitopt import Mode
from gaitopt.model import ClosedContact, Determinacy, select_modes, solve_multicontact_impact
from tests.model.random_contacts import ContactScene, random_contacts, require_law
from tests.newton_euler.lemke import solve_contacts

seeds = st.integers(0, 10**6)
every_scene = settings(max_examples=60, deadline=None)


def solve(scene):
    return solve_multicontact_impact(scene.mass, scene.velocity, scene.contacts, scene.friction)


def choose(scene, load):
    return select_modes(scene.mass, load, scene.contacts, scene.friction)


def energy(scene, velocity):
    return velocity @ scene.mass @ velocity / 2


@pytest.mark.slow
def test_energy_never_grows_in_ten_thousand_random_impacts():
    """Up to three contacts: feet, feet of one body, stops, latched stops; also more rows than coordinates."""
    rng, statuses, closed = np.random.default_rng(14), Counter(), Counter()
    for number in range(10_000):
        scene = random_contacts(rng, int(rng.integers(1, 4)), n=2 if number % 10 == 0 else None)
        outcome = solve(scene)
        statuses[outcome.status] += 1
        for candidate in outcome.candidates:
            before, after = energy(scene, scene.velocity), energy(scene, candidate.velocity_plus)
            assert after <= before * (1 + 1e-9)
            assert candidate.energy_lost >= -1e-10 * before
            assert candidate.energy_lost == pytest.approx(before - after, rel=1e-6, abs=1e-7 * before)
            closed[sum(mode is not Mode.FREE for mode in candidate.modes.values())] += 1
    assert statuses[Determinacy.INCONSISTENT] == 0
    assert min(closed[count] for count in (0, 1, 2, 3)) > 300


def test_every_outcome_satisfies_the_law():
    rng = np.random.default_rng(15)
    for _ in range(1500):
        scene = random_contacts(rng, int(rng.integers(1, 4)))
        for candidate in solve(scene).candidates:
            change = scene.mass @ (candidate.velocity_plus - scene.velocity)
            require_law(
                scene, candidate.modes, candidate.impulse, change, lambda row, c=candidate: row @ c.velocity_plus
            )
        load = 5 * rng.normal(size=len(scene.velocity))
        for candidate in choose(scene, load).candidates:
            change = scene.mass @ candidate.acceleration + load
            require_law(scene, candidate.modes, candidate.forces, change, lambda row, c=candidate: row @ c.acceleration)


@pytest.mark.parametrize("k", [1, 2, 3, 4])
def test_an_independent_complementarity_solver_agrees(k):
    """Lemke's method finds one solution; it is the one of the enumeration, or one of them if it is ambiguous."""
    rng, several = np.random.default_rng(16 + k), 0
    for _ in range(250):
        scene = random_contacts(rng, k)
        scene = replace(scene, contacts=[replace(contact, latched=False) for contact in scene.contacts])
        rows = scene.matrix
        responses = np.linalg.solve(scene.mass, rows.T)
        mu = next(iter(scene.friction.values()))[1]
        forces = solve_contacts(rows @ responses, rows @ scene.velocity, scene.members, mu, k)
        expected = scene.velocity + responses @ forces
        outcome = solve(scene)
        distances = [np.abs(candidate.velocity_plus - expected).max() for candidate in outcome.candidates]
        assert min(distances) < 1e-8 * (1 + np.abs(expected).max())
        several += outcome.status is Determinacy.AMBIGUOUS
    assert several < 50


@pytest.mark.slow
@every_scene
@given(seed=seeds, k=st.integers(1, 3), order=st.permutations(range(3)))
def test_the_order_of_the_contacts_does_not_matter(seed, k, order):
    scene = random_contacts(np.random.default_rng(seed), k)
    permuted = replace(scene, contacts=[scene.contacts[number] for number in order if number < k])
    compare(solve(scene), solve(permuted), scene.contacts, np.eye(len(scene.velocity)))


@every_scene
@given(seed=seeds, k=st.integers(1, 3), factor=st.sampled_from([1e-6, 1e-3, 7.0, 1e5]))
def test_masses_scale_impulses_only(seed, k, factor):
    scene = random_contacts(np.random.default_rng(seed), k)
    heavy = solve(replace(scene, mass=factor * scene.mass))
    compare(solve(scene), heavy, scene.contacts, np.eye(len(scene.velocity)), impulse=factor)


@every_scene
@given(seed=seeds, k=st.integers(1, 3))
def test_a_mirror_exchanges_forward_and_backward(seed, k):
    """Reversed tangents exchange slip+ and slip-."""
    scene = random_contacts(np.random.default_rng(seed), k)
    mirrored = replace(
        scene,
        contacts=[
            replace(contact, tangent_row=None if contact.is_stop else -contact.tangent_row)
            for contact in scene.contacts
        ],
    )
    compare(solve(scene), solve(mirrored), scene.contacts, np.eye(len(scene.velocity)), mirror=True)


@every_scene
@given(seed=seeds, k=st.integers(1, 3))
def test_the_choice_of_coordinates_does_not_matter(seed, k):
    """q = T z: rows W T, mass T' M T; other units of the gaps change their rows and impulses inversely."""
    rng = np.random.default_rng(seed)
    scene = random_contacts(rng, k)
    n = len(scene.velocity)
    change = rng.normal(size=(n, n)) + 3 * np.eye(n)
    contacts = [
        replace(contact, normal_row=contact.normal_row @ change)
        if contact.is_stop
        else replace(contact, normal_row=contact.normal_row @ change, tangent_row=contact.tangent_row @ change)
        for contact in scene.contacts
    ]
    other = ContactScene(
        change.T @ scene.mass @ change, np.linalg.solve(change, scene.velocity), contacts, scene.friction
    )
    compare(solve(scene), solve(other), scene.contacts, change)


def compare(one, other, contacts, change, *, impulse=1.0, mirror=False):
    """Require the same outcomes: velocities v = change v', impulses up to a factor, modes up to the mirror."""
    assert one.status is other.status
    names = [contact.name for contact in contacts]
    sign = -1 if mirror else 1
    unmatched = list(other.candidates)
    for candidate in one.candidates:
        velocities = [change @ found.velocity_plus for found in unmatched]
        size = 1 + np.abs(candidate.velocity_plus).max()
        distances = [np.abs(candidate.velocity_plus - velocity).max() for velocity in velocities]
        match = unmatched.pop(int(np.argmin(distances)))
        assert min(distances) < 1e-6 * size
        for name in names:
            (t, n), (t_other, n_other) = candidate.impulse[name], match.impulse[name]
            assert (sign * t_other, n_other) == pytest.approx((impulse * t, impulse * n), rel=1e-5, abs=1e-6 * impulse)
        if len(candidate.tied) == len(match.tied) == 1 and not mirror:
            assert candidate.modes == match.modes
        elif len(candidate.tied) == len(match.tied) == 1:
            for name in names:
                assert candidate.modes[name].sign == -match.modes[name].sign
    assert not unmatched


def test_a_mirrored_slip_has_the_opposite_sign():
    for sign, mode in ((1, Mode.SLIP_FORWARD), (-1, Mode.SLIP_BACKWARD)):
        foot = ClosedContact("foot", np.array([0.0, 1.0]), tangent_row=np.array([1.0, 0.0]))
        outcome = solve_multicontact_impact(np.eye(2), np.array([sign * 0.8, -1.0]), [foot], (0.3, 0.3))
        assert outcome.modes["foot"] is mode
        assert outcome.impulse["foot"] == pytest.approx((-sign * 0.3, 1.0))
