"""Units of coordinates, actuators and joint stops, read from the expressions of a robot: lengths or angles."""

from collections.abc import Iterable, Sequence

import casadi as ca

from gaitopt.model.planar.contact_entry import METRE, RADIAN


def find_coordinate_units(q: ca.SX, positions: Iterable[ca.SX], angles: Iterable[ca.SX]) -> tuple[str, ...]:
    """Return the unit of each coordinate, ``"m"`` or ``"rad"``.

    A coordinate is an angle if the orientation of a body depends on it, or if a position is not linear in it.

    Parameters
    ----------
    q : SX, shape (n_q, 1)
    positions : iterable of SX
        Positions of bodies, contacts and drawn points.
    angles : iterable of SX
        Orientations of bodies.

    Examples
    --------
    >>> q = ca.SX.sym("q", 3)
    >>> find_coordinate_units(q, [q[0] + q[1] * ca.sin(q[2])], [])
    ('m', 'm', 'rad')
    """
    places = ca.vertcat(ca.SX(0, 1), *(ca.vec(ca.SX(position)) for position in positions))
    turns = ca.vertcat(ca.SX(0, 1), *(ca.SX(angle) for angle in angles))
    units = []
    for i in range(q.numel()):
        turning = ca.jacobian(turns, q[i]).nnz() > 0
        bent = ca.jacobian(ca.jacobian(places, q[i]), q[i]).nnz() > 0
        units.append(RADIAN if turning or bent else METRE)
    return tuple(units)


def find_unit(expression: ca.SX, q: ca.SX, units: Sequence[str]) -> str:
    """Return the unit of a joint's length or angle, an expression of the coordinates.

    It has the unit of a coordinate with a constant coefficient, such as a relative angle; an expression of angles
    without such a coordinate is a length.

    Examples
    --------
    >>> q = ca.SX.sym("q", 2)
    >>> find_unit(q[0] - q[1], q, ["rad", "rad"]), find_unit(ca.cos(q[0]), q, ["rad", "rad"])
    ('rad', 'm')
    """
    slope = ca.jacobian(expression, q)
    for i, unit in enumerate(units):
        if slope[i].nnz() and not ca.symvar(slope[i]):
            return unit
    return METRE
