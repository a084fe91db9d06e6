"""A sole above its ankle is reported."""

import casadi as ca
import pytest

from gaitopt import Drawing, PointContact, PointMass, RigidLink
from gaitopt.model import PlanarCoordinates, assemble_planar, check_planar


def flat_foot_biped(height, *, drawing=True):
    """Return a biped with straight legs of 0.9 m and flat feet, whose soles are `height` below the ankles [m]."""
    c = PlanarCoordinates(("x", "y", "a", "ankle_a", "b", "ankle_b"))
    hip = ca.vertcat(c.coordinate("x"), c.coordinate("y"))
    bodies, contacts, points = [PointMass(10.0, hip)], {}, {"hip": hip}
    for leg in "ab":
        angle, pitch = c.coordinate(leg), c.coordinate(leg) + c.coordinate(f"ankle_{leg}")
        ankle = hip + 0.9 * ca.vertcat(ca.sin(angle), -ca.cos(angle))
        sole = ankle + height * ca.vertcat(ca.sin(pitch), -ca.cos(pitch))
        bodies += [RigidLink(3.0, (hip + ankle) / 2, 0.2, -angle), RigidLink(1.0, ankle, 0.01, -pitch)]
        points[f"ankle {leg}"] = ankle
        for end, distance in (("heel", -0.06), ("toe", 0.16)):
            place = sole + distance * ca.vertcat(ca.cos(pitch), ca.sin(pitch))
            contacts[f"{end} {leg}"] = PointContact(place, body=f"foot {leg}")
    return assemble_planar(
        "biped",
        c,
        bodies=bodies,
        contacts=contacts,
        actuators={"motor": c.coordinate("a") - c.coordinate("b")},
        drawing=Drawing(points=points, links=[("hip", "ankle a"), ("hip", "ankle b")]) if drawing else None,
    )


def test_a_sole_above_its_ankle_is_a_remark():
    (remark,) = check_planar(flat_foot_biped(-0.08), states=2).remarks
    assert remark == (
        "Robot 'biped': in upright poses, 'ankle a' and 'ankle b' of the robot are at least 0.047 m below all contacts "
        "of the feet (heel a, toe a, heel b, toe b), and so below the ground if the robot stands on them: check the "
        "sign of the distance from ankle to sole; y points upwards."
    )


def test_a_body_above_the_feet_is_reported_without_a_drawing():
    (remark,) = check_planar(flat_foot_biped(-0.08, drawing=False), states=2).remarks
    assert "below all contacts of the feet" in remark


@pytest.mark.parametrize("height", [0.0, 0.08])
def test_a_sole_below_or_at_its_ankle_is_no_remark(height):
    assert check_planar(flat_foot_biped(height), states=2).remarks == ()
