"""Prediction of falls backward from the motion of the centre of mass after a touchdown."""

import math

import numpy as np

from gaitopt.model.centre_of_mass import centre_of_mass
from gaitopt.model.fast_call import FastCall
from gaitopt.model.uneven_ground import is_on_uneven_ground
from gaitopt.motion.motion import Array
from gaitopt.simulation.hybrid_automaton import Walker

SMALLEST_ENERGY = 0.4
"""Kinetic energy of the centre of mass, relative to that of an inverted pendulum which just reaches the upright pose,
below which a fall is predicted.  It was at least 0.47 in 1800 completed steps of 12 walkers."""
LARGEST_INCLINATION = 1.5
"""Inclination of the line from the foot to the centre of mass, relative to the static friction, from which friction is
taken to be unable to turn the walker forward.  The centre of mass moved backward relative to the foot at inclinations
of up to 1.25 in 2400 completed steps of 12 walkers."""


class FallPrediction:
    """Prediction, without simulation, that a passive walker completes no step forward after a touchdown.

    A state is excluded if the centre of mass

    - moves backward,
    - is behind the foot and has too little energy to move over it, or
    - is so far behind the foot that no contact force turns the walker forward, and moves too slowly relative to the
      foot to come near the friction cone.

    In the last case the walker is an inverted pendulum on the foot, in gravity inclined by the friction.  Many other
    states from which a walker falls are not excluded.

    Parameters
    ----------
    walker : Walker
    """

    def __init__(self, walker: Walker) -> None:
        robot, p = walker.robot, walker.p
        self._motion, self._slip_velocity = FastCall(centre_of_mass(robot), p), robot.state_entries.slip_velocity
        self._gravity, slope = p.item(robot.index("gravity")), p.item(robot.index("slope"))
        self._sine, self._cosine = math.sin(slope), math.cos(slope)
        self._inclination = LARGEST_INCLINATION * walker.contact.friction

    def excludes(self, state: Array) -> bool:
        """Return whether no step forward is predicted from a state (q, v) after a touchdown, shape (2 n_q,)."""
        along, across, forward, upward = self._motion.evaluate_packed(state).tolist()
        if forward <= 0 or self._stays_outside_cone(along, across, forward - state.item(self._slip_velocity)):
            return True
        behind, height = -along * self._cosine - across * self._sine, across * self._cosine - along * self._sine
        if behind <= 0:
            return False
        rise = math.hypot(along, across) - height
        return (forward**2 + upward**2) / 2 < SMALLEST_ENERGY * self._gravity * rise

    def _stays_outside_cone(self, along: float, across: float, speed: float) -> bool:
        """Return whether the centre of mass at a speed relative to the foot is too slow to come near the cone."""
        angle = -along / across - self._inclination if across > 0 else 0.0
        return angle > 0 and speed < math.sqrt(self._gravity * across) * angle


def predict_falls(walker: Walker) -> FallPrediction | None:
    """Return the prediction for a passive walker with point feet and no springs on even ground, otherwise None.

    Torques and springs may lift a walker that would fall without them, and a round foot rolls.
    """
    robot = walker.robot
    pointed = not np.any(np.asarray(robot.rims(np.zeros(robot.n_q), walker.p))[2])
    passive = walker.law.is_passive and not robot.has_springs
    return FallPrediction(walker) if passive and pointed and not is_on_uneven_ground(robot) else None
