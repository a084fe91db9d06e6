"""Forces of a robot besides gravity, contacts and actuators: springs, dampers, potentials and rotor inertia."""

import casadi as ca

from gaitopt.arguments import check_record
from gaitopt.dataclass import dataclass


@check_record
@dataclass(frozen=True, eq=False)
class Spring:
    """A linear spring along a coordinate, with the energy k (s - s0)^2 / 2.

    Attributes
    ----------
    coordinate : SX
        Angle or length s, an expression of q [rad or m].
    stiffness : SX or float
        k [N m/rad or N/m].
    rest : SX or float
        Rest value s0 [rad or m].

    Examples
    --------
    >>> Spring(ca.SX.sym("angle"), 20.0, 0.1).energy
    SX(((20*sq((angle-0.1)))/2))
    """

    coordinate: ca.SX
    stiffness: ca.SX
    rest: ca.SX = 0.0

    @property
    def energy(self) -> ca.SX:
        """Elastic energy [J]."""
        return self.stiffness * (self.coordinate - self.rest) ** 2 / 2


@check_record
@dataclass(frozen=True, eq=False)
class Damper:
    """A linear damper along a coordinate, with the force -d s'.

    Attributes
    ----------
    coordinate : SX
        Angle or length s, an expression of q [rad or m].
    damping : SX or float
        d [N m s/rad or N s/m].

    Examples
    --------
    >>> Damper(ca.SX.sym("angle"), 0.5).damping
    0.5
    """

    coordinate: ca.SX
    damping: ca.SX


@check_record
@dataclass(frozen=True, eq=False)
class Potential:
    """A general potential, whose energy is stored and returned.

    Attributes
    ----------
    energy : SX
        An expression of q [J].

    Examples
    --------
    >>> angle = ca.SX.sym("angle")
    >>> Potential(3 * (1 - ca.cos(angle))).energy.shape
    (1, 1)
    """

    energy: ca.SX


@check_record
@dataclass(frozen=True, eq=False)
class RotorInertia:
    """Inertia of a rotor reflected through a gear: it adds (ratio^2 I) s'^2 / 2 to the kinetic energy.

    Attributes
    ----------
    coordinate : SX
        Joint angle s, an expression of q [rad].
    inertia : SX or float
        I of the rotor [kg m^2].
    ratio : SX or float
        Gear ratio.

    Examples
    --------
    >>> RotorInertia(ca.SX.sym("knee"), 1e-4, 50).reflected
    0.25
    """

    coordinate: ca.SX
    inertia: ca.SX
    ratio: ca.SX = 1.0

    @property
    def reflected(self) -> ca.SX:
        """Inertia at the joint [kg m^2]."""
        return self.ratio**2 * self.inertia


Force = Spring | Damper | Potential | RotorInertia
