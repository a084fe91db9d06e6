"""Contacts of a robot with the ground, as two scalar functions of its coordinates.

The *gap* n(q) is the height above the ground.  The *slide coordinate* t(q) moves with the material point in contact: it
is constant while the contact sticks, and its rate is the slip velocity.  A point has n = y, t = x; a circular arc
turned clockwise by phi about its centre c has n = c_y - r and t = c_x - r phi, so rolling without slip is sticking.
"""

from abc import ABC, abstractmethod

import casadi as ca

from gaitopt.arguments import check_record
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError


class Contact(ABC):
    """A part of the robot that can touch the ground.

    Attributes
    ----------
    body : str
        Name of the rigid body with this contact.  Closed contacts of one body slip together; by default the contact
        is alone.
    armed : SX, optional
        The contact closes only while this expression of coordinates and rates is positive: a straight leg swings
        through the ground.  By default it always closes.
    falls : bool
        Whether the robot has fallen as soon as this contact touches the ground.
    """

    body: str = ""
    armed: ca.SX | None = None
    falls: bool = False

    @property
    @abstractmethod
    def slide(self) -> ca.SX:
        """Slide coordinate t(q) [m]."""

    @property
    @abstractmethod
    def gap(self) -> ca.SX:
        """Height above the ground n(q) [m]."""

    @property
    @abstractmethod
    def point(self) -> ca.SX:
        """Point of the robot nearest to the ground, shape (2, 1) [m]."""

    @property
    @abstractmethod
    def rim(self) -> ca.SX:
        """Centre, radius and clockwise angle of the foot's rim, shape (4, 1) [m, m, m, rad]; radius 0 for a point."""

    @property
    def coordinates(self) -> ca.SX:
        """Slide coordinate and gap, shape (2, 1) [m]."""
        return ca.vertcat(self.slide, self.gap)


@check_record
@dataclass(frozen=True, eq=False)
class PointContact(Contact):
    """A point of the robot.

    Attributes
    ----------
    position : SX, shape (2, 1)
        Position in the slope-fixed frame [m].
    body, armed, falls
        See :class:`Contact`; robots with one foot on the ground at a time do not use them.

    Examples
    --------
    >>> angle = ca.SX.sym("angle")
    >>> PointContact(ca.vertcat(ca.sin(angle), ca.cos(angle))).gap
    SX(cos(angle))
    """

    position: ca.SX
    body: str = ""
    armed: ca.SX | None = None
    falls: bool = False

    def __post_init__(self) -> None:
        _refuse_constant_arming(self)

    @property
    def coordinates(self) -> ca.SX:
        """The position itself, shape (2, 1) [m]."""
        return self.position

    @property
    def slide(self) -> ca.SX:
        """Horizontal position [m]."""
        return self.position[0]

    @property
    def gap(self) -> ca.SX:
        """Height [m]."""
        return self.position[1]

    @property
    def point(self) -> ca.SX:
        """The point itself, shape (2, 1) [m]."""
        return self.position

    @property
    def rim(self) -> ca.SX:
        """The point with radius and angle 0, shape (4, 1)."""
        return ca.vertcat(self.position, 0, 0)


@check_record
@dataclass(frozen=True, eq=False)
class ArcContact(Contact):
    """A circular arc that rolls on the ground.

    Attributes
    ----------
    centre : SX, shape (2, 1)
        Centre of the arc in the slope-fixed frame [m].
    radius : SX or float
        Radius [m].
    angle : SX
        Clockwise angle of the body the arc belongs to [rad].
    body, armed, falls
        See :class:`Contact`; robots with one foot on the ground at a time do not use them.

    Examples
    --------
    A wheel of radius 0.3 m whose centre has moved by the unrolled arc has not slid:

    >>> angle = ca.SX.sym("angle")
    >>> wheel = ArcContact(ca.vertcat(0.3 * angle, 0.3), 0.3, angle)
    >>> ca.simplify(wheel.slide), wheel.gap
    (SX(0), SX(0))
    """

    centre: ca.SX
    radius: ca.SX
    angle: ca.SX
    body: str = ""
    armed: ca.SX | None = None
    falls: bool = False

    def __post_init__(self) -> None:
        _refuse_constant_arming(self)

    @staticmethod
    def on(foot: ca.SX, radius: ca.SX, angle: ca.SX) -> "ArcContact":
        """Return the arc whose slide coordinate and gap are `foot`, shape (2, 1), such as ``Coordinates.foot``."""
        return ArcContact(foot + ca.vertcat(radius * angle, radius), radius, angle)

    @property
    def slide(self) -> ca.SX:
        """Position of the centre minus the unrolled arc length [m]."""
        return self.centre[0] - self.radius * self.angle

    @property
    def gap(self) -> ca.SX:
        """Height of the lowest point of the arc [m]."""
        return self.centre[1] - self.radius

    @property
    def point(self) -> ca.SX:
        """Lowest point of the arc, shape (2, 1) [m]."""
        return self.centre - ca.vertcat(0, self.radius)

    @property
    def rim(self) -> ca.SX:
        """Centre, radius and angle, shape (4, 1)."""
        return ca.vertcat(self.centre, self.radius, self.angle)


def _refuse_constant_arming(contact: Contact) -> None:
    """Raise InputError if a contact is armed by a plain number, and therefore always or never."""
    if isinstance(contact.armed, int | float):
        raise InputError(
            f"{type(contact).__name__}: armed must be an expression of coordinates that is positive where the contact "
            f"can close, such as the distance of the legs minus {abs(contact.armed):g}, got the number "
            f"{contact.armed:g}; without armed, the contact can always close."
        )
