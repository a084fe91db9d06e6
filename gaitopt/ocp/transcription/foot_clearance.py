"""How high the swing foot must be over the ground on its way from one footprint to the next."""

import math

import casadi as ca

from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.ocp.nlp.keys import Group, Key, Kind, Place, Row, Unknown
from gaitopt.ocp.nlp.layout import Index
from gaitopt.ocp.transcription.nlp_builder import BlockVariables, NlpBuilder


def bump(ahead: ca.SX, distance: ca.SX) -> ca.SX:
    """Return the share of the requested clearance if the foot is `ahead` of the stance foot [m].

    It is (1 - (ahead / distance)^2)^2: 1 beside the stance foot, and 0 with slope 0 in both footprints, `distance`
    behind and ahead of it, so that a foot that rises or comes down at any rate is high enough there.
    """
    return (1 - (ahead / distance) ** 2) ** 2


def clearance_rows(
    frame: NlpBuilder,
    local: BlockVariables,
    stance: PhaseDynamics,
    states: list[ca.SX],
    p: ca.SX,
    *,
    number: int,
    places: list[Place],
) -> tuple[ca.SX, Index]:
    """Return values that keep the swing foot high enough, and their rows.

    Parameters
    ----------
    frame : Frame
    local : BlockVariables
        Local variables of an interval, which gain the distance between the feet at touchdown.
    stance : PhaseDynamics
    states : list of SX
        At the interval's first node and at its inner points.
    p : SX
    number : int
        Of the intervals' phase, from 0.
    places : list of Place
        Keys of the first nodes of the intervals.
    """
    distance, heights = _touchdown_distance(frame, local), []
    for state in states:
        q, v = stance.full(state)
        foot = frame.robot.landing(q, v, p)[0] - q[:2]
        heights.append(foot[1] - frame.clearance() * bump(foot[0], distance))
    table = [Row(Key(Kind.CLEARANCE, inner=i), 0.0, math.inf) for i in range(len(states))]
    rows = frame.rows.add((Group.CLEARANCE, number), table, places)
    if number == 0:
        frame.rows.bound(rows[0, 0], -math.inf, math.inf)  # the step begins on the ground
    return ca.vertcat(*heights), rows


def _touchdown_distance(frame: NlpBuilder, local: BlockVariables) -> ca.SX:
    """Return how far ahead of the stance foot the other one lands: the travel less what the stance foot slides [m].

    A periodic step starts with the foot as far behind.
    """
    slides = frame.slides(local)
    return local.add("travel", frame.variables[Unknown.TRAVEL]) - sum(slides, ca.SX(0))
