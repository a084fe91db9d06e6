"""Impact laws: the relation between the impulse at the landing contact and the velocity after the impact.

A law is defined once and used four times: the simulator enumerates the consistent outcomes, the optimiser imposes the
rows of a known outcome or the complementarity pairs of an open one, and the linearisation uses the impulse of an
outcome as an expression of the state.
"""

import math
from abc import ABC, abstractmethod
from typing import Any

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.mode import Mode

ROUNDING = 1e-12
_STICK, _SLIPS = Mode.STICK, ((Mode.SLIP_FORWARD, 1), (Mode.SLIP_BACKWARD, -1))

Pair2 = tuple[float, float]


class ImpactLaw(ABC):
    """A plastic impact at one contact, v_n+ = 0, with the outcomes stick, slip+ and slip-."""

    @abstractmethod
    def outcomes(self, velocity: Pair2, mobility: tuple[Pair2, Pair2], friction: float) -> list[tuple[Mode, Pair2]]:
        """Return every consistent outcome with its impulse (Lambda_t, Lambda_n) [N s].

        Parameters
        ----------
        velocity : (v_t, v_n) [m/s]
            Velocity of the landing contact before the impact.
        mobility : ((tt, tn), (tn, nn)) [1/kg]
            Contact velocity per unit impulse.
        friction : float
        """

    @abstractmethod
    def impulse(self, outcome: Mode, velocity: ca.SX, mobility: ca.SX, friction: ca.SX) -> ca.SX:
        """Return the impulse (Lambda_t, Lambda_n) of an outcome, shape (2, 1) [N s], as an expression."""

    @abstractmethod
    def excess(self, impulse: Any, friction: Any, outcome: Mode, margin: Any) -> Any:
        """Return the friction condition of an outcome on the impulse: = 0 for a slip, >= 0 (two entries) for a stick.

        Parameters
        ----------
        impulse : SX or array, shape (2,)
            (Lambda_t, Lambda_n) [N s].
        friction : SX or float
        outcome : Mode
        margin : SX or float
            Fraction of the cone excluded for a sticking impulse.
        """

    @abstractmethod
    def pairs(
        self, impulse: tuple[Any, Any, Any], slip_speed: Any, velocity: tuple[Any, Any], friction: Any
    ) -> tuple[list[Any], list[Any]]:
        """Return the two sides of the complementarity pairs of an open outcome, for symbols or numbers.

        Parameters
        ----------
        impulse : (Lambda_n, a, b)
            Normal impulse and both parts of Lambda_t = a - b [N s].
        slip_speed : scalar
            Slip speed c [m/s].
        velocity : (v_n, v_t)
            Velocity of the landing contact after the impact [m/s].
        friction : scalar

        Returns
        -------
        left, right : list of 4
            All >= 0 and ``left[i] * right[i] == 0`` at a solution.
        """


@check_arguments
@dataclass(frozen=True)
class PlasticFrictional(ImpactLaw):
    """Rigid, plastic impact with Coulomb friction.

    With the impulse (Lambda_t, Lambda_n) at the landing contact,

        0 <= Lambda_n  _|_  v_n+ >= 0
        Lambda_t = a - b
        0 <= a  _|_  c + v_t+ >= 0
        0 <= b  _|_  c - v_t+ >= 0
        0 <= c  _|_  mu Lambda_n - a - b >= 0

    (c is the slip speed).  In the plane the outcome is stick, slip+ or slip-, found exactly by enumeration.

    Examples
    --------
    A point mass of 1 kg in an oblique impact sticks for friction 0.5 and slips for friction 0.1:

    >>> unit = ((1.0, 0.0), (0.0, 1.0))
    >>> [PlasticFrictional().outcomes((0.4, -1.0), unit, mu)[0][0].value for mu in (0.5, 0.1)]
    ['stick', 'slip+']
    """

    def outcomes(self, velocity: Pair2, mobility: tuple[Pair2, Pair2], friction: float) -> list[tuple[Mode, Pair2]]:
        """Return every consistent outcome with its impulse; at most one where nn > mu abs(tn)."""
        ((tt, tn), (_, nn)), (v_t, v_n) = mobility, velocity
        consistent: list[tuple[Mode, Pair2]] = []
        determinant = tt * nn - tn * tn
        l_t, l_n = (tn * v_n - nn * v_t) / determinant, (tn * v_t - tt * v_n) / determinant
        if l_n >= 0 and abs(l_t) <= friction * l_n:
            consistent.append((_STICK, (l_t, l_n)))
            if nn > friction * abs(tn):  # at most one outcome is consistent
                return consistent
        if math.isinf(friction):
            return consistent
        for mode, sign in _SLIPS:
            slide = -sign * friction
            response = nn + tn * slide
            if response <= 0:
                continue
            normal = -v_n / response
            if normal >= 0 and sign * (v_t + (tt * slide + tn) * normal) > 0:
                consistent.append((mode, (slide * normal, normal)))
        # Exactly on the edge of the cone, rounding may exclude both the stick and the slip that coincide there.
        if not consistent and v_n < 0 and abs(l_t) - friction * l_n <= ROUNDING * math.hypot(l_t, l_n):
            consistent.append((_STICK, (l_t, l_n)))
        return consistent

    def impulse(self, outcome: Mode, velocity: ca.SX, mobility: ca.SX, friction: ca.SX) -> ca.SX:
        """Return the impulse that stops the contact, or that of a slip with Lambda_t on the edge of the cone."""
        if outcome is Mode.STICK:
            return -ca.solve(mobility, velocity)
        direction = ca.vertcat(-outcome.sign * friction, 1)
        return direction * (-velocity[1] / (mobility[1, :] @ direction))

    def excess(self, impulse: Any, friction: Any, outcome: Mode, margin: Any) -> Any:
        """Return the last complementarity pair for a known outcome, divided by mu so that mu may be infinite."""
        tangential, normal = impulse[0], impulse[1]
        if outcome.slips:
            return outcome.sign * tangential / friction + normal
        scaled = tangential / ((1 - margin) * friction)
        return ca.vertcat(normal - scaled, normal + scaled)

    def pairs(
        self, impulse: tuple[Any, Any, Any], slip_speed: Any, velocity: tuple[Any, Any], friction: Any
    ) -> tuple[list[Any], list[Any]]:
        """Return the four pairs of the law.

        Examples
        --------
        >>> left, right = PlasticFrictional().pairs((2.0, 0.0, 0.2), 0.5, (0.0, 0.5), 0.1)
        >>> [a * b for a, b in zip(left, right)]
        [0.0, 0.0, 0.0, 0.0]
        """
        (normal, forward, backward), (v_normal, v_tangent) = impulse, velocity
        left = [normal, forward, backward, slip_speed]
        right = [v_normal, slip_speed + v_tangent, slip_speed - v_tangent, friction * normal - forward - backward]
        return left, right
