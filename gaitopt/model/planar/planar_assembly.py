"""Assembly of a planar robot with any contacts from its symbolic description."""

import functools
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError, suggest
from gaitopt.lazy import Deferred
from gaitopt.locks import one_at_a_time
from gaitopt.model.assembly import Drawing
from gaitopt.model.contacts.contact import ArcContact, Contact
from gaitopt.model.expression_check import check_constants, check_shapes, check_symbols, label_parts
from gaitopt.model.forces import Force, Potential
from gaitopt.model.inertias import derive_inertias
from gaitopt.model.mechanics import Body, Mechanics, RigidLink, body_points, derive
from gaitopt.model.planar.contact_entry import FORCE_UNITS, ContactEntry
from gaitopt.model.planar.joint_stop import JointStop, SwitchedSpring
from gaitopt.model.planar.joint_sums import JointSums, find_joints
from gaitopt.model.planar.mirror import make_mirror
from gaitopt.model.planar.newton_euler import Balance, NewtonEuler, derive_newton_euler
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.planar.units import find_coordinate_units, find_unit

AnyContact = Contact | JointStop


@check_arguments
@one_at_a_time
def assemble_planar(
    name: str,
    coordinates: PlanarCoordinates,
    *,
    bodies: Sequence[Body],
    contacts: Mapping[str, AnyContact],
    actuators: Mapping[str, ca.SX] | None = None,
    forces: Sequence[Force | SwitchedSpring] = (),
    mirror: Mapping[str, str] | None = None,
    drawing: Drawing | None = None,
) -> PlanarRobot:
    """Assemble a planar robot, each contact of which is free, sticks or slips.

    Parameters
    ----------
    name : str
    coordinates : PlanarCoordinates
        The symbols of all expressions: a floating base, or any other minimal coordinates.
    bodies : sequence of PointMass or RigidLink
    contacts : mapping of str to PointContact, ArcContact or JointStop
        Everything that can close, by name.
    actuators : mapping of str to SX, optional
        The angle or length on which each actuator works [rad or m].
    forces : sequence of Spring, Damper, Potential, RotorInertia or SwitchedSpring
    mirror : mapping of str to str, optional
        Exchange of the legs: pairs of names of coordinates, contacts and actuators, with a leading minus sign where the
        sign is reversed.
    drawing : Drawing, optional
        Its links may also end at contacts.  By default the points of the contacts and the centres of mass of the
        bodies.

    Returns
    -------
    PlanarRobot

    Raises
    ------
    InputError
        If an expression contains other symbols, or a name is unknown.

    Examples
    --------
    A ball of radius 0.1 m:

    >>> from gaitopt.model import ArcContact, RigidLink
    >>> from gaitopt.parameters import Parameter
    >>> c = PlanarCoordinates(["x", "y", "angle"], [Parameter("gravity", 9.8, "m/s^2", "gravity")])
    >>> centre, angle = ca.vertcat(c.coordinate("x"), c.coordinate("y")), c.coordinate("angle")
    >>> ball = assemble_planar(
    ...     "ball", c, bodies=[RigidLink(1.0, centre, 0.004, angle)], contacts={"rim": ArcContact(centre, 0.1, angle)}
    ... )
    >>> ball.gaps([0, 0.3, 0], ball.vector(ball.resolve({})))[0]
    DM(0.2)
    """
    if not isinstance(coordinates, PlanarCoordinates):
        raise InputError(
            f"Robot {name!r}: coordinates must be PlanarCoordinates(names, parameters), got {coordinates!r}."
        )
    actuators, drawing = dict(actuators or {}), drawing or Drawing()
    labelled = _check_parts(name, (bodies, forces), contacts, actuators, drawing.points)
    places = _choose_points(bodies, contacts, drawing)
    units = _find_units(coordinates.q, bodies, contacts, places)
    entries = tuple(_entry(name, label, part, contacts, (coordinates.q, units)) for label, part in contacts.items())
    springs = [force for force in forces if isinstance(force, SwitchedSpring)]
    for spring in springs:
        _require_contact(name, "A switched spring", spring.contact, contacts)
    _check_links(name, {**places, **_list_feet(contacts)}, drawing.lines)
    symbols = ca.vertcat(*[ca.SX.sym(f"extended_{k}") for k in range(len(springs))]) if springs else ca.SX(0, 1)
    switched = [Potential(spring.energy(symbols[k])) for k, spring in enumerate(springs)]
    every = [*switched, *(force for force in forces if not isinstance(force, SwitchedSpring))]
    _check_expressions(name, labelled, contacts, coordinates)
    mechanics = derive(bodies, coordinates.q, coordinates.v, coordinates.gravity, every)
    index = {point: i for i, point in enumerate(places)}
    inputs = {"q": coordinates.q, "v": coordinates.v, "p": ca.vertcat(coordinates.p, symbols)}
    return PlanarRobot(
        name=name,
        coordinates=coordinates.names,
        actuators=tuple(actuators),
        units=units,
        actuator_units=tuple(FORCE_UNITS[find_unit(joint, coordinates.q, units)] for joint in actuators.values()),
        travel=coordinates.travel,
        parameters=coordinates.parameters,
        switches=tuple(spring.contact for spring in springs),
        contacts=entries,
        mirror=make_mirror(mirror, coordinates.names, tuple(contacts), tuple(actuators)) if mirror else None,
        points=tuple(places),
        links=tuple((index[a], index[b]) for a, b in drawing.lines),
        inertias=derive_inertias(name, labelled, coordinates.p, coordinates.parameters),
        **_motion(inputs, mechanics, actuators),
        **_contacts(inputs, list(contacts.values()), springs),
        **_newton_euler(inputs, mechanics, list(contacts.values()), actuators),
        figure=_later("figure", _without_rates(inputs), {"points": ca.horzcat(*places.values())}),
    )


def _list_feet(contacts: Mapping[str, AnyContact]) -> dict[str, ca.SX]:
    """Return the points of the contacts with the ground."""
    return {label: part.point for label, part in contacts.items() if isinstance(part, Contact)}


def _choose_points(bodies: Sequence[Body], contacts: Mapping[str, AnyContact], drawing: Drawing) -> dict[str, ca.SX]:
    """Return the points of a drawing with the contacts to which its links refer.

    Without points, those of the contacts and, without links, of the bodies, which show the size of the robot.
    """
    feet = _list_feet(contacts)
    if drawing.points:
        linked = {name for pair in drawing.lines for name in pair}
        return {**drawing.points, **{name: feet[name] for name in feet if name in linked - set(drawing.points)}}
    return feet if drawing.links else feet | body_points(bodies)


def _check_expressions(
    name: str,
    labelled: Mapping[str, ca.SX | float],
    contacts: Mapping[str, AnyContact],
    coordinates: PlanarCoordinates,
) -> None:
    """Raise InputError for a strange symbol, or a gap that depends on no coordinate."""
    check_symbols(name, labelled, coordinates, "c.coordinate(...) and c.parameter(...)")
    for label, part in contacts.items():
        if not ca.depends_on(ca.SX(part.gap), coordinates.q):
            raise InputError(
                f"Robot {name!r}: gap of contact {label!r} depends on no coordinate; remove or correct it."
            )


def _motion(inputs: dict[str, ca.SX], parts: Mechanics, actuators: Mapping[str, ca.SX]) -> dict[str, Any]:
    """Return the Functions of the equations of motion, energy and momentum."""
    q, v = inputs["q"], inputs["v"]
    joint = ca.jacobian(ca.vertcat(*actuators.values()), q) if actuators else ca.SX(0, q.numel())
    dynamics = {"mass_matrix": parts.mass_matrix, "bias": parts.bias, "actuation": joint.T}
    powers = {"elastic": parts.elastic, "dissipation": parts.dissipation}
    return {
        "dynamics": _later("dynamics", inputs, dynamics),
        "mass": _later("mass", {"p": inputs["p"]}, {"total_mass": parts.total_mass}),
        "energy": _later("energy", inputs, {"kinetic": parts.kinetic, "potential": parts.potential}),
        "momentum": _later("momentum", inputs, {"linear": parts.momentum, "angular": parts.angular_momentum}),
        "force_powers": _later("force_powers", inputs, powers),
        "joint_rates": _later("joint_rates", inputs, {"rates": joint @ v}),
    }


def _newton_euler(
    inputs: dict[str, ca.SX], mechanics: Mechanics, contacts: Sequence[AnyContact], actuators: Mapping[str, ca.SX]
) -> dict[str, Any]:
    """Return the equations without a mass matrix, recursive and lifted."""
    places = [part.coordinates if isinstance(part, Contact) else ca.vertcat(0, part.gap) for part in contacts]

    def build(*, lifted: bool) -> NewtonEuler:
        outputs = ca.vertcat(mechanics.entries, *places)
        sums = find_joints(outputs) if lifted else JointSums(ca.SX(0, 1), ca.SX(0, 1), ca.densify(outputs))
        angles = ca.vertcat(ca.SX(0, 1), *actuators.values())
        balance = Balance(mechanics.inertia, mechanics.gravity_accelerations, mechanics.resistance, angles)
        return derive_newton_euler(sums, balance, (inputs["q"], inputs["v"], inputs["p"]))

    return {name: Deferred(functools.partial(build, lifted=name == "lifted")) for name in ("recursive", "lifted")}


def _contacts(
    inputs: dict[str, ca.SX], contacts: Sequence[AnyContact], springs: Sequence[SwitchedSpring]
) -> dict[str, Any]:
    """Return the Functions of gaps, slide coordinates and their derivatives, and of the switches."""
    q, v = inputs["q"], inputs["v"]
    gap = ca.vertcat(*[part.gap for part in contacts])
    slide = ca.vertcat(*[part.slide if isinstance(part, Contact) else 0 for part in contacts])
    armed = [part.armed if isinstance(part, Contact) and part.armed is not None else 1 for part in contacts]
    nowhere = ca.DM.nan(4, 1)
    normal, tangent = ca.jacobian(gap, q), ca.jacobian(slide, q)
    rows = {
        "normal": normal,
        "tangent": tangent,
        "normal_bias": ca.jtimes(normal @ v, q, v),
        "tangent_bias": ca.jtimes(tangent @ v, q, v),
    }
    guards = ca.vertcat(*[-ca.jtimes(spring.coordinate, q, v) for spring in springs]) if springs else ca.SX(0, 1)
    rims = ca.horzcat(*[part.rim if isinstance(part, Contact) else nowhere for part in contacts])
    return {
        "gaps": _later("gaps", _without_rates(inputs), {"gap": gap, "slide": slide}),
        "rows": _later("rows", inputs, rows),
        "arming": _later("arming", inputs, {"armed": ca.vertcat(*armed)}),
        "switch_guards": _later("switch_guards", inputs, {"guard": guards}),
        "rims": _later("rims", _without_rates(inputs), {"rims": rims}),
    }


def _find_units(
    q: ca.SX, bodies: Sequence[Body], contacts: Mapping[str, AnyContact], places: Mapping[str, ca.SX]
) -> tuple[str, ...]:
    """Return the units of the coordinates."""
    feet = [part for part in contacts.values() if isinstance(part, Contact)]
    positions = [*(body.position for body in bodies), *(part.point for part in feet), *places.values()]
    turned = [body.angle for body in bodies if isinstance(body, RigidLink)]
    return find_coordinate_units(q, positions, [*turned, *(part.rim[3] for part in feet)])


def _entry(
    robot: str,
    name: str,
    part: AnyContact,
    contacts: Mapping[str, AnyContact],
    coordinates: tuple[ca.SX, tuple[str, ...]],
) -> ContactEntry:
    """Return a contact as plain data; `coordinates` are q and its units."""
    q, units = coordinates
    if isinstance(part, JointStop):
        release = _read_release(robot, name, part, contacts)
        unit = find_unit(part.gap, q, units)
        return ContactEntry(name, "stop", slides=False, latched=part.latched, released_by=release, unit=unit)
    if not isinstance(part, Contact):
        raise InputError(
            f"Robot {robot!r}: contact {name!r} must be a PointContact, an ArcContact or a JointStop, got {part!r}."
        )
    kind, slides = "arc" if isinstance(part, ArcContact) else "point", ca.jacobian(part.slide, q).nnz() > 0
    return ContactEntry(name, kind, slides, part.body or name, part.falls, part.armed is not None)


def _read_release(
    robot: str, name: str, stop: JointStop, contacts: Mapping[str, AnyContact]
) -> tuple[str, bool] | None:
    """Return the contact that releases a latched stop, and whether its opening does."""
    if not stop.released_by:
        return None
    contact, _, event = stop.released_by.rpartition(" ")
    if event not in ("opens", "closes") or not stop.latched:
        raise InputError(
            f"Robot {robot!r}: released_by of stop {name!r} must be 'CONTACT opens' or 'CONTACT closes', and the stop "
            f"latched, got {stop.released_by!r}."
        )
    _require_contact(robot, f"Stop {name!r}", contact, contacts)
    return contact, event == "opens"


def _require_contact(robot: str, owner: str, contact: str, contacts: Iterable[str]) -> None:
    if contact not in contacts:
        raise InputError(
            f"Robot {robot!r}: {owner} refers to {contact!r}, which is not a contact. {suggest(contact, contacts)}"
        )


def _check_links(robot: str, points: Mapping[str, ca.SX], links: Sequence[tuple[str, str]]) -> None:
    for point in (point for pair in links for point in pair):
        if point not in points:
            raise InputError(
                f"Robot {robot!r}: a link ends at {point!r}, which is not among the points. {suggest(point, points)}"
            )


def _check_parts(
    name: str,
    parts: tuple[Sequence[Body], Sequence[Force | SwitchedSpring]],
    contacts: Mapping[str, AnyContact],
    actuators: Mapping[str, ca.SX],
    drawn: Mapping[str, ca.SX],
) -> dict[str, ca.SX | float]:
    """Return all expressions of a robot by the labels of messages; raise InputError for an invalid shape or nan."""
    valid = {f"contact {label!r}": each for label, each in contacts.items() if isinstance(each, Contact | JointStop)}
    points, scalars = label_parts(*parts, valid)
    points |= {f"point {label!r}": expression for label, expression in drawn.items()}
    scalars |= {f"actuator {label!r}": joint for label, joint in actuators.items()}
    check_shapes(name, points, scalars)
    check_constants(name, points | scalars)
    return points | scalars


def _without_rates(inputs: dict[str, ca.SX]) -> dict[str, ca.SX]:
    return {"q": inputs["q"], "p": inputs["p"]}


def _later(label: str, inputs: dict[str, ca.SX], outputs: dict[str, ca.SX]) -> Deferred[ca.Function]:
    """Return a Function that is built at its first use."""

    def build() -> ca.Function:
        expressions = ca.cse([ca.densify(ca.SX(expression)) for expression in outputs.values()])
        return ca.Function(label, list(inputs.values()), expressions, list(inputs), list(outputs))

    return Deferred(build)
