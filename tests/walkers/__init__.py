"""Walkers with parts that can be written wrongly: a torso, a knee, round feet."""

import casadi as ca

from gaitopt import Coordinates, Drawing, Parameter, PointMass, RigidLink, StepEnd, assemble

GRAVITY = Parameter("gravity", 9.81, "m/s^2", "gravity")


def up(length, angle):
    return length * ca.vertcat(ca.sin(angle), ca.cos(angle))


def down(length, angle):
    return length * ca.vertcat(ca.sin(angle), -ca.cos(angle))


def torso_biped(
    relabel=lambda a, b, t: [-b, -a, t],
    touchdown=lambda a, b: b - a,
    armed=lambda a, b: a,
    *,
    balanced=False,
    drawn=("stance foot", "hip", "swing foot", "head"),
    offset=0.0,
):
    """Return two straight legs and a torso, whose mass is at its end or, balanced, spread about the hip.

    The swing leg's angle is measured from the vertical turned by an offset.
    """
    c = Coordinates(("th1", "th2", "th3"), (GRAVITY,))
    a, b, t = (c.angle(name) for name in c.angles)
    b = b - offset
    hip = c.foot + up(1, a)
    foot, head = hip + down(1, b), hip + up(0.5, t)
    torso = RigidLink(10, hip, 0.5, t) if balanced else PointMass(10, head)
    places = {"stance foot": c.foot, "hip": hip, "swing foot": foot, "head": head}
    links = [("stance foot", "hip"), ("hip", "swing foot"), ("hip", "head")]
    return assemble(
        "torso_biped",
        c,
        bodies=[PointMass(5, (c.foot + hip) / 2), PointMass(10, hip), PointMass(5, (hip + foot) / 2), torso],
        step=StepEnd(
            landing=foot,
            touchdown=touchdown(a, b),
            armed=ca.SX(armed(a, b)),
            exchange=relabel(a, b, t),
            upright=ca.cos(a),
        ),
        actuators={"stance hip": a - t, "swing hip": b + t},
        drawing=Drawing({name: places[name] for name in drawn}, [pair for pair in links if {*pair} <= {*drawn}]),
        description="compass biped with a torso",
    )


def kneed_biped(relabel):
    """Return a straight stance leg, and a swing leg with a knee, whose thigh and shank have an angle each."""
    c = Coordinates(("th1", "th2", "th3"), (GRAVITY,))
    a, b, k = (c.angle(name) for name in c.angles)
    hip = c.foot + up(1, a)
    knee = hip + down(0.5, b)
    foot = knee + down(0.5, k)
    return assemble(
        "kneed_biped",
        c,
        bodies=[
            PointMass(5, (c.foot + hip) / 2),
            PointMass(10, hip),
            PointMass(3, (hip + knee) / 2),
            PointMass(2, (knee + foot) / 2),
        ],
        step=StepEnd(
            landing=foot,
            touchdown=foot[1] - c.foot[1],
            armed=foot[0] - c.foot[0] - 0.1,
            exchange=relabel(a, b, k),
            upright=ca.cos(a),
        ),
        actuators={"hip": a + b, "knee": k - b},
        drawing=Drawing(
            {"stance foot": c.foot, "hip": hip, "knee": knee, "swing foot": foot},
            [("stance foot", "hip"), ("hip", "knee"), ("knee", "swing foot")],
        ),
        description="biped with a knee in its swing leg",
    )


def round_compass(radius):
    """Return a compass biped with arcs as feet, whose (x, y) is where the unrolled arc would touch the ground.

    Rest of (x, y) is rolling, its speed is the slip of the contact point.
    """
    c = Coordinates(("th1", "th2"), (GRAVITY,))
    a, b = c.angle("th1"), c.angle("th2")
    centre = c.foot + ca.vertcat(radius * a, radius)
    hip = centre + up(1 - radius, a)
    swing = hip + down(1 - radius, b)
    below = ca.DM([0, radius])
    return assemble(
        "round_compass",
        c,
        bodies=[
            PointMass(5, centre + up((1 - radius) / 2, a)),
            PointMass(10, hip),
            PointMass(5, hip + down((1 - radius) / 2, b)),
        ],
        step=StepEnd(
            landing=swing - ca.vertcat(-radius * b, radius),
            touchdown=b - a,
            armed=a,
            exchange=[-b, -a],
            upright=ca.cos(a),
        ),
        actuators={"ankle": a, "hip": a + b},
        drawing=Drawing(
            {"stance foot": centre - below, "hip": hip, "swing foot": swing - below},
            [("stance foot", "hip"), ("hip", "swing foot")],
        ),
        description="compass biped with round feet",
    )
