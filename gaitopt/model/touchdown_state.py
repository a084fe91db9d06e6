"""States just before a touchdown, as a function of independent numbers."""

import functools

import casadi as ca

from gaitopt.model.coordinate_entries import GAP
from gaitopt.model.robot import Robot
from gaitopt.model.section_coordinate import dependent_angle, dependent_coordinate, undo_exchange


@functools.lru_cache(maxsize=64)
def state_before_touchdown(robot: Robot) -> ca.Function:
    """Return (angles after the leg exchange, scaled rates, scaled speed, scales, p) -> state (q, v) before a touchdown.

    All angles after the leg exchange but the dependent one are given.  The rates and the speed of the trailing foot are
    multiplied by the size of the dependent angle and by the two scales.  If the front foot moves up, all signs of
    the rates are changed.
    """
    count, p = len(robot.angles), ca.SX.sym("p", len(robot.parameters))
    others, rates, speed = ca.SX.sym("others", count - 1), ca.SX.sym("rates", count), ca.SX.sym("speed")
    scales, dependent = ca.SX.sym("scales", 2), dependent_angle(robot)(others, p)
    angles = ca.vertsplit(others)
    angles.insert(dependent_coordinate(robot), dependent)
    size = ca.fabs(dependent)
    q = ca.vertcat(0, 0, undo_exchange(robot)(ca.vertcat(*angles), p))
    v = ca.vertcat(size * scales[1] * speed, 0, size * scales[0] * rates)
    falling = ca.if_else(robot.landing(q, v, p)[1][GAP] > 0, -v, v)
    return ca.Function("state_before_touchdown", [others, rates, speed, scales, p], [ca.vertcat(q, falling)])
