"""The exact choice of the contact mode of a foot on the ground."""

import math

from gaitopt.errors import InputError
from gaitopt.model.buffered import Buffered
from gaitopt.model.modes import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.closed_loop import paradox_guard

REST = 1e-12
"""Foot speeds below this [m/s] count as rest; impacts and located events leave exact zeros."""


class ContactChoice:
    """Chooses the mode in which a foot on the ground goes on.

    A moving foot slides.  A foot at rest sticks if the sticking force lies in the friction cone; otherwise it slides
    against the excess of that force.

    Parameters
    ----------
    robot : Robot
    p : (n_p,) array
        Parameter vector.
    """

    def __init__(self, robot: Robot, p: Array) -> None:
        self._stick = Buffered(robot.acceleration[Mode.STICK], p)
        self._wellposed = Buffered(robot.wellposed, p)
        self.friction = float(p[[parameter.name for parameter in robot.parameters].index("friction")])

    def choose(self, q: Array, v: Array, torque: Array, *, leaving: Mode | None = None) -> Mode:
        """Return the mode in which the foot goes on.

        Parameters
        ----------
        q, v : (n_q,) arrays
        torque : (n_u,) array [N m]
        leaving : Mode, optional
            A slip mode that has just come to rest and so cannot be chosen again.

        Raises
        ------
        InputError
            If the foot moves despite infinite friction.
        """
        if abs(v[0]) > REST:
            return self.slide(float(v[0]))
        tangential, normal = self._stick(q, v, torque)[1].tolist()
        return self.leave_rest(tangential, normal, leaving)

    def slide(self, speed: float) -> Mode:
        """Return the mode of a foot that moves with a speed [m/s]."""
        if math.isinf(self.friction):
            raise InputError(
                "A foot with infinite friction cannot slide: its velocity (v[0], or foot_speed on the section) must be "
                f"0, got {speed:g} m/s."
            )
        return Mode.slipping(speed)

    def leave_rest(self, tangential: float, normal: float, leaving: Mode | None = None) -> Mode:
        """Return the mode in which a foot at rest goes on, given the force (f_t, f_n) [N] that keeps it there."""
        if abs(tangential) <= self.friction * normal or math.isinf(self.friction):
            return Mode.STICK
        chosen = Mode.slipping(-tangential)
        return Mode.STICK if chosen is leaving else chosen

    def wellposed(self, mode: Mode, q: Array) -> bool:
        """Return whether slip in a mode is well posed (no Painleve paradox); sticking always is."""
        return mode is Mode.STICK or paradox_guard(self._wellposed.packed(q).tolist(), mode) > 0
