"""The walker with heel and toe of docs/howto/custom_robot.md with other masses and lengths."""

import casadi as ca

from gaitopt import Collocation, Drawing, PointContact, PointMass, RigidLink
from gaitopt.model import PlanarCoordinates, assemble_planar
from gaitopt.ocp import PlanarLimits, PlanarProblem

L, M_HIP, M_LEG, I_LEG = 0.9, 40.0, 6.0, 0.35


def robot(armed_at=0.05, heel=-0.06, toe=0.14):
    c = PlanarCoordinates(("x", "y", "a", "b"))
    hip = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    bodies, contacts = [PointMass(M_HIP, hip)], {"hip": PointContact(hip, falls=True)}
    for leg, other in ("ab", "ba"):
        angle = c.coordinate(leg)
        down, ahead = ca.vertcat(ca.sin(angle), -ca.cos(angle)), ca.vertcat(ca.cos(angle), ca.sin(angle))
        bodies.append(RigidLink(M_LEG, hip + 0.38 * down, I_LEG, -angle))
        armed = angle - c.coordinate(other) - armed_at
        for name, distance in (("heel", heel), ("toe", toe)):
            contacts[f"{name} {leg}"] = PointContact(hip + L * down + distance * ahead, body=f"foot {leg}", armed=armed)
    return assemble_planar(
        "my walker",
        c,
        bodies=bodies,
        contacts=contacts,
        actuators={"motor": c.coordinate("a") - c.coordinate("b")},
        mirror={"a": "b", "heel a": "heel b", "toe a": "toe b", "motor": "-motor"},
        drawing=Drawing(links=[("hip", f"heel {leg}", f"toe {leg}", "hip") for leg in "ab"]),
    )


def problem(slope=0.03, friction=0.8, speed=0.9, step_length=0.45, torque=80.0, armed_at=0.05, intervals=6):
    return PlanarProblem(
        robot=robot(armed_at),
        sequence="heel a stick | toe a stick |",
        slope=slope,
        friction=friction,
        speed=speed,
        step_length=step_length,
        objective="torque_squared",
        limits=PlanarLimits(torque=torque),
        transcription=Collocation(intervals=intervals),
    )
