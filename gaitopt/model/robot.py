"""Robots: frozen records of named CasADi Functions, and the symbols of their expressions."""

import weakref
from collections.abc import Mapping, Sequence
from dataclasses import field, fields
from typing import Any

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.lazy import LazyField, LazyRecord
from gaitopt.locks import ONE_AT_A_TIME, cached_property
from gaitopt.model.contacts.contact_model import ContactModel
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.coordinate_entries import CONTACT, StateEntries, angle_entry, count_coordinates
from gaitopt.model.ground import GROUND
from gaitopt.model.inertias import check_inertias
from gaitopt.model.robot_record import RobotRecord
from gaitopt.model.robot_serialisation import read_fields, write_record
from gaitopt.model.terrain import refuse_terrain
from gaitopt.parameters import Parameter, as_vector, resolve


def add_ground(parameters: Sequence[Parameter]) -> tuple[Parameter, ...]:
    """Return the parameters of a robot followed by those of the ground.

    Raises
    ------
    InputError
        If a name is repeated, ``gravity`` is missing, or an upper bound is not a parameter.
    """
    every = (*parameters, *GROUND)
    names = [p.name for p in every]
    if len(set(names)) != len(names):
        repeated, ground = next(name for name in names if names.count(name) > 1), [p.name for p in GROUND]
        listed = ", ".join(map(repr, ground))
        place = f"; {listed} are names of the ground's parameters" if repeated in ground else ""
        raise InputError(f"Parameters must have different names, got {repeated!r} twice{place}.")
    if "gravity" not in names:
        raise InputError("The parameters of a robot must include 'gravity'.")
    for p in parameters:
        if p.at_most and p.at_most not in names:
            raise InputError(
                f"The upper bound {p.at_most!r} of {p.name} is not a parameter. {suggest(p.at_most, names)}"
            )
    return every


@check_arguments
class Coordinates:
    """The symbols of a robot's expressions: q = (x, y, angles), rates, and parameters by name.

    Parameters
    ----------
    angles : sequence of str
        Names of the joint or leg angles [rad].
    parameters : sequence of Parameter
        Parameters of the robot, ``gravity`` among them.  Those of the ground are added.

    Examples
    --------
    >>> gravity = Parameter("gravity", 9.8, "m/s^2", "gravity")
    >>> Coordinates(["theta"], [gravity]).q.shape
    (3, 1)
    """

    def __init__(self, angles: Sequence[str], parameters: Sequence[Parameter]) -> None:
        self.angles = tuple(angles)
        self.parameters = add_ground(parameters)
        names = [p.name for p in self.parameters]
        self.q = ca.vertcat(ca.SX.sym("x"), ca.SX.sym("y"), *[ca.SX.sym(a) for a in angles])
        self.v = ca.SX.sym("v", self.q.numel())
        self.p = ca.vertcat(*[ca.SX.sym(name) for name in names])

    @property
    def foot(self) -> ca.SX:
        """Slide coordinate and gap of the stance foot, SX of shape (2, 1) [m]; of a point, its position."""
        return self.q[CONTACT]

    @property
    def gravity(self) -> ca.SX:
        """Acceleration of gravity along and across the slope, SX of shape (2, 1) [m/s^2]."""
        slope = self.parameter("slope")
        return self.parameter("gravity") * ca.vertcat(ca.sin(slope), -ca.cos(slope))

    def angle(self, name: str) -> ca.SX:
        """Return the symbol of an angle [rad]."""
        return self.q[angle_entry(self.angles.index(name))]

    def parameter(self, name: str) -> ca.SX:
        """Return the symbol of a parameter."""
        return self.p[[p.name for p in self.parameters].index(name)]


@dataclass(frozen=True, eq=False, kw_only=True)
class Robot(LazyRecord):
    """A planar walker with one foot on the ground at a time.  Build one with :func:`gaitopt.assemble`.

    Every attribute from `dynamics` on is a CasADi Function of q (n_q), v (n_q), u (n_u) and the parameter
    vector p (n_p); the optimiser calls them with symbols and the simulator with numbers, so both use the same model.

    Attributes
    ----------
    name, description : str
    angles, actuators : tuple of str
        Names of the angles (q without the foot) and of the actuators.
    parameters : tuple of Parameter
        Parameters of the robot, then those of the ground; the order of p.
    points, links : tuple
        Names of the points in figures, and pairs of their indices joined by a line.
    contact_model : ContactModel
        Transitions between contact modes and the impact law.
    dynamics : (q, v, p) -> mass_matrix (n_q, n_q), bias (n_q), actuation (n_q, n_u)
    inverse_dynamics : (q, v, a, u, p) -> M a + h - E u (n_q), of which the first two entries are the contact force
    acceleration : mode -> ((q, v, u, p) -> acceleration (n_q), force (2))
    mass : p -> total mass [kg]
    inertias : p -> masses [kg] and inertias [kg m^2] that could be negative, an output each; None if there are none
    energy : (q, v, p) -> kinetic, potential [J]
    momentum : (q, v, p) -> linear (2), angular (1)
    wellposed : (q, p) -> (2), share of the mass that resists slip+ / slip-, positive where that slip is well posed
    landing : (q, v, p) -> position (2), velocity (2), jacobian (2, n_q) of the landing foot
    impact : (q, v_minus, v_plus, impulse, p) -> momentum residual (n_q), landing-foot velocity after (2)
    collision : (q, v, p) -> landing-foot velocity (2), its mobility (2, 2), rates per unit impulse (n_q, 2)
    touchdown : (q, v, p) -> guard, rate, armed; the step ends when the guard falls through 0 while armed > 0
    swap : (q, v, p) -> q, v in the coordinates of the next step, the landing foot being (x, y)
    unswap : (q_before, v_next, p) -> v before the swap
    upright : (q, p) -> positive while the walker has not fallen
    joint_rates : (q, v, p) -> (n_u) rates of the angles the actuators work on [rad/s]
    figure : (q, p) -> (2, n_points) positions of the points in figures [m]
    rims : (q, p) -> (4, 2) centre [m], radius [m] and clockwise angle [rad] of the stance and the landing foot's rim
    force_powers : (q, v, p) -> elastic energy of springs and potentials [J], power dissipated by dampers [W]

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> robot = compass_biped()
    >>> robot.n_q, robot.n_u, robot.energy([0] * 4, [0] * 4, robot.vector(robot.resolve({})))[0]
    (4, 2, DM(0))
    """

    name: str
    description: str
    angles: tuple[str, ...]
    actuators: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    points: tuple[str, ...]
    links: tuple[tuple[int, int], ...]
    contact_model: ContactModel = field(default_factory=ContactModel, repr=False)
    dynamics: LazyField[ca.Function] = LazyField()
    inverse_dynamics: LazyField[ca.Function] = LazyField()
    acceleration: Mapping[Mode, ca.Function] = field(repr=False)
    mass: LazyField[ca.Function] = LazyField()
    inertias: LazyField[ca.Function | None] = LazyField(None)
    energy: LazyField[ca.Function] = LazyField()
    momentum: LazyField[ca.Function] = LazyField()
    wellposed: LazyField[ca.Function] = LazyField()
    landing: LazyField[ca.Function] = LazyField()
    impact: LazyField[ca.Function] = LazyField()
    collision: LazyField[ca.Function] = LazyField()
    touchdown: LazyField[ca.Function] = LazyField()
    swap: LazyField[ca.Function] = LazyField()
    unswap: LazyField[ca.Function] = LazyField()
    upright: LazyField[ca.Function] = LazyField()
    joint_rates: LazyField[ca.Function] = LazyField()
    figure: LazyField[ca.Function] = LazyField()
    rims: LazyField[ca.Function] = LazyField()
    force_powers: LazyField[ca.Function] = LazyField()

    @cached_property
    def record(self) -> RobotRecord:
        """The robot as plain data, for files and other processes."""
        record = write_record({entry.name: getattr(self, entry.name) for entry in fields(self)})
        with ONE_AT_A_TIME:  # not while fields are read, which take a lock per field
            _RESTORED.setdefault(record.digest, self)
        return record

    @staticmethod
    def from_record(record: RobotRecord, contact_model: ContactModel | None = None) -> "Robot":
        """Return the robot of a record: in one process the same object at every call, so that it is compiled once.

        Parameters
        ----------
        record : RobotRecord
        contact_model : ContactModel, optional
            Instead of the one described in the record, from which custom classes are not restored.

        Raises
        ------
        ArchiveError
            If the record is damaged, or the installed CasADi cannot read it.
        InputError
            If the contact model is custom and not given.

        Examples
        --------
        >>> from gaitopt import compass_biped
        >>> Robot.from_record(compass_biped().record) is compass_biped()
        True
        """
        with ONE_AT_A_TIME:
            robot = _RESTORED.get(record.digest)
            if robot is None or contact_model not in (None, robot.contact_model):
                robot = Robot(**read_fields(record, contact_model))
                vars(robot)["record"] = record
                _RESTORED[record.digest] = robot
            return robot

    @staticmethod
    def is_restored(record: RobotRecord) -> bool:
        """Return whether this process has already restored the robot of a record."""
        return record.digest in _RESTORED

    def share(self, record: RobotRecord) -> "Robot":
        """Return the robot itself, which is used from now on for every record with the same physics."""
        with ONE_AT_A_TIME:
            _RESTORED[record.digest] = self
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return Robot.from_record, (self.record, self.contact_model)

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, angles={self.angles}, actuators={self.actuators})"

    def __str__(self) -> str:
        from gaitopt.model.robot_formulation import formulate_robot

        return str(formulate_robot(self))

    def _repr_latex_(self) -> str:
        from gaitopt.model.robot_formulation import formulate_robot

        return formulate_robot(self).latex

    @cached_property
    def n_q(self) -> int:
        """Number of coordinates, the stance foot's two included."""
        return count_coordinates(len(self.angles))

    @cached_property
    def state_entries(self) -> StateEntries:
        """Entries of the state y = (q, v) by name."""
        return StateEntries(self.n_q)

    @property
    def n_u(self) -> int:
        """Number of actuators."""
        return len(self.actuators)

    @cached_property
    def has_springs(self) -> bool:
        """Whether springs or potentials store elastic energy, a part of the potential energy."""
        return self.force_powers.jac_sparsity(0, 0).nnz() > 0

    @cached_property
    def has_dampers(self) -> bool:
        """Whether dampers dissipate energy."""
        return self.force_powers.jac_sparsity(1, 1).nnz() > 0

    @property
    def n_works(self) -> int:
        """Number of entries of :meth:`work_rates`."""
        return self.n_u + 1 + self.has_dampers

    def work_rates(self, q: ca.SX, v: ca.SX, u: ca.SX, force: ca.SX, p: ca.SX) -> ca.SX:
        """Return the rates of the works that are integrated along a motion, shape (n_works, 1) [W].

        They are the power of each actuator, the friction loss rate and, of a robot with dampers, the damping loss
        rate.  `force` is the contact force (f_t, f_n) of a sliding foot, or zero.
        """
        powers = ca.vertcat(u * self.joint_rates(q, v, p), -force[0] * v[0])
        return ca.vertcat(powers, self.force_powers(q, v, p)[1]) if self.has_dampers else powers

    @cached_property
    def _places(self) -> dict[str, int]:
        return {parameter.name: i for i, parameter in enumerate(self.parameters)}

    def index(self, name: str) -> int:
        """Return the place of a parameter in p.

        Examples
        --------
        >>> from gaitopt import compass_biped
        >>> compass_biped().index("leg_mass")
        2
        """
        return self._places[name]

    def static_friction(self, p: ca.SX) -> ca.SX:
        """Return the coefficient of static friction from the vector p, of symbols or numbers."""
        return p[self.index("static_friction_ratio")] * p[self.index("friction")]

    def weight(self, p: ca.SX) -> ca.SX:
        """Return the total weight m g from the vector p, of symbols or numbers [N]."""
        return self.mass(p) * p[self.index("gravity")]

    def with_contact_model(self, model: ContactModel) -> "Robot":
        """Return the robot with another contact model, such as a custom impact law or further transitions.

        Examples
        --------
        >>> from gaitopt import compass_biped
        >>> from gaitopt.model.contacts.contact_model import ContactModel
        >>> compass_biped().with_contact_model(ContactModel()).name
        'compass_biped'
        """
        if not isinstance(model, ContactModel):
            raise InputError(f"The contact model of a robot must be a ContactModel, got {model!r}.")
        return self.replace_fields(contact_model=model)

    def resolve(self, values: Mapping[str, object]) -> dict[str, float]:
        """Return every parameter by name, with defaults; raise InputError for an invalid name or value.

        Examples
        --------
        >>> from gaitopt import compass_biped
        >>> compass_biped().resolve({"leg_mass": 5})["leg_mass"]
        5.0
        """
        refuse_terrain(values)
        resolved = resolve(self.parameters, values, f"Robot {self.name!r}")
        check_inertias(self.name, self.inertias, self.parameters, resolved)
        return resolved

    def vector(self, values: Mapping[str, float]) -> np.ndarray:
        """Return resolved parameters as the vector p, shape (n_p,)."""
        return as_vector(self.parameters, values)


_RESTORED: "weakref.WeakValueDictionary[str, Robot]" = weakref.WeakValueDictionary()
"""Robots of this process by the digest of their record."""
