"""Sticking impacts at the edge of the friction cone are remarked in the table of a gait."""

import dataclasses

import numpy as np
import pytest

from gaitopt import Collocation, GaitProblem, Limits, Margins, compass_biped, load, solve
from gaitopt.motion.gait_table import tabulate_gait
from gaitopt.motion.impact_edge import EDGE, ImpactEdge, find_impact_edges
from gaitopt.motion.summary import summarise
from gaitopt.ocp import solve_planar
from gaitopt.status import Status
from tests.ocp.multicontact_examples import walk


def list_warnings(gait):
    return [text for name, text in tabulate_gait(gait) if name == "warning" and "edge of the friction cone" in text]


def solve_stick(friction, **margins):
    return solve(
        GaitProblem(
            robot=compass_biped(),
            sequence="stick | stick",
            friction=friction,
            speed=0.633,
            step_length=0.4713,
            limits=Limits(torque=6),
            margins=Margins(**margins),
            transcription=Collocation(intervals=20),
        )
    )


@pytest.fixture(scope="module")
def edge():
    return solve_stick(0.2)


def test_a_sticking_impact_at_the_edge_is_remarked_with_the_margin_that_avoids_it(edge):
    (text,) = list_warnings(edge)
    assert "the sticking impact of the foot is at the edge of the friction cone: its impulse ratio of 0.1998" in text
    assert "only 0.1 % below the friction of 0.2" in text
    assert text.endswith("solve with Margins(impact_cone=0.1).")
    assert text in summarise(edge)["warnings"]


def test_a_gait_with_the_advised_margin_has_no_remark():
    gait = solve_stick(0.2, impact_cone=0.1)
    assert gait.status.ok
    assert list_warnings(gait) == []


def test_slipping_impacts_and_failed_solves_have_no_remark(edge):
    assert find_impact_edges(load("docs/examples/compass_slip.h5")) == []
    assert find_impact_edges(edge.replace_fields(status=Status.INFEASIBLE)) == []


def test_an_impulse_outside_the_cone_of_the_ground_has_no_remark(edge):
    """A custom impact law may have another cone."""
    wide = dataclasses.replace(edge.motion, parameters={**edge.motion.parameters, "friction": 0.15})
    assert find_impact_edges(edge.replace_fields(motion=wide)) == []


def test_the_contacts_of_several_bodies_are_named():
    gait = solve_planar(walk("foot A stick |", transcription=Collocation(intervals=10)))
    tangential, normal = gait.motion.events[-1].impulse[gait.motion.contacts.index("foot B")]
    friction = abs(tangential) / normal * (1 + EDGE / 2)
    values = {**gait.motion.parameters, "friction": friction}
    (found,) = find_impact_edges(gait.replace_fields(motion=dataclasses.replace(gait.motion, parameters=values)))
    assert found.contacts == "foot B"
    assert found.margin == pytest.approx(EDGE / 2, rel=1e-2)
    assert list_warnings(gait) == []
    assert find_impact_edges(gait) == []


def test_the_margin_is_not_negative_by_rounding():
    assert "only 0 % below" in str(ImpactEdge("foot", np.nextafter(0.2, 1), 0.2))
