"""Random contact states, and the conditions that every solution of the contact problem satisfies."""

from dataclasses import dataclass

import numpy as np

from gaitopt.model import ClosedContact, Mode


@dataclass(frozen=True)
class ContactScene:
    """A mass matrix with closed contacts, coefficients of friction (static, kinetic) and a velocity."""

    mass: np.ndarray
    velocity: np.ndarray
    contacts: list
    friction: dict

    @property
    def members(self):
        """Numbers of the contacts of each group; a contact without a group is alone in one."""
        groups = {}
        for number, contact in enumerate(self.contacts):
            if not contact.is_stop:
                groups.setdefault(contact.group or contact.name, []).append(number)
        return list(groups.values())

    @property
    def matrix(self):
        """Normal rows, then the tangential row of each group."""
        tangents = [self.contacts[members[0]].tangent_row for members in self.members]
        return np.array([contact.normal_row for contact in self.contacts] + tangents)


def random_contacts(rng, k, *, n=None, stops=True, friction=None):
    """Return k contacts of a robot with n coordinates: feet, feet of one body, joint stops, latched ones among them."""
    n = n or int(rng.integers(k + 1, 8))
    factor = rng.normal(size=(n, n))
    names = [f"c{number}" for number in range(k)]
    contacts, group_row = [], rng.normal(size=n)
    for name in names:
        kind = rng.choice(["foot", "foot", "foot of one body", "stop", "latched"]) if stops else "foot"
        tangent = {"foot": rng.normal(size=n), "foot of one body": group_row}.get(kind)
        group = "body" if kind == "foot of one body" else None
        contacts.append(
            ClosedContact(name, rng.normal(size=n), tangent_row=tangent, group=group, latched=kind == "latched")
        )
    mu = rng.uniform(0, 1.5) * (rng.random() > 0.1) if friction is None else friction
    return ContactScene(
        factor @ factor.T + 0.1 * np.eye(n), rng.normal(size=n), contacts, dict.fromkeys(names, (float(mu), float(mu)))
    )


def require_law(scene, modes, forces, change, after):
    """Check one solution: change is the M-weighted effect of the forces, `after` maps a row to its velocity."""
    scale = 1e-8 * (1 + max(np.abs(force).max() for force in forces.values()))
    total = np.zeros(len(change))
    for contact in scene.contacts:
        (t, n), mode, mu = forces[contact.name], modes[contact.name], scene.friction[contact.name][1]
        total += contact.normal_row * n
        assert mode is Mode.LATCHED or n >= -scale
        assert after(contact.normal_row) >= -scale
        assert abs(n * after(contact.normal_row)) <= scale * scale / 1e-8
        if contact.is_stop:
            assert t == 0
            continue
        total += contact.tangent_row * t
        slide = after(contact.tangent_row)
        assert abs(t) <= mu * n + scale
        assert {Mode.STICK: abs(slide) <= scale, Mode.FREE: abs(t) <= scale}.get(mode, mode.sign * slide >= -scale)
        if mode.slips:
            assert abs(t + mode.sign * mu * n) <= scale
    np.testing.assert_allclose(total, change, atol=10 * scale, rtol=1e-8)
