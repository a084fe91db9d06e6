"""Contact modes and impacts of a planar robot in a state: the rows of its contacts, and the choice of modes."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from gaitopt.arguments import make_record
from gaitopt.model.contacts.closed_contact import ClosedContact
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.mode_selection import ModeChoice, select_modes
from gaitopt.model.contacts.multicontact_impact import ImpactOutcome, solve_multicontact_impact
from gaitopt.model.contacts.slip_well_posedness import is_well_posed
from gaitopt.model.fast_call import FastCall
from gaitopt.model.planar.phase_system import Footing
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array

AT_REST = 1e-10
"""Slip speeds below this value [m/s] count as rest after an event."""
JAM_MARGIN = 1e-6
"""Sliding ends where its determinant relative to that without friction is smaller: the forces become unbounded."""


class ContactKinematics(NamedTuple):
    """Gaps, slide coordinates and their derivatives in a state, one row per contact.

    Attributes
    ----------
    gap, slide : (n_c,) arrays
    normal, tangent : (n_c, n_q) arrays
    normal_bias, tangent_bias : (n_c,) arrays
    normal_speed, slip_speed : (n_c,) arrays
    """

    gap: Array
    slide: Array
    normal: Array
    tangent: Array
    normal_bias: Array
    tangent_bias: Array
    normal_speed: Array
    slip_speed: Array


class ContactResolution:
    """Chooses the modes and solves the impacts of a planar robot with given parameters.

    Parameters
    ----------
    robot : PlanarRobot
    p : (n_p,) array
        Parameters and switches.
    footing : Footing, optional
        The terrain under the contacts; by default a plane.
    """

    def __init__(self, robot: PlanarRobot, p: Array, footing: Footing | None = None) -> None:
        self.robot, self._footing = robot, footing
        self.friction = _find_friction(robot, p, footing)
        self._rims = None if footing is None else FastCall(robot.rims, p)
        self._gaps, self._rows, self._dynamics = (
            FastCall(function, p) for function in (robot.gaps, robot.rows, robot.dynamics)
        )
        self._arming = FastCall(robot.arming, p)

    def kinematics(self, q: Array, v: Array) -> ContactKinematics:
        """Return gaps, slide coordinates and their derivatives."""
        n = self.robot.n_q
        gap, slide = (part.copy() for part in self._gaps(q))
        if self._footing is not None:
            gap -= self._heights(q, self._footing)
        normal, tangent, normal_bias, tangent_bias = (part.copy() for part in self._rows(q, v))
        normal, tangent = normal.reshape(n, -1).T, tangent.reshape(n, -1).T
        return ContactKinematics(gap, slide, normal, tangent, normal_bias, tangent_bias, normal @ v, tangent @ v)

    def locate(self, q: Array) -> tuple[Array, Array]:
        """Return place along the ground, nan for a stop, and height above the plane of each contact [m]."""
        gap = self._gaps(q)[0].copy()
        places = np.full(gap.size, np.nan) if self._rims is None else self._rims(q)[0].reshape(-1, 4)[:, 0].copy()
        return places, gap

    def _heights(self, q: Array, footing: Footing) -> Array:
        """Return the height of the ground under each contact, shape (n_c,) [m]."""
        places = self.locate(q)[0].tolist()
        pieces = [footing.piece(i) for i in range(len(places))]
        under = [0.0 if np.isnan(place) else footing.terrain.height(place) for place in places]
        return np.array(
            [height if piece is None else piece.height for height, piece in zip(under, pieces, strict=True)]
        )

    def closing(self, q: Array, v: Array, open_contacts: Iterable[int], tolerance: float) -> list[int]:
        """Return the open contacts that touch and approach."""
        kinematics, armed = self.kinematics(q, v), self._arming(q, v)[0]
        return [
            i
            for i in open_contacts
            if abs(kinematics.gap[i]) <= tolerance and kinematics.normal_speed[i] < -tolerance and armed[i] > 0
        ]

    def close_gaps(self, q: Array, v: Array, tolerance: float) -> Array:
        """Return the nearest coordinates at which gaps below a tolerance are zero."""
        for _ in range(2):
            parts = self.kinematics(q, v)
            small = np.abs(parts.gap) <= tolerance
            q = q - np.linalg.lstsq(parts.normal[small], parts.gap[small], rcond=1e-9)[0] if small.any() else q
        return q

    def impact(self, q: Array, v: Array, contacts: Iterable[int], latched: frozenset[int]) -> ImpactOutcome:
        """Return the outcome of the impact of closed and closing contacts."""
        mass_matrix = self._mass_matrix(q, v)
        return solve_multicontact_impact(mass_matrix, v, self._rows_of(q, v, contacts, latched), self.friction)

    def velocity_jump(self, q: Array, v: Array, impulse: Array) -> Array:
        """Return the velocity jump by impulses of the actuators without reactions of the contacts, shape (n_q,)."""
        n = self.robot.n_q
        mass_matrix, _, actuation = self._dynamics(q, v)
        return np.asarray(np.linalg.solve(mass_matrix.reshape(n, n), actuation.reshape(-1, n).T @ impulse), dtype=float)

    def modes(
        self, q: Array, v: Array, u: Array, contacts: Iterable[int], latched: frozenset[int], ended: Mapping[str, Mode]
    ) -> ModeChoice:
        """Return the choice of the modes of closed contacts under a torque."""
        n = self.robot.n_q
        mass_matrix = self._mass_matrix(q, v)
        _, bias, actuation = self._dynamics(q, v)
        force = bias - actuation.reshape(-1, n).T @ u
        return select_modes(mass_matrix, force, self._rows_of(q, v, contacts, latched), self.friction, ended)

    def is_well_posed(self, q: Array, v: Array, contacts: list[int], modes: Mapping[str, Mode]) -> bool:
        """Return whether the forces of closed contacts in given modes are determined."""
        latched = frozenset(i for i in contacts if modes[self.robot.contact_names[i]] is Mode.LATCHED)
        rows = self._rows_of(q, v, contacts, latched)
        return is_well_posed(self._mass_matrix(q, v), rows, self.friction, modes, margin=JAM_MARGIN)

    def stop_motion(self, q: Array, v: Array, contacts: list[int], sticking: list[int]) -> Array:
        """Return the nearest velocity with which contacts do not separate and some of them do not slip.

        The distance is measured by the mass matrix.
        """
        parts = self.kinematics(q, v)
        rows = np.vstack([parts.normal[contacts], parts.tangent[sticking]])
        spread = np.linalg.solve(self._mass_matrix(q, v), rows.T)
        return v - spread @ np.linalg.lstsq(rows @ spread, rows @ v, rcond=1e-12)[0]

    def _mass_matrix(self, q: Array, v: Array) -> Array:
        n = self.robot.n_q
        return np.array(self._dynamics(q, v)[0].reshape(n, n))

    def _rows_of(self, q: Array, v: Array, contacts: Iterable[int], latched: frozenset[int]) -> list[ClosedContact]:
        """Return the rows of closed contacts."""
        parts, robot, rows = self.kinematics(q, v), self.robot, []
        bodies = [robot.contacts[i].body for i in contacts]
        for i in contacts:
            contact = robot.contacts[i]
            speed, infinite = float(parts.slip_speed[i]), np.isinf(self.friction[contact.name][1])
            rows.append(
                make_record(
                    ClosedContact,
                    contact.name,
                    parts.normal[i],
                    float(parts.normal_bias[i]),
                    parts.tangent[i] if contact.slides else None,
                    float(parts.tangent_bias[i]),
                    0.0 if infinite or abs(speed) <= AT_REST else speed,
                    group=contact.body if contact.slides and bodies.count(contact.body) > 1 else None,
                    latched=i in latched,
                    gap=float(parts.gap[i]),
                )
            )
        return rows


def _find_friction(robot: PlanarRobot, p: Array, footing: Footing | None) -> dict[str, tuple[float, float]]:
    """Return static and kinetic friction of each contact."""
    kinetic, ratio = float(p[robot.index("friction")]), float(p[robot.index("static_friction_ratio")])
    under = [kinetic if footing is None else footing.friction(i, kinetic) for i in range(len(robot.contacts))]
    return {name: (ratio * value, value) for name, value in zip(robot.contact_names, under, strict=True)}
