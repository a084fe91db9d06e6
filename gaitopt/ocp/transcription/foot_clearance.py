"""Foot clearance: the least height of the swing foot over the ground between its footprints."""

import math
from typing import NamedTuple

import casadi as ca
import numpy as np

from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.model.coordinate_entries import CONTACT
from gaitopt.model.robot import Robot
from gaitopt.model.uneven_ground import (
    INCLINE,
    PASSED,
    height_of_footprints,
    is_on_uneven_ground,
    stance_rotation,
    travel_of_slides,
)
from gaitopt.ocp.nlp.keys import Group, Key, Kind, Place, Row, Unknown
from gaitopt.ocp.nlp.layout import Index
from gaitopt.ocp.transcription.nlp_builder import BlockVariables, NlpBuilder
from gaitopt.ocp.transcription.swing_terrain import DEEPEST, SLACK, SwingTerrain, height_over_terrain, smooth_step


def bump(ahead: ca.SX, distance: ca.SX) -> ca.SX:
    """Return the share of the requested clearance if the foot is `ahead` of the stance foot [m].

    It is (1 - (ahead / distance)^2)^2: 1 beside the stance foot, and 0 with slope 0 in both footprints, `distance`
    behind and ahead of it, so that the constraint does not restrict lift-off and touchdown.
    """
    return (1 - (ahead / distance) ** 2) ** 2


def clearance_rows(
    builder: NlpBuilder,
    local: BlockVariables,
    dynamics: PhaseDynamics,
    states: list[ca.SX],
    p: ca.SX,
    *,
    number: int,
    places: list[Place],
) -> tuple[ca.SX, Index]:
    """Return the clearance constraints of an interval: their values and their rows.

    Parameters
    ----------
    builder : NlpBuilder
    local : BlockVariables
        Local variables of an interval; the distance between the feet at touchdown is added to them.
    dynamics : PhaseDynamics
    states : list of SX
        States at the first node of the interval and at its inner points.
    p : SX
    number : int
        Number of the phase, from 0.
    places : list of Place
        Keys of the first nodes of the intervals.
    """
    distance, heights = _touchdown_distance(builder, local, p), []
    lower = 0.0 if builder.terrain is None else -SLACK
    stance = None if builder.terrain is None else _locate_stance_foot(builder, builder.terrain, local, number)
    for state in states:
        q, v = dynamics.full(state)
        foot = builder.robot.landing(q, v, p)[0]
        if stance is not None:
            heights.append(_height_over_terrain(builder, stance, q[CONTACT], foot, p, distance))
            continue
        foot -= _rotate_to_plane(builder.robot, q[CONTACT], p)
        lowest = builder.clearance() * bump(foot[0], distance)
        if is_on_uneven_ground(builder.robot):
            lowest += height_of_footprints(builder.robot, p, foot[0], distance)
        heights.append(foot[1] - lowest)
    table = [Row(Key(Kind.CLEARANCE, inner=i), lower, math.inf) for i in range(len(states))]
    rows = builder.rows.add((Group.CLEARANCE, number), table, places)
    if number == 0:
        builder.rows.bound(rows[0, 0], -math.inf, math.inf)  # the step begins on the ground
    return ca.vertcat(*heights), rows


class _StancePlace(NamedTuple):
    """The terrain, and as local variables the place of the stance foot at the start of a step and its earlier slide."""

    terrain: SwingTerrain
    start: ca.SX
    slid: ca.SX


def _locate_stance_foot(builder: NlpBuilder, terrain: SwingTerrain, local: BlockVariables, number: int) -> _StancePlace:
    travels = [local.add("travel before", np.array([[column]])) for column in terrain.travels]
    tables = (builder.variables.tables.get((Unknown.SLIDE, phase)) for phase in range(number))
    slides = [local.add("slide before", table[:1, [-1]]) for table in tables if table is not None]
    return _StancePlace(terrain, sum(travels, ca.SX(0)), sum(slides, ca.SX(0)))


def _height_over_terrain(
    builder: NlpBuilder, stance: _StancePlace, contact: ca.SX, foot: ca.SX, p: ca.SX, distance: ca.SX
) -> ca.SX:
    """Return the height of the swing foot over the terrain, less the requested clearance [m].

    Without a clearance, the swing foot must be above the terrain only well ahead of the stance foot: behind it, and
    where the feet pass each other, straight legs reach through the ground.
    """
    incline = p[builder.robot.index(INCLINE)]
    slid = stance_rotation(incline) @ ca.vertcat(stance.slid, 0)
    ahead, height = height_over_terrain(stance.terrain, stance.start, incline, contact, foot, slid)
    if builder.cleared:
        return height - builder.clearance() * bump(ahead, distance)
    return height + DEEPEST * (1 - smooth_step(ahead / PASSED - 1))


def _rotate_to_plane(robot: Robot, contact: ca.SX, p: ca.SX) -> ca.SX:
    """Return the position of the stance foot along and across the plane [m]."""
    return stance_rotation(p[robot.index(INCLINE)]) @ contact if is_on_uneven_ground(robot) else contact


def _touchdown_distance(builder: NlpBuilder, local: BlockVariables, p: ca.SX) -> ca.SX:
    """Return the distance between the feet at touchdown: the travel minus the slide of the stance foot [m].

    A periodic step starts with the swing foot at the same distance behind.
    """
    slid = sum(builder.slides(local), ca.SX(0))
    travel = local.add("travel", builder.variables[Unknown.TRAVEL])
    return travel - travel_of_slides(builder.robot, p, slid)
