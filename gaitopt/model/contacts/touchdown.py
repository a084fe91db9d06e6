"""Touchdown: the transition that ends a step, at which the landing foot becomes the stance foot."""

from typing import ClassVar

import casadi as ca

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.event import TOUCHDOWN, HybridEvent
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.transition import Condition, ContactQuantities, NodeCondition, slip_from_rest
from gaitopt.model.coordinate_entries import GAP
from gaitopt.model.robot import Robot


@dataclass(frozen=True)
class Touchdown:
    """Guard, reset and conditions in an optimisation of the touchdown of a robot.

    Attributes
    ----------
    robot : Robot

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> Touchdown(compass_biped()).event.label
    'touchdown'
    """

    robot: Robot
    event: ClassVar[HybridEvent] = TOUCHDOWN

    def guard(self, q: ca.SX, v: ca.SX, p: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return the guard, which falls through zero at the touchdown, and the value that is positive while armed."""
        guard, _, armed = self.robot.touchdown(q, v, p)
        return guard, armed

    def reset(self, outcome: Mode, q: ca.SX, v: ca.SX, p: ca.SX) -> ca.SX:
        """Return the state (q, v) after an impact with a known outcome and the leg exchange, shape (2 n_q, 1)."""
        velocity, mobility, spread = self.robot.collision(q, v, p)
        law, friction = self.robot.contact_model.impact, p[self.robot.index("friction")]
        impulse = law.impulse(outcome, velocity, mobility, friction)
        return ca.vertcat(*self.robot.swap(q, v + spread @ impulse, p))

    def conditions(self, q: ca.SX, v_minus: ca.SX, v_plus: ca.SX, p: ca.SX) -> list[NodeCondition]:
        """Return the conditions on the last state of a step and the rates after the impact.

        The momentum balance and the friction law of the impact are those of the impact law.
        """
        guard, rate, armed = self.robot.touchdown(q, v_minus, p)
        return [
            NodeCondition(Condition.TOUCHDOWN, guard, True),
            NodeCondition(Condition.TOUCHDOWN_DIRECTION, rate, False, nonpositive=True),
            NodeCondition(Condition.TOUCHDOWN_AHEAD, armed, False),
            NodeCondition(Condition.SEPARATION, v_plus[GAP], False),
        ]

    def departure(self, outcome: Mode, following: Mode, contact: ContactQuantities) -> list[NodeCondition]:
        """Return the conditions at the start of the first phase after an impact with a known outcome."""
        return [slip_from_rest(contact)] if outcome is Mode.STICK and following.slips else []
