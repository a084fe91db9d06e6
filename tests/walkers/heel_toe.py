"""The walker with heel and toe of the guide, with other thresholds of arming, bodies and feet."""

import functools
from typing import NamedTuple

import casadi as ca

from gaitopt import Collocation, Drawing, PointContact, PointMass, RigidLink
from gaitopt.model import PlanarCoordinates, assemble_planar
from gaitopt.ocp import PlanarLimits, PlanarProblem


class Build(NamedTuple):
    """Masses [kg], moment of inertia of a leg [kg m^2], lengths [m] and torque limit [N m] of a walker."""

    hip_mass: float = 12.0
    leg_mass: float = 2.5
    leg_inertia: float = 0.1
    leg_length: float = 1.0
    leg_com: float = 0.5
    heel: float = -0.05
    toe: float = 0.09
    torque: float = 60.0


LIGHT = Build()
HEAVY = Build(40.0, 6.0, 0.35, 0.9, 0.38, -0.06, 0.14, 80.0)


@functools.cache
def heel_toe_walker(threshold, build=LIGHT):
    """Return the walker whose feet are armed from an angle between the legs [rad]."""
    c = PlanarCoordinates(("x", "y", "a", "b"))
    hip = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    bodies, contacts = [PointMass(build.hip_mass, hip)], {"hip": PointContact(hip, falls=True)}
    for leg, other in ("ab", "ba"):
        angle = c.coordinate(leg)
        down, ahead = ca.vertcat(ca.sin(angle), -ca.cos(angle)), ca.vertcat(ca.cos(angle), ca.sin(angle))
        bodies.append(RigidLink(build.leg_mass, hip + build.leg_com * down, build.leg_inertia, -angle))
        armed = angle - c.coordinate(other) - threshold
        for name, distance in (("heel", build.heel), ("toe", build.toe)):
            place = hip + build.leg_length * down + distance * ahead
            contacts[f"{name} {leg}"] = PointContact(place, body=f"foot {leg}", armed=armed)
    return assemble_planar(
        "heel-toe walker",
        c,
        bodies=bodies,
        contacts=contacts,
        actuators={"motor": c.coordinate("a") - c.coordinate("b")},
        mirror={"a": "b", "heel a": "heel b", "toe a": "toe b", "motor": "-motor"},
        drawing=Drawing(links=[("hip", f"heel {leg}", f"toe {leg}", "hip") for leg in "ab"]),
    )


def heel_toe_step(threshold, intervals=6, build=LIGHT, **limits):
    """Return the problem of a step down a slope that lands on the heel and rolls onto the toe."""
    return PlanarProblem(
        robot=heel_toe_walker(threshold, build),
        sequence="heel a stick | toe a stick |",
        slope=0.03,
        friction=0.8,
        speed=0.9,
        step_length=0.45,
        objective="torque_squared",
        limits=PlanarLimits(torque=build.torque, **limits),
        transcription=Collocation(intervals=intervals),
    )
