"""Assembly and checks of planar robots with any contacts."""

import math

import casadi as ca
import numpy as np
import pytest

from gaitopt import compass_biped
from gaitopt.errors import InputError
from gaitopt.model import (
    ArcContact,
    Drawing,
    JointStop,
    PointContact,
    PointMass,
    RigidLink,
    RotorInertia,
    Spring,
    SwitchedSpring,
    assemble_planar,
    check_planar,
    compass_with_torso,
    compass_with_two_feet,
    flat_foot_walker,
    kneed_walker,
    monopod,
    quadruped,
    round_foot_walker,
    spoked_wheel,
    telescoping_biped,
    vertical_hopper,
)
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.mechanics import describe_massless
from gaitopt.model.planar.mirror import make_mirror
from gaitopt.model.planar.phase_system import make_phase_system
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.parameters import Parameter

GRAVITY = Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration", lower=0.0)
CATALOGUE = (
    compass_with_torso,
    compass_with_two_feet,
    flat_foot_walker,
    kneed_walker,
    monopod,
    quadruped,
    round_foot_walker,
    spoked_wheel,
    telescoping_biped,
    vertical_hopper,
)


def biped(c=None, *, mirror=None, contacts=None, **parts):
    """Assemble a robot with two point feet in fixed places below its hip; arguments replace its parts."""
    c = c or PlanarCoordinates(("x", "y", "a", "b"), [GRAVITY])
    hip = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    feet = {name: hip + ca.vertcat(ca.sin(c.coordinate(name)), -ca.cos(c.coordinate(name))) for name in ("a", "b")}
    bodies = parts.pop(
        "bodies", [PointMass(1.0, hip), *(PointMass(0.5, hip + (foot - hip) / 2) for foot in feet.values())]
    )
    contacts = contacts or {f"foot {name}": PointContact(foot) for name, foot in feet.items()}
    return assemble_planar("biped", c, bodies=bodies, contacts=contacts, mirror=mirror, **parts)


@pytest.mark.parametrize("make", CATALOGUE)
def test_the_catalogue_passes_its_check(make):
    check = check_planar(make())
    assert check.passed, check
    assert check.least_eigenvalue > 1e-4
    assert max(check.energy, check.contacts) < 1e-7
    assert max(check.travel, check.mirror) < 1e-13


def test_the_compass_has_the_energy_of_the_single_support_robot():
    """The same robot in other coordinates: foot = hip - l (sin th1, cos th1), a = -th1, b = th2."""
    th, rates, length = np.array([0.2, -0.3]), np.array([0.7, -1.1]), 1.6
    robot, single = compass_with_two_feet(), compass_biped()
    q = [length * np.sin(th[0]), length * np.cos(th[0]), -th[0], th[1]]
    v = [length * np.cos(th[0]) * rates[0], -length * np.sin(th[0]) * rates[0], -rates[0], rates[1]]
    energies = [
        [float(part) for part in each.energy(*state, each.vector(each.resolve({"slope": 0.1})))]
        for each, state in ((robot, (q, v)), (single, ([0, 0, *th], [0, 0, *rates])))
    ]
    assert energies[0] == pytest.approx(energies[1], rel=1e-13)


def test_a_mirror_exchanges_by_name_and_sign():
    mirror = make_mirror(
        {"left": "-right", "tilt": "-tilt", "foot l": "foot r"},
        ["x", "left", "right", "tilt"],
        ["foot l", "foot r"],
        ["left", "right"],
    )
    assert (mirror.coordinates @ [1, 2, 3, 4]).tolist() == [1, -3, -2, -4]
    assert mirror.actuators.tolist() == [[0, -1], [-1, 0]]
    assert mirror.contacts == (1, 0)
    assert np.array_equal(mirror.coordinates @ mirror.coordinates, np.eye(4))


@pytest.mark.parametrize(
    ("pairs", "message"),
    [
        ({"left": "knee"}, "exchanges 'left' with 'knee', which are not two coordinates"),
        ({"foot l": "foot rr"}, r"Did you mean 'foot r'\?"),
        ({"foot ll": "foot r"}, r"Did you mean 'foot l'\?"),
        ({"left": "foot l"}, "two actuators. Known: x, left, right, foot l, foot r"),
        ({"left": "right", "right": "x"}, "exchanges 'right' with both 'left' and 'x'"),
        ({"foot l": "-foot r"}, "reverses the sign of contact 'foot r'"),
    ],
)
def test_wrong_mirrors_are_rejected(pairs, message):
    with pytest.raises(InputError, match=message):
        make_mirror(pairs, ["x", "left", "right"], ["foot l", "foot r"], [])


@pytest.mark.parametrize(
    ("coordinates", "actuators", "kinds"),
    [
        (["x"], ["a", "b"], "an actuator"),
        (["a", "b"], [], "a coordinate"),
        (["a", "b"], ["a", "b"], "a coordinate and of an actuator"),
    ],
)
def test_a_sign_that_a_contact_shares_with_another_quantity_of_its_name_is_explained(coordinates, actuators, kinds):
    reason = (
        rf"sign of contact '[ab]'; contacts are exchanged without a sign, but '[ab]' is also the name of {kinds}: give"
    )
    with pytest.raises(InputError, match=reason):
        make_mirror({"a": "-b"}, coordinates, ["a", "b"], actuators)
    with pytest.raises(InputError, match=r"exchanged without a sign\.$"):
        make_mirror({"a": "-b"}, ["x"], ["a", "b"], [])


def test_a_length_that_is_nan_is_named_instead_of_the_mirror():
    c = PlanarCoordinates(("x", "y", "a", "b"), [GRAVITY])
    hip = ca.vertcat(c.coordinate("x"), c.coordinate("y"))

    def walker(length):
        directions = {name: ca.vertcat(ca.sin(c.coordinate(name)), -ca.cos(c.coordinate(name))) for name in "ab"}
        contacts = {
            "foot a": PointContact(hip + directions["a"]),
            "foot b": PointContact(hip + length * directions["b"]),
        }
        return biped(c, mirror={"a": "b", "foot a": "foot b"}, contacts=contacts)

    with pytest.raises(InputError, match="position of contact 'foot b' contains nan: either a number in it is nan, or"):
        walker(math.nan)
    (fault,) = check_planar(walker(ca.log(-1 - c.coordinate("b") ** 2))).faults
    assert "the equations of motion are not finite (nan): check that every mass, length, position" in fault


POINT = r"must be a point of the plane, ca.vertcat\(x, y\) of shape \(2, 1\), got shape "
SCALAR = r"must be a single expression or number of shape \(1, 1\), got shape \(2, 1\): \[x, y\]"


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (
            lambda hip, a: {"contacts": {"foot": PointContact(ca.vertcat(hip, 0))}},
            r"position of contact 'foot' " + POINT,
        ),
        (lambda hip, a: {"contacts": {"foot": PointContact(hip[1])}}, r"position of contact 'foot' " + POINT),
        (lambda hip, a: {"contacts": {"foot": PointContact(hip.T)}}, r"position of contact 'foot' " + POINT),
        (lambda hip, a: {"contacts": {"foot": PointContact(hip, armed=hip)}}, "armed of contact 'foot' " + SCALAR),
        (lambda hip, a: {"contacts": {"arc": ArcContact(hip, hip, a)}}, "radius of contact 'arc' " + SCALAR),
        (lambda hip, a: {"contacts": {"stop": JointStop(hip)}}, "gap of contact 'stop' " + SCALAR),
        (
            lambda hip, a: {"bodies": [PointMass(1, hip), PointMass(1, hip[1])]},
            "position of body 2 " + POINT,
        ),
        (lambda hip, a: {"bodies": [RigidLink(1, hip, 0.1, hip)]}, "angle of body 1 " + SCALAR),
        (lambda hip, a: {"actuators": {"motor": hip}}, "actuator 'motor' " + SCALAR),
        (lambda hip, a: {"forces": [Spring(a, 1), Spring(hip, 1)]}, "coordinate of force 2 " + SCALAR),
        (lambda hip, a: {"drawing": Drawing({"head": ca.vertcat(hip, 0)})}, "point 'head' " + POINT),
        (
            lambda hip, a: {"bodies": [PointMass(1, hip + ca.vertcat(math.sin(a), -math.cos(a)))]},
            "position of body 1 contains nan: .* a function of the module math .*: use that of casadi",
        ),
    ],
)
def test_expressions_of_a_wrong_shape_or_of_the_module_math_are_named(part, message):
    c = PlanarCoordinates(("x", "y", "a", "b"), [GRAVITY])
    hip = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    with pytest.raises(InputError, match=f"Robot 'biped': {message}"):
        biped(c, **part(hip, c.coordinate("a")))


def test_a_mirror_that_misses_a_contact_is_a_fault():
    assert check_planar(biped(mirror={"a": "b", "foot a": "foot b"})).passed
    assert "the mirror must not change the equations" in check_planar(biped(mirror={"a": "b"})).faults[0]
    assert "the mirror must not change the equations" in check_planar(biped(mirror={"foot a": "foot b"})).faults[0]


def test_stops_released_by_the_wrong_contact_are_a_fault():
    c = PlanarCoordinates(("x", "y", "a", "b"), [GRAVITY])
    feet = {
        name: PointContact(ca.vertcat(c.coordinate("x"), c.coordinate("y") - ca.cos(c.coordinate(name))))
        for name in "ab"
    }
    stops = {f"stop {name}": JointStop(1 - c.coordinate(name), latched=True, released_by="a opens") for name in "ab"}
    robot = biped(c, contacts={**feet, **stops}, mirror={"a": "b", "stop a": "stop b"})
    assert any("not released by exchanged contacts" in fault for fault in check_planar(robot).faults)


def test_a_contact_that_never_closes_is_a_fault():
    c = PlanarCoordinates(("x", "y"), [GRAVITY])
    place = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    contacts = {"sole": PointContact(place), "tip": PointContact(place, armed=ca.SX(-1.0))}
    robot = assemble_planar("ball", c, bodies=[PointMass(1.0, place)], contacts=contacts)
    (fault,) = check_planar(robot).faults
    assert "contact 'tip' never closes, because `armed` is -1 in every state" in fault


def test_a_massless_link_is_a_fault():
    c = PlanarCoordinates(("x", "y", "a", "b"), [GRAVITY])
    hip = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    assert check_planar(biped(c, bodies=[PointMass(1.0, hip)])).faults == (
        "Robot 'biped': the mass matrix is singular, because no mass or inertia moves with 'a', 'b'; every coordinate "
        "needs a mass or an inertia.",
    )


def test_coordinates_that_move_no_mass_together_are_named():
    """A link without mass between two others moves when the next joint turns back by the same angle."""
    rows = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 1.0]])  # of the moving masses
    assert describe_massless(rows.T @ rows, ["x", "knee", "ankle"]).endswith("in some motion of 'knee', 'ankle'")


def test_an_inertia_without_mass_is_rejected_and_a_rotor_is_not():
    c = PlanarCoordinates(("x", "y", "a"))
    place, angle = ca.vertcat(c.coordinate("x"), c.coordinate("y")), c.coordinate("a")

    def assemble_wheel(*bodies, forces=()):
        return assemble_planar(
            "wheel", c, bodies=[PointMass(2.0, place), *bodies], contacts={"rim": PointContact(place)}, forces=forces
        )

    with pytest.raises(InputError, match=r"Body 2, which turns with 'a': a RigidLink with an inertia of 0.1"):
        assemble_wheel(RigidLink(0, place, 0.1, angle))
    assert assemble_wheel(RigidLink(0, place, 0, angle)).n_q == 3
    assert check_planar(assemble_wheel(forces=[RotorInertia(angle, 0.1)])).passed


def test_a_negative_mass_is_named_by_its_sign_and_its_body():
    place = ca.vertcat(ca.SX.sym("x"), ca.SX.sym("y"))
    far = place + 3.25 * ca.vertcat(ca.sin(ca.SX.sym("a") + ca.SX.sym("b")), ca.cos(ca.SX.sym("thigh_angle")))
    for make, message in (
        (
            lambda: RigidLink(-0.5, place, 0.1, 0.0),
            r"RigidLink at \[x, y\]: mass must not be negative \[kg\], got -0.5",
        ),
        (
            lambda: RigidLink(0.5, place, ca.SX(-0.1), 0.0),
            r"RigidLink at \[x, y\]: inertia must not be negative \[kg m\^2\], got -0.1",
        ),
        (lambda: PointMass(-6, place), r"PointMass at \[x, y\]: mass must not be negative \[kg\], got -6"),
        (lambda: PointMass(-6, far + far**2), "PointMass whose position depends on .*, thigh_angle: mass must not be"),
        (lambda: PointMass(math.nan, place), r"\[x, y\]: mass must be finite \[kg\], got nan: either .* casadi.sin"),
        (lambda: PointMass(math.inf, place), r"PointMass at \[x, y\]: mass must be finite \[kg\], got inf\.$"),
    ):
        with pytest.raises(InputError, match=message):
            make()
    c = PlanarCoordinates(("x", "y", "a", "b"), [GRAVITY, Parameter("leg_mass", 2.0, "kg", "mass of a leg", lower=-9)])
    place = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    with pytest.raises(InputError, match=r"mass of body 1 must .* got -4 with the default .* \(leg_mass = 2 kg\)\.$"):
        biped(c, bodies=[PointMass(-2 * c.parameter("leg_mass"), place)])
    with pytest.raises(InputError, match=r"Robot 'biped': mass of body 1 must .* got -6 for leg_mass = -6 kg\.$"):
        check_planar(biped(c, bodies=[PointMass(c.parameter("leg_mass"), place)]), {"leg_mass": -6})
    variable = c.parameter("leg_mass") * (2 + ca.sin(c.coordinate("a")))
    link = RigidLink(1.0, place, variable, c.coordinate("a"))
    (fault,) = check_planar(biped(c, bodies=[link]), {"leg_mass": -6}).faults
    assert fault.endswith("a mass or an inertia that moves with 'a' is negative (leg_mass = -6 kg).")
    with pytest.raises(InputError, match=r"Robot 'biped': mass of body 1 must not depend on coordinates"):
        biped(c, bodies=[PointMass(variable, place)])


@pytest.mark.parametrize("armed", [0.05, -1, True])
def test_a_contact_is_not_armed_by_a_number(armed):
    place = ca.vertcat(ca.SX.sym("x"), ca.SX.sym("y"))
    with pytest.raises(InputError, match=r"PointContact: armed must be an expression.*without armed, the contact can"):
        PointContact(place, armed=armed)
    with pytest.raises(InputError, match=r"ArcContact: armed must be an expression"):
        ArcContact(place, 0.1, ca.SX.sym("angle"), armed=armed)


@pytest.mark.filterwarnings("error")
def test_a_robot_without_mass_is_a_fault():
    c = PlanarCoordinates(("x", "y", "a", "b"), [GRAVITY])
    check = check_planar(biped(c, bodies=[PointMass(0.0, ca.vertcat(c.coordinate("x"), c.coordinate("y")))]))
    assert "the mass matrix is singular" in check.faults[0]
    assert check.least_eigenvalue == 0


def test_a_coordinate_of_travel_that_turns_the_robot_is_a_fault():
    c = PlanarCoordinates(("x", "y", "a", "b"), [GRAVITY], travel="a")
    assert "the motion depends on the position" in check_planar(biped(c)).faults[0]
    assert PlanarCoordinates(("y",), [GRAVITY]).travel is None


def test_errors_of_the_assembly_state_what_is_accepted():
    stranger = ca.SX.sym("stranger")
    c = PlanarCoordinates(("x", "y", "a", "b"), [GRAVITY])
    with pytest.raises(InputError, match="position of contact 'foot' depends on a symbol 'stranger' that does not"):
        biped(c, contacts={"foot": PointContact(ca.vertcat(c.coordinate("x"), stranger))})
    with pytest.raises(InputError, match="must be a PointContact, an ArcContact or a JointStop, got 3"):
        biped(c, contacts={"foot": 3})
    with pytest.raises(InputError, match="released_by of stop 'knee' must be 'CONTACT opens' or 'CONTACT closes'"):
        biped(c, contacts={"knee": JointStop(c.coordinate("a"), latched=True, released_by="foot lands")})
    with pytest.raises(InputError, match="Stop 'knee' refers to 'foot', which is not a contact"):
        biped(c, contacts={"knee": JointStop(c.coordinate("a"), latched=True, released_by="foot opens")})
    with pytest.raises(InputError, match="A switched spring refers to 'foot', which is not a contact"):
        biped(c, forces=[SwitchedSpring(c.coordinate("y"), 1, 1, 0.1, contact="foot")])
    with pytest.raises(InputError, match="There is no coordinate 'c'"):
        c.coordinate("c")
    with pytest.raises(InputError, match="Coordinates must have different names"):
        PlanarCoordinates(("x", "x"), [GRAVITY])
    with pytest.raises(InputError, match=r"Parameters must have different names, got 'gravity' twice\."):
        PlanarCoordinates(("x",), [GRAVITY, GRAVITY])
    with pytest.raises(InputError, match=r"got 'slope' twice; 'slope', .* are names of the ground's parameters\."):
        PlanarCoordinates(("x",), [GRAVITY, Parameter("slope", 0.1, "rad", "slope")])
    with pytest.raises(InputError, match="must include 'gravity'"):
        PlanarCoordinates(("x",), [])
    with pytest.raises(InputError, match="coordinates must be PlanarCoordinates"):
        assemble_planar("robot", None, bodies=[], contacts={})
    with pytest.raises(InputError, match="has no contact 'toe'"):
        monopod().contact_index("toe")


def test_accelerations_and_forces_satisfy_the_equations_of_a_phase():
    """A wheel that rolls down a slope without slip, and one that slips: closed forms."""
    c = PlanarCoordinates(("x", "y", "angle"), [GRAVITY])
    centre, angle, radius, inertia = ca.vertcat(c.coordinate("x"), c.coordinate("y")), c.coordinate("angle"), 0.3, 0.05
    wheel = assemble_planar(
        "wheel", c, bodies=[RigidLink(2.0, centre, inertia, angle)], contacts={"rim": ArcContact(centre, radius, angle)}
    )
    slope, friction = 0.2, 0.1
    p = wheel.vector(wheel.resolve({"slope": slope, "friction": friction}))
    for mode, rates in (("stick", [0.6, 0, 2.0]), ("slip+", [1.0, 0, 2.0])):
        system = make_phase_system(wheel, ContactState.of({"rim": mode}), False).system
        matrix, right = (np.array(part) for part in system([0, radius, 0], rates, [], p))
        z = np.linalg.solve(matrix, right).ravel()
        along = 9.81 * np.sin(slope)
        if mode == "stick":
            assert z[0] == pytest.approx(along / (1 + inertia / (2 * radius**2)), rel=1e-13)
        else:
            assert z[0] == pytest.approx(along - friction * 9.81 * np.cos(slope), rel=1e-13)
            assert z[2] == pytest.approx(friction * 2 * 9.81 * np.cos(slope) * radius / inertia, rel=1e-13)
        assert z[3] == pytest.approx(2 * 9.81 * np.cos(slope), rel=1e-13)


def test_a_condition_that_is_rarely_positive_is_no_fault():
    c = PlanarCoordinates(("x", "y"), [GRAVITY])
    place = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    contact = PointContact(place, armed=ca.if_else(c.coordinate("x") > 50, 1, -1))
    assert check_planar(assemble_planar("ball", c, bodies=[PointMass(1.0, place)], contacts={"sole": contact})).passed


def test_links_of_a_drawing_end_at_its_points_or_at_contacts():
    c = PlanarCoordinates(("x", "y", "a", "b"), [GRAVITY])
    hip = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    head = hip + ca.vertcat(0, 0.5)
    robot = biped(c, drawing=Drawing({"hip": hip, "head": head}, links=[("head", "hip", "foot a")]))
    assert robot.points == ("hip", "head", "foot a")
    assert robot.links == ((1, 0), (0, 2))
    message = r"a link ends at 'toe', which is not among the points\. .*Known: hip, foot a, foot b"
    with pytest.raises(InputError, match=message):
        biped(c, drawing=Drawing({"hip": hip}, links=[("hip", "toe")]))
