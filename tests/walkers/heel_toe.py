"""The walker with heel and toe of the guide, with another threshold of arming and slightly other bodies."""

import functools

import casadi as ca

from gaitopt import Collocation, Drawing, PointContact, PointMass, RigidLink
from gaitopt.model import PlanarCoordinates, assemble_planar
from gaitopt.ocp import PlanarLimits, PlanarProblem


@functools.cache
def heel_toe_walker(threshold):
    """Return the walker whose feet are armed from an angle between the legs [rad]."""
    c = PlanarCoordinates(("x", "y", "a", "b"))
    hip = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    bodies, contacts = [PointMass(12.0, hip)], {"hip": PointContact(hip, falls=True)}
    for leg, other in ("ab", "ba"):
        angle = c.coordinate(leg)
        down, ahead = ca.vertcat(ca.sin(angle), -ca.cos(angle)), ca.vertcat(ca.cos(angle), ca.sin(angle))
        bodies.append(RigidLink(2.5, hip + 0.5 * down, 0.1, -angle))
        armed = angle - c.coordinate(other) - threshold
        for name, distance in (("heel", -0.05), ("toe", 0.09)):
            contacts[f"{name} {leg}"] = PointContact(hip + down + distance * ahead, body=f"foot {leg}", armed=armed)
    return assemble_planar(
        "heel-toe walker",
        c,
        bodies=bodies,
        contacts=contacts,
        actuators={"motor": c.coordinate("a") - c.coordinate("b")},
        mirror={"a": "b", "heel a": "heel b", "toe a": "toe b", "motor": "-motor"},
        drawing=Drawing(links=[("hip", f"heel {leg}", f"toe {leg}", "hip") for leg in "ab"]),
    )


def heel_toe_step(threshold, intervals=6, **limits):
    """Return the problem of a step down a slope that lands on the heel and rolls onto the toe."""
    return PlanarProblem(
        robot=heel_toe_walker(threshold),
        sequence="heel a stick | toe a stick |",
        slope=0.03,
        friction=0.8,
        speed=0.9,
        step_length=0.45,
        objective="torque_squared",
        limits=PlanarLimits(torque=60, **limits),
        transcription=Collocation(intervals=intervals),
    )
