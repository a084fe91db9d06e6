"""Planar robots with any contacts: frozen records of named CasADi Functions of minimal coordinates."""

import weakref
from collections.abc import Mapping, Sequence
from dataclasses import field, fields
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.lazy import LazyField, LazyRecord
from gaitopt.locks import ONE_AT_A_TIME, cached_property
from gaitopt.model.inertias import check_inertias
from gaitopt.model.planar.contact_entry import ContactEntry
from gaitopt.model.planar.mirror import Mirror
from gaitopt.model.planar.newton_euler import NewtonEuler
from gaitopt.model.planar.planar_record import read_planar_fields, write_planar_record
from gaitopt.model.robot_formulation import formulate_planar_robot
from gaitopt.model.robot_record import RobotRecord
from gaitopt.model.terrain import refuse_terrain
from gaitopt.parameters import Parameter, as_vector, resolve


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanarRobot(LazyRecord):
    """A planar robot, each contact of which is free, sticks or slips.  Build one with `assemble_planar`.

    The equations of motion are M(q) a + h(q, v) = E u + sum of W_n^T f_n + W_t^T f_t over the closed contacts, with
    W_n = d gap/dq and W_t = d slide/dq.  Functions take q (n_q), v (n_q) and the vector p of parameters and switches.

    Attributes
    ----------
    name : str
    coordinates, actuators : tuple of str
    units, actuator_units : tuple of str
        Unit of each coordinate, ``"m"`` or ``"rad"``, and of each actuator, ``"N"`` or ``"N m"``.
    travel : str or None
        Coordinate along the ground that a periodic gait does not repeat.
    parameters : tuple of Parameter
        Parameters of the robot, then those of the ground; the first entries of p.
    switches : tuple of str
        Contacts that turn off the switched springs; the last entries of p are 1 while a spring is extended.
    contacts : tuple of ContactEntry
        The order of all arrays with one row per contact.
    mirror : Mirror or None
        Exchange of the legs.
    points, links : tuple
        Names of the points in figures, and pairs of their indices joined by a line.
    dynamics : (q, v, p) -> mass_matrix (n_q, n_q), bias (n_q), actuation (n_q, n_u)
    gaps : (q, p) -> gap (n_c), slide (n_c), zero for a stop
    rows : (q, v, p) -> normal (n_c, n_q), tangent (n_c, n_q), normal_bias (n_c), tangent_bias (n_c)
        W_n, W_t and the parts W_n' v and W_t' v of the accelerations of gap and slide.
    arming : (q, v, p) -> (n_c), positive where a contact can close
    switch_guards : (q, v, p) -> (n_switches), a spring is extended when its guard falls through zero
    mass : p -> total mass [kg]
    inertias : p -> masses [kg] and inertias [kg m^2] that could be negative, an output each, without the switches; None
        if there are none
    energy : (q, v, p) -> kinetic, potential [J]
    momentum : (q, v, p) -> linear (2), angular (1)
    force_powers : (q, v, p) -> elastic energy [J], power dissipated by dampers [W]
    joint_rates : (q, v, p) -> (n_u) rates on which the actuators do work
    figure : (q, p) -> (2, n_points) positions of the points in figures [m]
    rims : (q, p) -> (4, n_c) centre [m], radius [m] and clockwise angle [rad] of each contact's rim; nan for a stop
    recursive, lifted : NewtonEuler
        Equations without a mass matrix.

    Examples
    --------
    >>> from gaitopt.model.robots.vertical_hopper import vertical_hopper
    >>> robot = vertical_hopper()
    >>> robot.coordinates, [contact.name for contact in robot.contacts]
    (('body', 'foot'), ['sole', 'full length'])
    """

    name: str
    coordinates: tuple[str, ...]
    actuators: tuple[str, ...]
    units: tuple[str, ...]
    actuator_units: tuple[str, ...]
    travel: str | None
    parameters: tuple[Parameter, ...]
    switches: tuple[str, ...]
    contacts: tuple[ContactEntry, ...]
    mirror: Mirror | None = field(repr=False)
    points: tuple[str, ...]
    links: tuple[tuple[int, int], ...]
    dynamics: LazyField[ca.Function] = LazyField()
    gaps: LazyField[ca.Function] = LazyField()
    rows: LazyField[ca.Function] = LazyField()
    arming: LazyField[ca.Function] = LazyField()
    switch_guards: LazyField[ca.Function] = LazyField()
    mass: LazyField[ca.Function] = LazyField()
    inertias: LazyField[ca.Function | None] = LazyField(None)
    energy: LazyField[ca.Function] = LazyField()
    momentum: LazyField[ca.Function] = LazyField()
    force_powers: LazyField[ca.Function] = LazyField()
    joint_rates: LazyField[ca.Function] = LazyField()
    figure: LazyField[ca.Function] = LazyField()
    rims: LazyField[ca.Function] = LazyField()
    recursive: LazyField[NewtonEuler] = LazyField()
    lifted: LazyField[NewtonEuler] = LazyField()

    def __repr__(self) -> str:
        return f"PlanarRobot({self.name!r}, coordinates={self.coordinates}, contacts={self.contact_names})"

    def __str__(self) -> str:
        return str(formulate_planar_robot(self))

    def _repr_latex_(self) -> str:
        return formulate_planar_robot(self).latex

    @cached_property
    def record(self) -> RobotRecord:
        """The robot as plain data, for files and other processes."""
        record = write_planar_record({entry.name: getattr(self, entry.name) for entry in fields(self)})
        with ONE_AT_A_TIME:
            _RESTORED.setdefault(record.digest, self)
        return record

    @staticmethod
    def from_record(record: RobotRecord) -> "PlanarRobot":
        """Return the robot of a record: in one process the same object at every call.

        Raises
        ------
        ArchiveError
            If the record is damaged, or the installed CasADi cannot read it.

        Examples
        --------
        >>> from gaitopt.model.robots.monopod import monopod
        >>> PlanarRobot.from_record(monopod().record) is monopod()
        True
        """
        with ONE_AT_A_TIME:
            robot = _RESTORED.get(record.digest)
            if robot is None:
                robot = PlanarRobot(**read_planar_fields(record))
                vars(robot)["record"] = record
                _RESTORED[record.digest] = robot
            return robot

    def __reduce__(self) -> tuple[Any, ...]:
        return PlanarRobot.from_record, (self.record,)

    @cached_property
    def n_q(self) -> int:
        """Number of coordinates."""
        return len(self.coordinates)

    @property
    def n_u(self) -> int:
        """Number of actuators."""
        return len(self.actuators)

    @cached_property
    def contact_names(self) -> tuple[str, ...]:
        """Names of the contacts."""
        return tuple(contact.name for contact in self.contacts)

    @cached_property
    def state_names(self) -> tuple[str, ...]:
        """Names of the entries of the state (q, v)."""
        return (*self.coordinates, *(f"{name}_rate" for name in self.coordinates))

    def contact_index(self, name: str) -> int:
        """Return the place of a contact, or raise InputError."""
        if name not in self.contact_names:
            raise InputError(f"Robot {self.name!r} has no contact {name!r}. {suggest(name, self.contact_names)}")
        return self.contact_names.index(name)

    def resolve(self, values: Mapping[str, object]) -> dict[str, float]:
        """Return every parameter by name, with defaults; raise InputError for an invalid name or value."""
        refuse_terrain(values)
        resolved = resolve(self.parameters, values, f"Robot {self.name!r}")
        check_inertias(self.name, self.inertias, self.parameters, resolved)
        return resolved

    def vector(self, values: Mapping[str, float], extended: Sequence[bool] = ()) -> NDArray[np.float64]:
        """Return resolved parameters and switches as the vector p, shape (n_p,); by default no spring is extended."""
        switches = np.array(extended or [False] * len(self.switches), dtype=float)
        return np.concatenate([as_vector(self.parameters, values), switches])

    def index(self, name: str) -> int:
        """Return the place of a parameter in p."""
        return [parameter.name for parameter in self.parameters].index(name)


_RESTORED: "weakref.WeakValueDictionary[str, PlanarRobot]" = weakref.WeakValueDictionary()
"""Robots of this process by the digest of their record."""
