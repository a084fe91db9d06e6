"""Contacts of robots with several contacts that would close before their planned touchdown."""

import numpy as np
import pytest

from gaitopt import Margins
from gaitopt.model import compass_with_two_feet
from gaitopt.motion.undecided_touchdowns import find_undecided_touchdowns_of_parts
from gaitopt.ocp import Collocation, PlanarLimits, PlanarProblem
from gaitopt.ocp.multicontact.early_touchdown import (
    find_early_touchdowns,
    share_of_clearance,
)
from gaitopt.ocp.multicontact.planar_bounds import planar_bounds, planar_data, planar_structure
from gaitopt.ocp.multicontact.planar_certification import certify_planar
from gaitopt.ocp.multicontact.planar_plan import SampledPlan
from gaitopt.ocp.multicontact.planar_start import planar_start
from gaitopt.ocp.multicontact.planar_transcription import transcribe_planar
from gaitopt.ocp.multicontact.undecided_rows import find_rows_beside
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.keys import Kind, Unknown
from tests.ocp.multicontact_examples import walk

AHEAD, BEHIND = {"a": -0.2, "b": 0.3}, {"a": 0.3, "b": -0.2}
"""Angles of the legs [rad] with which foot B is armed, and not armed."""


@pytest.fixture(scope="module")
def planned():
    """Problem, transcription and start of a walk whose foot B is free in two phases of three intervals."""
    problem = walk("slip+ stick | slip+", friction=0.14, margins=Margins(), transcription=Collocation(intervals=(3, 3)))
    transcription = transcribe_planar(planar_structure(problem))
    return problem, transcription, planar_start(transcription, problem, None)


def place_foot(planned, gaps, *angles):
    """Return the decision vector of a robot that rests at each node, with these gaps of foot B [m].

    The last angles are those of all further phases.
    """
    problem, transcription, start = planned
    robot, x = problem.robot, start.copy()
    for phase in transcription.phases:
        legs = angles[min(phase.number, len(angles) - 1)]
        pose = np.array([legs.get(name, 0.0) for name in robot.coordinates])
        height = float(robot.gaps(pose, robot.vector(problem.values))[0][robot.contact_index("foot B")])
        places = transcription.builder.coordinates(phase)
        x[places] = pose[:, None]
        x[places[robot.coordinates.index("y")]] = np.array(gaps)[list(phase.nodes)] - height
        x[transcription.builder.velocities(phase)] = 0.0
        for table in (Unknown.ACCELERATION, Unknown.INNER_ACCELERATION):
            x[transcription.variables[table, phase.number]] = 0.0
    return x


def find_places(planned, gaps, *angles):
    """Return the labels of the places at which foot B is below the ground after an early touchdown."""
    problem, transcription, _ = planned
    x = place_foot(planned, gaps, *(angles or (AHEAD,)))
    rows = find_early_touchdowns(SampledPlan(transcription, problem.values, x), 0.0)
    assert all(transcription.constraints.entries[row][1].of == "foot B" for row in rows)
    return {transcription.constraints.label(row)[0] for row in rows}


def test_a_foot_that_falls_below_the_ground_at_the_end_of_a_phase_is_below_it_in_the_next_phase(planned):
    """The last node of a phase counts, and so do the nodes of the next phase in which the foot is still below."""
    places = find_places(planned, [0.03, 0.02, 0.01, -0.01, -0.01, 0.01, 0.0])
    assert any("phase 1" in place and "node 3" in place for place in places)
    assert any("phase 2" in place for place in places)


def test_a_foot_that_is_not_armed_passes_through_the_ground(planned):
    assert find_places(planned, [0.03, 0.02, 0.01, -0.01, -0.01, 0.01, 0.0], BEHIND) == set()
    assert find_places(planned, [0.03, 0.02, 0.01, 0.01, 0.01, 0.01, 0.0]) == set()


def test_a_foot_that_has_stood_on_the_ground_is_not_below_it_because_of_its_previous_swing():
    """Foot B touches down early in the first step and swings again in the third one, then without being armed."""
    sequence, grid = "foot A stick | foot B stick | foot A stick |", Collocation(intervals=(3, 3, 3))
    problem = walk(sequence, margins=Margins(), transcription=grid)
    transcription = transcribe_planar(planar_structure(problem))
    steps = problem, transcription, planar_start(transcription, problem, None)
    first, third = [0.03, 0.02, -0.01, -0.005], [-5e-9, -0.01, -0.01, 0.0]
    places = find_places(steps, [*first[:3], 0.0, 0.0, 0.0, *third], AHEAD, AHEAD, BEHIND)
    assert places
    assert all("phase 1" in place for place in places)


@pytest.mark.parametrize(("gap", "angles", "count"), [(1e-8, AHEAD, 1), (1e-8, BEHIND, 0), (1e-3, AHEAD, 0)])
def test_an_armed_foot_on_the_ground_in_the_middle_of_a_phase_grazes_it(planned, gap, angles, count):
    problem, transcription, _ = planned
    x = place_foot(planned, [0.03, 0.02, 0.02, 0.02, gap, 0.01, 0.0], angles)
    plan = SampledPlan(transcription, problem.values, x)
    grazes = find_undecided_touchdowns_of_parts(plan.robot, plan.values, plan.parts)
    assert [(graze.contact, graze.part) for graze in grazes] == [("foot B", 1)] * count
    rows = find_rows_beside(plan, grazes, 0.001)
    assert len(rows) == 2 * count
    assert all(transcription.constraints.entries[row][1].of == "foot B" for row in rows)


def test_the_bounds_after_an_early_touchdown_change_with_the_clearance():
    """The derivative of the optimal cost with respect to the clearance is that of solved problems."""
    problem = PlanarProblem(
        robot=compass_with_two_feet(),
        sequence="foot A stick |",
        friction=1.0,
        speed=0.633,
        step_length=0.4713,
        objective="torque_squared",
        limits=PlanarLimits(clearance=0.02),
        transcription=Collocation(intervals=6),
    )
    transcription = transcribe_planar(planar_structure(problem))
    layout = transcription.constraints
    late = [
        row
        for row, (place, key) in enumerate(layout.entries)
        if key.kind is Kind.GAP and key.of == "foot B" and (place.node or 0) >= 4
    ]

    def solve_above_ground(clearance):
        stated = problem.replace(limits=PlanarLimits(clearance=clearance))
        bounds = planar_bounds(transcription, stated)
        bounds.g_lower[late] = [clearance * share_of_clearance(transcription, row) for row in late]
        start = planar_start(transcription, stated, None)
        outcome = Ipopt(tolerance=1e-9).minimise(transcription.nlp, start, planar_data(stated), bounds, lambda _: None)
        assert outcome.status.ok
        return stated, bounds, outcome

    stated, bounds, outcome = solve_above_ground(0.02)
    up, down = (solve_above_ground(0.02 + change)[2].objective for change in (1e-5, -1e-5))
    derivative = certify_planar(stated, transcription, bounds, outcome).derivative_of("clearance")
    assert derivative > 0.1
    assert derivative == pytest.approx((up - down) / 2e-5, rel=1e-3)
