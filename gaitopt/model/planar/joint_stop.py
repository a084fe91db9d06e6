"""Joint stops: contacts between parts of a robot, which have a gap and no slide coordinate."""

import casadi as ca

from gaitopt.arguments import check_record
from gaitopt.dataclass import dataclass


@check_record
@dataclass(frozen=True, eq=False)
class JointStop:
    """A stop that keeps an expression of the coordinates at least zero, without rebound.

    Attributes
    ----------
    gap : SX
        Distance to the stop, such as ``flexion`` of a knee or ``full_length - length`` of a leg [rad or m].
    latched : bool
        Whether the stop stays closed in both directions once it has closed, until it is released.
    released_by : str
        Event that releases a latched stop: ``"NAME opens"`` or ``"NAME closes"`` with the name of a contact.  The stop
        takes part in an impact as latched if a contact opens by this impact, and as released if a contact closes.

    Examples
    --------
    >>> flexion = ca.SX.sym("flexion")
    >>> JointStop(flexion, latched=True, released_by="left foot opens").latched
    True
    """

    gap: ca.SX
    latched: bool = False
    released_by: str = ""


@check_record
@dataclass(frozen=True, eq=False)
class SwitchedSpring:
    """A linear spring whose rest value is increased from its greatest compression on, for a push-off.

    Its energy is k (s - s0)^2 / 2 before the switch and k (s - s0 - D)^2 / 2 after it.  The rest value increases when
    the rate s' rises through zero while a contact is closed, and returns when the contact opens.

    Attributes
    ----------
    coordinate : SX
        Length or angle s, an expression of q [m or rad].
    stiffness : SX or float
        k [N/m or N m/rad].
    rest, extension : SX or float
        s0 and D [m or rad].
    contact : str
        Name of the contact.

    Examples
    --------
    >>> SwitchedSpring(ca.SX.sym("length"), 4000.0, 0.5, 0.02, contact="foot").contact
    'foot'
    """

    coordinate: ca.SX
    stiffness: ca.SX
    rest: ca.SX
    extension: ca.SX
    contact: str

    def energy(self, switch: ca.SX) -> ca.SX:
        """Return the elastic energy for a switch that is 0 before the push-off and 1 during it [J]."""
        return self.stiffness * (self.coordinate - self.rest - switch * self.extension) ** 2 / 2
