"""Problems with published optima: monopod, compass with slipping double support, five links."""

from dataclasses import dataclass

import attrs
import casadi as ca
import numpy as np

from gaitopt import Collocation, Drawing, Margins, Parameter, PointContact, PointMass, RigidLink, Spring
from gaitopt.model.planar.planar_assembly import assemble_planar
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
from gaitopt.model.robots.kneed_walker import kneed_walker
from gaitopt.model.robots.monopod import monopod
from gaitopt.ocp import Objective, PlanarKeyframes, PlanarLimits, PlanarProblem

NONE = Margins(cone=0, impact_cone=0, slip_speed=0, separation=0, normal_force=0, touchdown_rate=0, touchdown_armed=0)
"""The published optima have no margins."""
LEG = 1.6


@dataclass(frozen=True)
class HopEffort(Objective):
    """Leg force and hip torque of the monopod."""

    name, unit, smooth, typical = "hop_effort", "N^2 m^2 s", True, 20.0

    def integrand(self, point):
        return 1e-3 * point.torque_of("leg") ** 2 + point.torque_of("hip") ** 2


def hop(sequence="foot stick > flight |", friction=1.0, clearance=0.0, intervals=(8, 24), margins=None):
    return PlanarProblem(
        robot=monopod(),
        sequence=sequence,
        friction=friction,
        speed=1.5,
        step_length=0.6,
        objective=HopEffort(),
        limits=PlanarLimits(coordinate={"s": (0.35, 0.65)}, clearance=clearance),
        margins=margins or attrs.evolve(NONE, touchdown_rate=0.1),
        transcription=Collocation(intervals=intervals),
    )


@dataclass(frozen=True)
class FlatEffort(Objective):
    """Leg force and ankle torque of the hopper with a flat foot."""

    name, unit, smooth, typical = "flat_effort", "N^2 m^2 s", True, 10.0

    def integrand(self, point):
        return 1e-3 * point.torque_of("leg") ** 2 + point.torque_of("ankle") ** 2


def flat_foot_hopper():
    """A body on a springy leg with an ankle and a flat foot, whose heel and toe are one group; angles clockwise."""
    c = PlanarCoordinates(
        ("x", "y", "foot", "a", "s"), [Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration")]
    )
    ankle, foot = ca.vertcat(c.coordinate("x"), c.coordinate("y")), c.coordinate("foot")
    angle, length = c.coordinate("a"), c.coordinate("s")
    along, below = ca.vertcat(ca.cos(foot), -ca.sin(foot)), -ca.vertcat(ca.sin(foot), ca.cos(foot))
    body = ankle + length * ca.vertcat(ca.sin(angle), ca.cos(angle))
    ends = {"heel": ankle - 0.07 * along + 0.05 * below, "toe": ankle + 0.13 * along + 0.05 * below}
    return assemble_planar(
        "flat_foot_hopper",
        c,
        bodies=[RigidLink(8.0, body, 0.3, angle), RigidLink(1.0, ankle + 0.03 * (along + below), 0.01, foot)],
        contacts={name: PointContact(point, body="foot") for name, point in ends.items()},
        actuators={"leg": length, "ankle": angle - foot},
        forces=[Spring(length, 3000.0, 0.6)],
    )


def roll_off():
    """A hop that lands on the whole foot and leaves the ground with the toe."""
    return PlanarProblem(
        robot=flat_foot_hopper(),
        sequence="heel stick, toe stick > toe stick > flight |",
        friction=0.8,
        speed=1.0,
        step_length=0.3,
        objective=FlatEffort(),
        limits=PlanarLimits(coordinate={"s": (0.35, 0.65), "a": (-0.8, 0.8), "foot": (-0.8, 1.2)}, clearance=2e-3),
        margins=Margins(touchdown_rate=0.1, slip_speed=0, normal_force=0, cone=0.03),
        transcription=Collocation(intervals=(8, 10, 16)),
    )


def walk(sequence="stick | stick", **changes):
    options = {
        "friction": 1.0,
        "speed": 0.633,
        "step_length": 0.4713,
        "objective": "torque_squared",
        "limits": PlanarLimits(torque={"ankle B": 0}),
        "margins": NONE,
        "transcription": Collocation(intervals=40),
    }
    return PlanarProblem(robot=compass_with_two_feet(), sequence=sequence, **(options | changes))


def drag(double=0.45, drag=0.35, period=1.8852, step=0.4713):
    """The trailing foot is dragged forward by `drag` metres, for `double` seconds."""
    x = np.array([-step / 2, (drag - step) / 2, step / 2])
    angles = {"a": np.arcsin([x[0] / LEG, x[1] / LEG, step / 2 / LEG]), "b": -np.arcsin(x / LEG)}
    coordinates = {"x": x - x[0], "y": np.sqrt(LEG**2 - x**2), **angles}
    return walk(
        "foot A slip+, foot B stick > foot B stick |",
        friction=0.4,
        speed=0.25,
        limits=PlanarLimits(torque={"ankle A": 0}),
        guess=PlanarKeyframes((0, double, period), coordinates, phases=(double, period - double)),
        transcription=Collocation(intervals=(8, 16)),
    )


def knee_strike():
    """A step downhill from a guess with a bent swing knee."""
    stance = np.array([0.2386, 0.07, -0.03, -0.13, -0.2386])
    coordinates = {
        "x": np.sin(stance[0]) - np.sin(stance),
        "y": np.cos(stance),
        "a": stance,
        "flexion_a": np.zeros(5),
        "b": (-0.2386, 0.1, 0.25, 0.3, 0.2386),
        "flexion_b": (0, 0.45, 0.4, 0, 0),
    }
    return PlanarProblem(
        robot=kneed_walker(),
        sequence="foot A stick, knee A latched | foot A stick, knee A latched, knee B latched |",
        slope=0.0504,
        objective="torque_squared",
        guess=PlanarKeyframes((0, 0.15, 0.25, 0.35, 0.56), coordinates, phases=(0.35, 0.21)),
        limits=PlanarLimits(torque={"knee A": 0, "knee B": 0}, clearance=0),
        margins=attrs.evolve(NONE, touchdown_rate=1e-3),
        transcription=Collocation(intervals=(20, 12)),
    )


def five_link():
    """A walker of the size of RABBIT; thigh angles from straight down, positive forward, knees bent positive."""
    c = PlanarCoordinates(
        ("x", "y", "torso", "thigh_a", "knee_a", "thigh_b", "knee_b"),
        [Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration")],
    )
    hip, torso = ca.vertcat(c.coordinate("x"), c.coordinate("y")), c.coordinate("torso")
    bodies = [RigidLink(12.0, hip + 0.24 * ca.vertcat(ca.sin(torso), ca.cos(torso)), 1.33, torso)]
    contacts, actuators, knees = {}, {}, {}
    for leg in "ab":
        thigh, bend = c.coordinate(f"thigh_{leg}"), c.coordinate(f"knee_{leg}")
        along = ca.vertcat(ca.sin(thigh), -ca.cos(thigh))
        below = ca.vertcat(ca.sin(thigh - bend), -ca.cos(thigh - bend))
        knee = hip + 0.4 * along
        bodies += [RigidLink(6.8, hip + 0.11 * along, 0.47, -thigh)]
        bodies += [RigidLink(3.2, knee + 0.24 * below, 0.20, bend - thigh)]
        contacts[f"foot {leg.upper()}"] = PointContact(knee + 0.4 * below)
        knees[f"knee point {leg.upper()}"] = knee
        actuators |= {f"hip {leg.upper()}": thigh + torso, f"knee {leg.upper()}": bend}
    pairs = ("thigh", "knee")
    mirror = {f"{name}_a": f"{name}_b" for name in pairs} | {
        f"{name} A": f"{name} B" for name in ("foot", "hip", "knee")
    }
    drawing = Drawing({"hip": hip, **knees, **{name: contact.position for name, contact in contacts.items()}})
    return assemble_planar(
        "five_link", c, bodies=bodies, contacts=contacts, actuators=actuators, mirror=mirror, drawing=drawing
    )


def walker_of(links):
    """A walker with `links` links: a torso and two legs whose links have absolute angles from straight down."""
    names = {leg: [f"{leg}{k}" for k in range((links - 1) // 2)] for leg in "ab"}
    gravity = Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration")
    c = PlanarCoordinates(("x", "y", "torso", *names["a"], *names["b"]), [gravity])
    hip, torso, length = ca.vertcat(c.coordinate("x"), c.coordinate("y")), c.coordinate("torso"), 0.8 / len(names["a"])
    bodies = [RigidLink(12.0, hip + 0.24 * ca.vertcat(ca.sin(torso), ca.cos(torso)), 1.33, torso)]
    contacts, actuators, mass = {}, {}, 10.0 / len(names["a"])
    for leg, angles in names.items():
        joint, before = hip, -torso
        for k, name in enumerate(angles):
            angle = c.coordinate(name)
            along = length * ca.vertcat(ca.sin(angle), -ca.cos(angle))
            bodies.append(RigidLink(mass, joint + 0.4 * along, mass * length**2 / 6, -angle))
            actuators[f"joint {k} {leg.upper()}"] = angle - before
            joint, before = joint + along, angle
        contacts[f"foot {leg.upper()}"] = PointContact(joint)
    mirror = {"foot A": "foot B"} | {f"a{k}": f"b{k}" for k in range(len(names["a"]))}
    mirror |= {f"joint {k} A": f"joint {k} B" for k in range(len(names["a"]))}
    return assemble_planar(
        f"walker of {links} links", c, bodies=bodies, contacts=contacts, actuators=actuators, mirror=mirror
    )


def march(links, **changes):
    robot = walker_of(links)
    bounds = dict.fromkeys(robot.coordinates[3:], (-1, 1.2)) | {"torso": (-1, 1)}
    options = {
        "friction": 0.6,
        "limits": PlanarLimits(coordinate=bounds),
        "margins": attrs.evolve(NONE, touchdown_rate=0.05),
        "transcription": Collocation(intervals=12, tolerance=np.inf),
    }
    return PlanarProblem(
        robot=robot,
        sequence="stick | stick",
        speed=0.7,
        step_length=0.4,
        objective="torque_squared",
        **(options | changes),
    )


def stride(**changes):
    bounds = {"torso": (-1, 1), **dict.fromkeys(("thigh_a", "thigh_b"), (-1, 1.2))}
    options = {
        "friction": 0.6,
        "limits": PlanarLimits(coordinate=bounds | dict.fromkeys(("knee_a", "knee_b"), (0.02, 2)), clearance=0),
        "margins": attrs.evolve(NONE, touchdown_rate=0.05),
        "transcription": Collocation(intervals=12, tolerance=np.inf),
    }
    return PlanarProblem(
        robot=five_link(),
        sequence="stick | stick",
        speed=0.7,
        step_length=0.4,
        objective="torque_squared",
        **(options | changes),
    )


def inchworm(sequence):
    """Two feet on a telescopic body with a shifting weight, which slide in turn without impact."""
    c = PlanarCoordinates(
        ("x", "y", "tilt", "gap", "w"), [Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration")]
    )
    x, y, tilt, gap, w = (c.coordinate(name) for name in ("x", "y", "tilt", "gap", "w"))
    rear, along = ca.vertcat(x, y), ca.vertcat(ca.cos(tilt), ca.sin(tilt))
    front, weight = rear + gap * along, rear + w * along + 0.1 * ca.vertcat(-ca.sin(tilt), ca.cos(tilt))
    robot = assemble_planar(
        "inchworm",
        c,
        bodies=[PointMass(1.0, rear), PointMass(1.0, front), PointMass(3.0, weight)],
        contacts={"rear": PointContact(rear), "front": PointContact(front)},
        actuators={"stretch": gap, "shift": w},
        drawing=Drawing(links=[("rear", "front")]),
    )
    return PlanarProblem(
        robot=robot,
        sequence=sequence,
        friction=0.3,
        speed=(0.01, 1),
        step_length=0.05,
        objective="torque_squared",
        limits=PlanarLimits(torque=200, coordinate={"gap": (0.2, 0.5), "w": (-0.1, 0.6)}),
        transcription=Collocation(intervals=10),
    )
