"""Robots from URDF and MJCF files, cut to the sagittal plane: x forward, z up, rotations about y."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.model.assembly import Drawing
from gaitopt.model.contacts.contact import PointContact
from gaitopt.model.forces import Damper, Force, RotorInertia, Spring
from gaitopt.model.importing.mechanism import ImportedBody, ImportedJoint, Mechanism, Vector, read_mechanism
from gaitopt.model.mechanics import RigidLink
from gaitopt.model.planar.planar_assembly import assemble_planar
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.parameters import Parameter

BASE = ("x", "y", "pitch")
"""Coordinates of a floating base: the origin of its frame, and its rotation about the lateral axis."""

PARALLEL = 1 - 1e-6
"""Least cosine of the angle between two axes that count as parallel."""


@dataclass(frozen=True)
class ImportedRobot:
    """A robot from a file, and what its cut to the sagittal plane has dropped.

    Attributes
    ----------
    robot : PlanarRobot
        Mass and inertia of each body are the parameters ``NAME_mass`` [kg] and ``NAME_inertia`` [kg m^2].
    dropped : tuple of str
        One sentence for each property of the file that the robot does not have.

    Examples
    --------
    >>> ImportedRobot.__name__
    'ImportedRobot'
    """

    robot: PlanarRobot
    dropped: tuple[str, ...]


@check_arguments
def import_planar(
    source: str | Path,
    *,
    contacts: Mapping[str, tuple[str, Sequence[float]]],
    mirror: Mapping[str, str] | None = None,
    actuated: Sequence[str] | None = None,
) -> ImportedRobot:
    """Import a robot from a URDF or MJCF file and cut it to the sagittal plane.

    Hinges about the lateral axis y and slides in the plane x-z become coordinates with the names of the joints; other
    joints are fixed in their zero position.  Unless the file contains a slide along x at its root, the root moves
    freely, with the coordinates x, y and pitch.  Needs ``pip install 'gaitopt[import]'``.

    Parameters
    ----------
    source : str or Path
        File, or its text, which begins with ``<``.
    contacts : mapping of str to (str, (x, y, z))
        Contact points by name: their body, and their place in the frame of this body [m].  Those of one body stick or
        slip together.
    mirror : mapping of str to str, optional
        Exchange of the legs, see :func:`gaitopt.model.assemble_planar`.
    actuated : sequence of str, optional
        Joints with an actuator, which has the name of the joint; by default the actuators of the file, or every joint
        if the file has none.

    Returns
    -------
    ImportedRobot

    Raises
    ------
    InputError
        If the file or a name is invalid, or MuJoCo is not installed.

    Examples
    --------
    >>> text = '''<mujoco model="hopper"><worldbody><body name="body"><joint name="slide" type="slide" axis="0 0 1"/>
    ...   <geom type="sphere" size="0.1" mass="2"/></body></worldbody></mujoco>'''
    >>> imported = import_planar(text, contacts={"sole": ("body", (0, 0, -0.5))})  # doctest: +SKIP
    >>> imported.robot.coordinates  # doctest: +SKIP
    ('x', 'y', 'pitch', 'slide')
    """
    mechanism = read_mechanism(source)
    kept = [joint for body in mechanism.bodies for joint in body.joints if _is_planar(joint)]
    floats = not any(joint.kind == "slide" and abs(joint.axis[0]) > PARALLEL for joint in _root(mechanism).joints)
    names = (*(BASE if floats else ()), *(joint.name for joint in kept))
    travel = "x" if floats else next(joint.name for joint in kept if abs(joint.axis[0]) > PARALLEL)
    c = PlanarCoordinates(names, _parameters(mechanism), travel=travel)
    frames = _frames(mechanism, c, floats=floats)
    points = {name: _contact_point(mechanism, frames, name, *place) for name, place in contacts.items()}
    robot = assemble_planar(
        mechanism.name,
        c,
        bodies=[
            RigidLink(
                c.parameter(f"{_identifier(body)}_mass"),
                frame.move(body.centre),
                c.parameter(f"{_identifier(body)}_inertia"),
                frame.angle,
            )
            for body, frame in zip(mechanism.bodies, frames, strict=True)
            if body.mass
        ],
        contacts={name: PointContact(point, body=contacts[name][0]) for name, point in points.items()},
        actuators=_actuators(mechanism, kept, actuated, c),
        forces=[force for joint in kept for force in _forces(joint, c.coordinate(joint.name))],
        mirror=mirror,
        drawing=_drawing(mechanism, frames, points, {name: body for name, (body, _) in contacts.items()}),
    )
    return ImportedRobot(robot, tuple(_report(mechanism, kept)))


@dataclass(frozen=True, eq=False)
class Frame:
    """The motion of a body in the plane: a point P of the zero pose moves to R(angle) P + shift."""

    angle: ca.SX
    shift: ca.SX

    def move(self, point: Vector) -> ca.SX:
        """Return where a point of the zero pose is, SX of shape (2, 1)."""
        return _turn(self.angle, ca.DM(point[[0, 2]])) + self.shift

    def join(self, joint: ImportedJoint, coordinate: ca.SX) -> "Frame":
        """Return the frame behind a joint."""
        change = coordinate - joint.zero
        if joint.kind == "slide":
            return Frame(self.angle, self.shift + _turn(self.angle, ca.DM(joint.axis[[0, 2]])) * change)
        angle, anchor = self.angle + np.sign(joint.axis[1]) * change, ca.DM(joint.anchor[[0, 2]])
        return Frame(angle, self.shift + _turn(self.angle, anchor) - _turn(angle, anchor))


def _turn(angle: ca.SX, vector: ca.SX) -> ca.SX:
    """Return a vector (x, z) rotated about y, clockwise in the plane."""
    return ca.vertcat(
        ca.cos(angle) * vector[0] + ca.sin(angle) * vector[1], ca.cos(angle) * vector[1] - ca.sin(angle) * vector[0]
    )


def _is_planar(joint: ImportedJoint) -> bool:
    """Return whether a joint moves in the sagittal plane."""
    if joint.kind == "hinge":
        return bool(abs(joint.axis[1]) > PARALLEL)
    return bool(joint.kind == "slide" and np.hypot(joint.axis[0], joint.axis[2]) > PARALLEL)


def _root(mechanism: Mechanism) -> ImportedBody:
    """Return the root body, which has no parent."""
    roots = [body for body in mechanism.bodies if body.parent is None]
    if len(roots) != 1:
        names = ", ".join(repr(body.name) for body in roots) or "none"
        raise InputError(f"Robot {mechanism.name!r} must have one root body, which has no parent, got {names}.")
    return roots[0]


def _frames(mechanism: Mechanism, c: PlanarCoordinates, *, floats: bool) -> list[Frame]:
    """Return the frame of each body."""
    frames: list[Frame] = []
    for body in mechanism.bodies:
        frame = Frame(ca.SX(0), ca.SX(2, 1)) if body.parent is None else frames[body.parent]
        if body.parent is None and floats:
            x, y, pitch = (c.coordinate(name) for name in BASE)
            frame = Frame(pitch, ca.vertcat(x, y) - _turn(pitch, ca.DM(body.origin[[0, 2]])))
        for joint in body.joints:
            if _is_planar(joint):
                frame = frame.join(joint, c.coordinate(joint.name))
        frames.append(frame)
    return frames


def _identifier(body: ImportedBody) -> str:
    return re.sub(r"\W", "_", body.name)


def _parameters(mechanism: Mechanism) -> list[Parameter]:
    """Return mass and inertia about the lateral axis of each body, and gravity."""
    parameters = []
    for body in mechanism.bodies:
        if body.mass:
            name = _identifier(body)
            parameters.append(Parameter(f"{name}_mass", body.mass, "kg", f"mass of {body.name}", lower=0.0))
            value, text = float(body.inertia[1, 1]), f"inertia of {body.name} about its centre of mass"
            parameters.append(Parameter(f"{name}_inertia", value, "kg m^2", text, lower=0.0))
    text = "gravitational acceleration"
    return [*parameters, Parameter("gravity", mechanism.gravity, "m/s^2", text, lower=0.0, lower_open=True)]


def _contact_point(mechanism: Mechanism, frames: list[Frame], name: str, body: str, place: Sequence[float]) -> ca.SX:
    """Return the position of a contact."""
    names = [part.name for part in mechanism.bodies]
    if body not in names:
        raise InputError(f"Contact {name!r} is on body {body!r}, which is not in the file. {suggest(body, names)}")
    if np.shape(place) != (3,) or not np.all(np.isfinite(place)):
        raise InputError(f"Contact {name!r} must have three finite coordinates (x, y, z), got {place!r}.")
    part = mechanism.bodies[names.index(body)]
    return frames[names.index(body)].move(part.origin + part.rotation @ np.asarray(place, dtype=float))


def _actuators(
    mechanism: Mechanism, kept: list[ImportedJoint], actuated: Sequence[str] | None, c: PlanarCoordinates
) -> dict[str, ca.SX]:
    """Return the coordinates on which the actuators work."""
    names = [joint.name for joint in kept]
    if actuated is not None:
        for name in actuated:
            if name not in names:
                raise InputError(f"actuated names {name!r}, which is not a planar joint. {suggest(name, names)}")
        return {name: c.coordinate(name) for name in actuated}
    motors = {label: joint for label, joint in mechanism.actuators.items() if joint in names}
    return {label: c.coordinate(joint) for label, joint in (motors or dict(zip(names, names, strict=True))).items()}


def _forces(joint: ImportedJoint, coordinate: ca.SX) -> list[Force]:
    """Return spring, damper and reflected inertia of a joint."""
    forces: list[Force] = []
    if joint.stiffness:
        forces.append(Spring(coordinate, joint.stiffness, joint.rest))
    if joint.damping:
        forces.append(Damper(coordinate, joint.damping))
    if joint.armature:
        forces.append(RotorInertia(coordinate, joint.armature))
    return forces


def _drawing(
    mechanism: Mechanism, frames: list[Frame], contacts: Mapping[str, ca.SX], bodies: Mapping[str, str]
) -> Drawing:
    """Return lines from the frame of each body to that of its parent, and to its contacts."""
    points = {body.name: frame.move(body.origin) for body, frame in zip(mechanism.bodies, frames, strict=True)}
    links = [(mechanism.bodies[body.parent].name, body.name) for body in mechanism.bodies if body.parent is not None]
    labels = {name: name if name not in points else f"{name} point" for name in contacts}
    points |= {labels[name]: point for name, point in contacts.items()}
    return Drawing(points, [*links, *((bodies[name], labels[name]) for name in contacts)])


def _report(mechanism: Mechanism, kept: list[ImportedJoint]) -> list[str]:
    """Return what is dropped, one sentence each."""
    lines, spread = [], max((abs(float(body.centre[1])) for body in mechanism.bodies if body.mass), default=0.0)
    for body in mechanism.bodies:
        for joint in body.joints:
            axis = ", ".join(f"{value:.3g}" for value in joint.axis)
            if joint not in kept and joint.kind != "free":
                lines.append(f"Joint {joint.name!r} ({joint.kind}, axis {axis}) is fixed in its zero position.")
            elif joint.limits is not None:
                low, high = joint.limits
                lines.append(f"The range of joint {joint.name!r}, {low:.4g} to {high:.4g}, is omitted.")
            if joint in kept and joint.friction:
                lines.append(f"The dry friction of joint {joint.name!r}, {joint.friction:.4g}, is omitted.")
        if np.max(np.abs(body.inertia[1, [0, 2]])) > 1e-9 * (body.inertia[1, 1] + 1e-12):
            lines.append(f"The products of inertia of {body.name!r} with the lateral axis are omitted.")
    if spread:
        lines.append(f"Lateral distances of centres of mass, up to {spread:.3g} m, are omitted.")
    names = [joint.name for joint in kept]
    lines += [
        f"Actuator {label!r} acts on joint {joint!r}, which is fixed."
        for label, joint in mechanism.actuators.items()
        if joint not in names
    ]
    lines += [f"{count} {kind} are omitted." for kind, count in mechanism.others.items() if count]
    return lines
