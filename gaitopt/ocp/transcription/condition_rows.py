"""Constraint rows of the conditions on contacts."""

import math

import casadi as ca
import numpy as np

from gaitopt.errors import InputError
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.transition import Condition, NodeCondition, Transition
from gaitopt.model.coordinate_entries import StateEntries
from gaitopt.ocp.nlp.keys import Key, Kind, Row

KINDS = {
    Condition.NORMAL_FORCE: Kind.NORMAL_FORCE,
    Condition.FORWARD_CONE: Kind.FORWARD_CONE,
    Condition.BACKWARD_CONE: Kind.BACKWARD_CONE,
    Condition.SLIP_ONSET: Kind.SLIP_ONSET,
    Condition.REST: Kind.SLIP_DIRECTION,
    Condition.SLIP_FROM_REST: Kind.SLIP_FROM_REST,
    Condition.TOUCHDOWN: Kind.TOUCHDOWN,
    Condition.TOUCHDOWN_DIRECTION: Kind.TOUCHDOWN_DIRECTION,
    Condition.TOUCHDOWN_AHEAD: Kind.TOUCHDOWN_AHEAD,
    Condition.SEPARATION: Kind.SEPARATION,
    Condition.CUSTOM: Kind.CUSTOM,
}
"""Kinds of rows of the conditions on a contact."""


def condition_rows(conditions: list[NodeCondition], event: str = "") -> tuple[list[Row], ca.SX]:
    """Return rows and values of conditions.

    Parameters
    ----------
    conditions : list of NodeCondition
    event : str
        Label of the event, which names the rows of a custom transition.
    """
    table = []
    for one in conditions:
        key = Key(KINDS[one.condition], event if one.condition is Condition.CUSTOM else "")
        lower, upper = (-math.inf, 0.0) if one.nonpositive else (0.0, math.inf)
        table.append(Row(key, 0.0, 0.0) if one.equality else Row(key, lower, upper))
    return table, ca.vertcat(*(one.value for one in conditions))


def check_reset(transition: Transition, mode: Mode, following: Mode, entries: StateEntries) -> None:
    """Check that an NLP can place a transition between two phases, which share angles and rates at a node.

    Raises
    ------
    InputError
        If the reset changes an angle or a rate, or a slip does not start at rest after it.
    """
    size, speed = 2 * entries.n_q, entries.slip_velocity
    reset = transition.reset(speed, size)
    others = np.delete(np.arange(size), speed)
    restarts = mode.slips and following.slips and np.any(reset[speed] != 0)
    if restarts or not np.array_equal(reset[others], np.eye(size)[others]):
        raise InputError(
            f"An optimisation cannot place the transition {transition.event.label!r} from {mode.value!r} to "
            f"{following.value!r}: its reset must leave angles and rates unchanged and, between two slip phases, set "
            f"the foot speed to zero."
        )
