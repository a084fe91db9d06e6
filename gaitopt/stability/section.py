"""Poincare sections just after touchdown: which numbers make a state, and how to go from one to the other."""

import functools
import threading
from dataclasses import dataclass

import casadi as ca
import numpy as np

from gaitopt.errors import InputError
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot
from gaitopt.model.section_coordinate import dependent_coordinate, guard_after_swap
from gaitopt.motion.motion import Array


@dataclass(frozen=True, eq=False)
class Section:
    """States after a touchdown and leg swap, both feet on the ground.

    The touchdown condition fixes the last angle it depends on, so the coordinates are the other angles, all rates, and
    the speed of the new stance foot where the impact lets it slip.

    Attributes
    ----------
    robot : Robot
    p : (n_p,) array
    sliding : bool
        Whether the foot speed is a coordinate.
    foot_speed : float [m/s]
        Speed of the foot where it is not a coordinate: 0 after a sticking impact; any value in complete slip, whose
        motion is the same at every speed.
    """

    robot: Robot
    p: Array
    sliding: bool
    foot_speed: float = 0.0

    @functools.cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates; a rate is written with the suffix ``_rate``."""
        angles = self.robot.angles
        free = (angle for angle in angles if angle != angles[dependent_coordinate(self.robot)])
        rates = (f"{angle}_rate" for angle in angles)
        return (*free, *rates, *(("foot_speed",) if self.sliding else ()))

    @functools.cached_property
    def places(self) -> list[int]:
        """Entries of the state y = (q, v) that are the coordinates, in order."""
        n = self.robot.n_q
        return [*self._free, *range(n + 2, 2 * n), *([n] if self.sliding else [])]

    @functools.cached_property
    def closing(self) -> int:
        """Entry of the state that the touchdown condition fixes."""
        return 2 + dependent_coordinate(self.robot)

    @functools.cached_property
    def _free(self) -> list[int]:
        return [entry for entry in range(2, self.robot.n_q) if entry != self.closing]

    def embed(self, z: Array) -> Array:
        """Return the state y = (q, v) of a point of the section, shape (2 n_q,).

        Raises
        ------
        InputError
            If `z` has the wrong shape or is not finite.
        """
        z = np.asarray(z, dtype=float)
        if z.shape != (len(self.names),) or not np.all(np.isfinite(z)):
            raise InputError(
                f"A point of this section has {len(self.names)} finite entries {self.names}, got {z.tolist()}."
            )
        n = self.robot.n_q
        y = np.zeros(2 * n)
        y[n] = self.foot_speed
        y[self.places] = z
        angle, _ = _closing(self.robot, self.p.tobytes(), threading.get_ident())
        y[self.closing] = angle.packed(y[self._free])[0]
        return y

    def tangent(self, z: Array) -> Array:
        """Return d embed / d z, shape (2 n_q, n_z)."""
        n, places = self.robot.n_q, self.places
        basis = np.zeros((2 * n, len(places)))
        basis[places, range(len(places))] = 1.0
        if n > 3:
            _, slope = _closing(self.robot, self.p.tobytes(), threading.get_ident())
            basis[self.closing, : n - 3] = slope.packed(self.embed(z)[self._free])
        return basis

    def project(self, y: Array) -> Array:
        """Return the coordinates of a state on the section, shape (n_z,)."""
        return np.asarray(y, dtype=float)[self.places]


@functools.lru_cache(maxsize=32)
def _angle_fixed(robot: Robot) -> ca.Function:
    """Return (other angles, p) -> the angle that the touchdown condition fixes just after the swap.

    The swap of the angles is linear; a touchdown guard that is linear too needs one Newton step, others a few.
    """
    others, p = ca.SX.sym("others", len(robot.angles) - 1), ca.SX.sym("p", len(robot.parameters))
    angle, place = ca.SX.sym("angle"), dependent_coordinate(robot)
    angles = ca.vertsplit(others)
    angles.insert(place, angle)
    condition = guard_after_swap(robot, ca.vertcat(*angles), p)
    newton = ca.Function("newton", [angle, others, p], [angle - condition / ca.jacobian(condition, angle)])
    start = others[max(place - 1, 0)] if others.numel() else ca.SX(0)
    value = ca.MX.sym("others", others.numel()), ca.MX.sym("p", p.numel())
    guess = ca.Function("start", [others], [start])(value[0])
    for _ in range(8):
        guess = newton(guess, *value)
    return ca.Function("angle_fixed", list(value), [guess]).expand()


@functools.lru_cache(maxsize=256)
def _closing(robot: Robot, p: bytes, thread: int) -> tuple[FastCall, FastCall]:
    """Return other angles -> the one fixed, and its gradient, for given parameters; each thread has its own memory."""
    function = _angle_fixed(robot)
    others, parameters = function.sx_in()
    gradient = ca.densify(ca.jacobian(function(others, parameters), others))
    slope = ca.Function("angle_fixed_slope", [others, parameters], [gradient])
    return FastCall(function, np.frombuffer(p)), FastCall(slope, np.frombuffer(p))
