"""Transitions between the modes of a contact.

Each transition defines its event, its guard, the next mode, its reset, and the conditions by which an optimisation
places it at a node.  The simulator, the linearisation and the transcription use this definition.
"""

from abc import ABC, abstractmethod
from enum import Enum
from typing import NamedTuple

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.event import LIFT_OFF, PAINLEVE, REST, EventKind, HybridEvent
from gaitopt.model.contacts.mode import Mode

PARADOX_MARGIN = 1e-6
"""Effective fraction of the mass in slip below which slip counts as ill-posed.

Near Painleve's paradox the contact force grows without bound, so the guard falls through zero slightly earlier.
"""


class Condition(Enum):
    """Meaning of a condition on a contact, the label of its row in an optimisation."""

    NORMAL_FORCE = "normal force"
    FORWARD_CONE = "forward friction cone"
    BACKWARD_CONE = "backward friction cone"
    SLIP_ONSET = "slip onset on the cone"
    REST = "rest of the contact"
    SLIP_FROM_REST = "sticking force outside the cone"
    TOUCHDOWN = "touchdown"
    TOUCHDOWN_DIRECTION = "touchdown direction"
    TOUCHDOWN_AHEAD = "touchdown ahead of the stance foot"
    SEPARATION = "separation of the trailing foot"
    CUSTOM = "custom transition"


class NodeCondition(NamedTuple):
    """A condition at the node where an optimisation places a transition.

    Attributes
    ----------
    condition : Condition
    value : SX
    equality : bool
        Whether the value must be 0; otherwise it must be at least 0.
    nonpositive : bool
        Whether the value of an inequality must be at most 0 instead.
    """

    condition: Condition
    value: ca.SX
    equality: bool
    nonpositive: bool = False


class ContactQuantities(NamedTuple):
    """Expressions in which transitions are defined.

    Attributes
    ----------
    force : SX, shape (2, 1)
        (f_t, f_n) in the present mode [N].  In the conditions of an optimisation it is divided by the weight.
    speed : SX
        Slip velocity v_t [m/s].
    static_friction : SX
        Coefficient of static friction.
    sliding_inertia : SX, shape (2, 1)
        Effective fraction of the mass in slip+ and slip-, see :attr:`gaitopt.Robot.wellposed`.
    acceleration : SX
        Rate of the slip velocity in the present mode [m/s^2].
    excess : SX
        By how much the force at rest is outside the static friction cone, per weight, in the direction of the present
        slip; defined at the first node of a slip in an optimisation.
    """

    force: ca.SX
    speed: ca.SX
    static_friction: ca.SX
    sliding_inertia: ca.SX
    acceleration: ca.SX
    excess: ca.SX = ca.SX(0)


class Transition(ABC):
    """A change of a contact's mode, or the end of the motion."""

    @property
    @abstractmethod
    def event(self) -> HybridEvent:
        """The event of the transition."""

    @abstractmethod
    def leaves(self, mode: Mode) -> bool:
        """Return whether a contact can leave this mode by the transition."""

    @abstractmethod
    def guard(self, mode: Mode, contact: ContactQuantities) -> ca.SX:
        """Return the guard, which is positive during the mode and falls through zero at the transition."""

    @abstractmethod
    def following(self, mode: Mode) -> Mode | None:
        """Return the next mode; None if the friction cone determines it, or the motion ends."""

    @abstractmethod
    def reset(self, slip_rate: int, size: int) -> np.ndarray:
        """Return the derivative of the state after with respect to the state before, shape (size, size).

        Parameters
        ----------
        slip_rate : int
            Index of the slip velocity in the state.
        size : int
            Size of the state.
        """

    @abstractmethod
    def conditions(self, mode: Mode, contact: ContactQuantities) -> list[NodeCondition]:
        """Return the conditions at a node where an optimisation places the transition, forces per weight.

        They replace the conditions on the contact along the phase that ends at this node.
        """

    def joins(self, mode: Mode, following: Mode) -> bool:
        """Return whether an optimisation can place the transition between phases in these modes."""
        return self.leaves(mode) and self.following(mode) is following

    def departure(self, following: Mode, contact: ContactQuantities) -> list[NodeCondition]:
        """Return the conditions at the first node of the next phase, in its mode; none by default."""
        return []


class _Smooth(Transition):
    """A transition at which the state is continuous."""

    def reset(self, slip_rate: int, size: int) -> np.ndarray:
        """Return the identity."""
        return np.eye(size)

    def conditions(self, mode: Mode, contact: ContactQuantities) -> list[NodeCondition]:
        """Return the condition that the guard is zero."""
        return [NodeCondition(Condition.CUSTOM, self.guard(mode, contact), True)]


@dataclass(frozen=True)
class SlipOnset(_Smooth):
    """The force at rest reaches an edge of the static friction cone.

    Attributes
    ----------
    slip : Mode
        The next mode.

    Examples
    --------
    >>> SlipOnset(Mode.SLIP_FORWARD).following(Mode.STICK).value
    'slip+'
    """

    slip: Mode

    @property
    def event(self) -> HybridEvent:
        """Onset of the slip."""
        return HybridEvent(EventKind.SLIP_ONSET, self.slip)

    def leaves(self, mode: Mode) -> bool:
        """Return whether the contact sticks."""
        return mode is Mode.STICK

    def guard(self, mode: Mode, contact: ContactQuantities) -> ca.SX:
        """Return (mu f_n + s f_t) / (1 + mu), defined for mu = 0 and mu = inf; s is the sign of the slip."""
        share = 1 / (1 + contact.static_friction)
        tangential, normal = share * contact.force[0], (1 - share) * contact.force[1]
        return normal + self.slip.sign * tangential if self.slip.sign > 0 else normal - tangential

    def following(self, mode: Mode) -> Mode:
        """Return the slip mode."""
        return self.slip

    def conditions(self, mode: Mode, contact: ContactQuantities) -> list[NodeCondition]:
        """Return the conditions that the force is on the edge of the cone, and the normal force nonnegative."""
        tangential, normal = contact.force[0], contact.force[1]
        excess = normal + self.slip.sign * tangential / contact.static_friction
        return [NodeCondition(Condition.SLIP_ONSET, excess, True), NodeCondition(Condition.NORMAL_FORCE, normal, False)]


@dataclass(frozen=True)
class ComingToRest(Transition):
    """The slip velocity reaches zero: the contact sticks, or slips in the opposite direction."""

    @property
    def event(self) -> HybridEvent:
        """Rest."""
        return REST

    def leaves(self, mode: Mode) -> bool:
        """Return whether the contact slips."""
        return mode.slips

    def guard(self, mode: Mode, contact: ContactQuantities) -> ca.SX:
        """Return the slip speed."""
        return mode.sign * contact.speed

    def following(self, mode: Mode) -> None:
        """Return None: the friction cone determines stick or reversal."""
        return

    def reset(self, slip_rate: int, size: int) -> np.ndarray:
        """Return the identity without the slip velocity, which is exactly zero after the transition."""
        matrix = np.eye(size)
        matrix[slip_rate, slip_rate] = 0.0
        return matrix

    def conditions(self, mode: Mode, contact: ContactQuantities) -> list[NodeCondition]:
        """Return the conditions that the slip velocity is zero, and the normal force nonnegative."""
        normal = contact.force[1]
        return [
            NodeCondition(Condition.REST, contact.speed, True),
            NodeCondition(Condition.NORMAL_FORCE, normal, False),
        ]

    def joins(self, mode: Mode, following: Mode) -> bool:
        """Return whether the contact sticks next, or slips in the opposite direction."""
        return mode.slips and following is not Mode.FREE and following is not mode

    def departure(self, following: Mode, contact: ContactQuantities) -> list[NodeCondition]:
        """Return the condition that a reversed slip starts from rest."""
        return [slip_from_rest(contact)] if following.slips else []


@dataclass(frozen=True)
class LiftOff(_Smooth):
    """The normal force falls through zero."""

    @property
    def event(self) -> HybridEvent:
        """Lift-off."""
        return LIFT_OFF

    def leaves(self, mode: Mode) -> bool:
        """Return whether the contact is closed."""
        return mode is not Mode.FREE

    def guard(self, mode: Mode, contact: ContactQuantities) -> ca.SX:
        """Return the normal force [N]."""
        return contact.force[1]

    def following(self, mode: Mode) -> None:
        """Return None: the motion of a model in single support ends."""
        return


@dataclass(frozen=True)
class PainleveParadox(_Smooth):
    """Slip becomes ill-posed, which ends the motion."""

    @property
    def event(self) -> HybridEvent:
        """Painleve's paradox."""
        return PAINLEVE

    def leaves(self, mode: Mode) -> bool:
        """Return whether the contact slips."""
        return mode.slips

    def guard(self, mode: Mode, contact: ContactQuantities) -> ca.SX:
        """Return the effective fraction of the mass in slip, minus a margin."""
        return contact.sliding_inertia[0 if mode.sign > 0 else 1] - PARADOX_MARGIN

    def following(self, mode: Mode) -> None:
        """Return None: the motion ends."""
        return


TRANSITIONS: tuple[Transition, ...] = (
    PainleveParadox(),
    ComingToRest(),
    LiftOff(),
    SlipOnset(Mode.SLIP_FORWARD),
    SlipOnset(Mode.SLIP_BACKWARD),
)
"""Transitions of Coulomb friction in their order of precedence if several guards fall through zero simultaneously.

Painleve's paradox comes first, because contact forces are undefined in it.
"""


def slip_from_rest(contact: ContactQuantities) -> NodeCondition:
    """Return the condition that the force at rest is outside the friction cone, so that a slip starts from rest."""
    return NodeCondition(Condition.SLIP_FROM_REST, contact.excess, False)


def saltation(reset: np.ndarray, before: np.ndarray, after: np.ndarray, time_shift: np.ndarray) -> np.ndarray:
    """Return the saltation matrix R + (R f- - f+) dt/dy of a transition, shape (n, n_y).

    Parameters
    ----------
    reset : (n, n_y) array
        Derivative R of the reset.
    before, after : (n_y,), (n,) arrays
        Flow f- before and f+ after the transition; f+ is zero at the section itself, where time is reset.
    time_shift : (n_y,) array
        Derivative of the instant of the transition with respect to the state.

    Examples
    --------
    >>> saltation(np.eye(1), np.array([2.0]), np.array([1.0]), np.array([-0.5]))
    array([[0.5]])
    """
    return reset + (reset @ before - after)[:, None] * time_shift
