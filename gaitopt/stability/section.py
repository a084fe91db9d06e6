"""Poincare sections immediately after touchdown: coordinates, embedding and projection."""

import functools
import threading

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.locks import cached_property
from gaitopt.model.coordinate_entries import angle_entry
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot
from gaitopt.model.section_coordinate import dependent_angle, dependent_coordinate
from gaitopt.motion.motion import Array


@dataclass(frozen=True, eq=False)
class Section:
    """Section of states after a touchdown and leg exchange, with both feet on the ground.

    The touchdown condition determines the last angle on which it depends, so the coordinates are the other angles, all
    rates, and the speed of the new stance foot if the impact may slip.

    Attributes
    ----------
    robot : Robot
    p : (n_p,) array
    sliding : bool
        Whether the foot speed is a coordinate.
    foot_speed : float [m/s]
        Speed of the foot if it is not a coordinate: 0 after a sticking impact; any value in complete slip, which does
        not depend on this speed.
    """

    robot: Robot
    p: Array
    sliding: bool
    foot_speed: float = 0.0

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates; a rate is written with the suffix ``_rate``."""
        angles = self.robot.angles
        free = (angle for angle in angles if angle != angles[dependent_coordinate(self.robot)])
        rates = (f"{angle}_rate" for angle in angles)
        return (*free, *rates, *(("foot_speed",) if self.sliding else ()))

    @cached_property
    def places(self) -> list[int]:
        """Indices of the coordinates in the state y = (q, v), in order."""
        entries = self.robot.state_entries
        return [*self._free, *entries.rates, *([entries.slip_velocity] if self.sliding else [])]

    @cached_property
    def dependent_entry(self) -> int:
        """Index of the state that the touchdown condition determines."""
        return angle_entry(dependent_coordinate(self.robot))

    @cached_property
    def _free(self) -> list[int]:
        return [entry for entry in self.robot.state_entries.angles if entry != self.dependent_entry]

    @cached_property
    def _entries(self) -> Array:
        return np.array(self.places)

    @cached_property
    def _origin(self) -> Array:
        """State with only the speed of the foot, if this is not a coordinate."""
        origin = np.zeros(2 * self.robot.n_q)
        origin[self.robot.state_entries.slip_velocity] = self.foot_speed
        return origin

    @cached_property
    def _shape(self) -> tuple[int]:
        return (len(self.names),)

    @cached_property
    def _basis(self) -> Array:
        basis = np.zeros((2 * self.robot.n_q, len(self.places)))
        basis[self.places, range(len(self.places))] = 1.0
        return basis

    def embed(self, z: Array) -> Array:
        """Return the state y = (q, v) of a point of the section, shape (2 n_q,).

        Raises
        ------
        InputError
            If `z` has the wrong shape or is not finite.
        """
        z = np.asarray(z, dtype=float)
        if z.shape != self._shape or not np.isfinite(z).all():
            raise InputError(
                f"A point of this section must have {len(self.names)} finite entries {self.names}, got {z.tolist()}."
            )
        y = self._origin.copy()
        y[self._entries] = z
        angle, _ = _compile_dependent_angle(self.robot, threading.get_ident())
        y[self.dependent_entry] = angle.evaluate_packed(np.concatenate((z[: len(self._free)], self.p)))[0]
        return y

    def tangent(self, z: Array) -> Array:
        """Return d embed / d z, shape (2 n_q, n_z)."""
        basis, others = self._basis.copy(), len(self._free)
        if others:
            _, slope = _compile_dependent_angle(self.robot, threading.get_ident())
            angles = np.asarray(z, dtype=float)[:others]
            basis[self.dependent_entry, :others] = slope.evaluate_packed(np.concatenate((angles, self.p)))
        return basis

    def project(self, y: Array) -> Array:
        """Return the coordinates of a state on the section, shape (n_z,)."""
        return np.asarray(y, dtype=float)[self._entries]


@functools.lru_cache(maxsize=64)
def _compile_dependent_angle(robot: Robot, thread: int) -> tuple[FastCall, FastCall]:
    """Return (other angles, p) -> dependent angle, and its gradient, for one thread."""
    function = dependent_angle(robot)
    others, parameters = function.sx_in()
    gradient = ca.densify(ca.jacobian(function(others, parameters), others))
    slope = ca.Function("dependent_angle_slope", [others, parameters], [gradient])
    return FastCall(function), FastCall(slope)
