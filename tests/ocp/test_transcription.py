import math

import numpy as np
import pytest

from gaitopt import ContactSequence, CostOfTransport, Limits, Margins, Mode, TorqueSquared, compass_biped
from gaitopt.model import solve_impact
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.ocp.bounds import bounds, data_vector
from gaitopt.ocp.nlp.keys import Group, Unknown
from tests.ocp.nlp_examples import example_nlp

ROBOT = compass_biped()
SLIPPING = ContactSequence.parse("slip+ stick slip- | slip+")


def sized(sequence, counts, objective):
    return example_nlp(ContactSequence.parse(sequence), counts, objective)


def test_every_variable_and_every_row_has_a_name():
    transcription = example_nlp(SLIPPING, (3, 4, 2), CostOfTransport())
    for layout in (transcription.variables, transcription.constraints):
        assert len(layout.labels) == layout.size
        assert all(place and name for place, name in layout.labels)
        assert len(set(layout.labels)) == layout.size, "two entries share a name"
    assert transcription.nlp.n_variables == transcription.variables.size
    assert transcription.nlp.n_constraints == transcription.constraints.size
    assert transcription.row_bounds.shape == (2, transcription.constraints.size)


def test_grids_and_sequences_share_the_equations_of_motion_of_a_mode():
    fine, coarse = (example_nlp(SLIPPING, counts, CostOfTransport()) for counts in ((6, 8, 4), (3, 4, 2)))
    sticking = sized("stick | stick", (5,), TorqueSquared())
    assert fine.dynamics_of_phases[1] is coarse.dynamics_of_phases[1] is sticking.dynamics_of_phases[0]
    assert fine.dynamics_of_phases[0] is not fine.dynamics_of_phases[2]


def test_a_slip_that_continues_that_of_the_impact_needs_no_force_at_rest(monkeypatch):
    monkeypatch.setattr(PhaseDynamics, "excess_at_rest", None)
    assert (Group.START, 0) not in sized("slip+ stick | slip+", (3, 4), TorqueSquared()).constraints
    with pytest.raises(TypeError, match="not callable"):
        sized("slip+ stick | stick", (3, 4), TorqueSquared())


def test_sizes_of_a_sticking_problem():
    n = 7
    transcription = sized("stick | stick", (n,), TorqueSquared())
    # 2 angles, 2 rates, 2 torques per node; one duration, two impulses, the travel.
    assert transcription.variables.size == 6 * (n + 1) + 4
    # 4 defects, 2 cone sides at the node and 2 at mid-interval; 2 at the end; 2 + 4 + 2 + 7 at touchdown.
    assert transcription.constraints.size == 8 * n + 2 + 15
    assert transcription.n_nodes == n + 1


def test_rows_say_where_they_are():
    transcription = example_nlp(SLIPPING, (3, 4, 2), CostOfTransport())
    labels = set(transcription.constraints.labels)
    assert ("phase 2 (stick), node 3", "dynamics of th1 rate") in labels
    assert ("phase 2 (stick), node 0", "forward friction cone, inner point 1") in labels
    assert ("phase 2 (stick), node 4", "slip onset on the cone") in labels
    assert ("phase 1 (slip+), node 2", "foot speed, inner point 1") in labels
    assert ("phase 3 (slip-), node 2", "power split of hip") in labels
    assert ("phase 3 (slip-), node 2", "normal force") in labels
    assert ("touchdown", "impact friction cone") in labels


def test_a_node_between_phases_belongs_to_the_earlier_one():
    transcription = example_nlp(SLIPPING, (3, 4, 2), TorqueSquared())
    angles = transcription.variables["angles"]
    assert transcription.variables.label(angles[0, 3]) == ("phase 1 (slip+), node 3", "th1")
    assert transcription.variables.label(angles[0, 4]) == ("phase 2 (stick), node 1", "th1")


def test_a_defect_is_zero_on_a_trajectory_and_only_there():
    transcription = sized("stick | stick", (1,), TorqueSquared())
    p = [*ROBOT.vector(ROBOT.resolve({"friction": 0.14})), 0.0, 0.0]
    layout, x = transcription.variables, np.zeros(transcription.variables.size)
    # Standing upright at rest without torque is an equilibrium.
    x[layout["duration"]], x[layout["travel"]] = 0.7, 0.4
    defects = transcription.constraints[Group.INTERVAL, 0][:4, 0]
    residual = transcription.nlp.derivatives["jac_g"]
    assert np.asarray(residual(x, p)[0]).ravel()[defects] == pytest.approx(np.zeros(4), abs=1e-15)
    x[layout["torque"][0, 0]] = 1.0
    assert np.max(np.abs(np.asarray(residual(x, p)[0]).ravel()[defects])) > 1e-3


def test_equal_arguments_share_a_transcription():
    one = sized("stick | stick", (6,), TorqueSquared())
    assert sized("stick | stick", (6,), TorqueSquared()) is one
    assert sized("stick | stick", (7,), TorqueSquared()) is not one
    assert sized("stick | stick", (6,), CostOfTransport()) is not one


@pytest.fixture(scope="module")
def slipping(reference_problem):
    problem = reference_problem(
        sequence=SLIPPING,
        limits=Limits(torque={"hip": 3}, angle=1.0, rate=5.0, shortest_phase=0.01, longest_step=2.0),
        margins=Margins(
            cone=0.02,
            impact_cone=0.03,
            slip_speed=0.04,
            separation=0.05,
            normal_force=0.06,
            touchdown_rate=0.07,
            touchdown_armed=0.08,
        ),
    )
    transcription = example_nlp(problem.sequence, (4, 4, 4), problem.objective)
    return problem, transcription, bounds(transcription, problem)


def test_limits_become_bounds_of_variables(slipping):
    _, transcription, limits = slipping
    layout = transcription.variables

    def box(index):
        return set(limits.x_lower[index].ravel()), set(limits.x_upper[index].ravel())

    assert box(layout["angles"]) == ({-1.0}, {1.0})
    assert box(layout["rates"]) == ({-5.0}, {5.0})
    assert box(layout["torque"][0]) == ({-math.inf}, {math.inf})
    assert box(layout["torque"][1]) == ({-3.0}, {3.0})
    assert box(layout["duration"]) == ({0.01}, {2.0})
    assert box(layout["travel"]) == ({0.4713}, {0.4713})
    assert box(layout["impulse"][1]) == ({0.0}, {math.inf})
    assert box(layout["power"]) == ({0.0}, {math.inf})
    assert box(layout[Unknown.INNER_POWER, 1]) == ({0.0}, {math.inf})


def test_targets_and_margins_become_bounds_of_rows(slipping):
    problem, transcription, limits = slipping
    named = {}
    for index, (_, name) in enumerate(transcription.constraints.labels):
        named.setdefault(name, set()).add((float(limits.g_lower[index]), float(limits.g_upper[index])))
    assert named["speed"] == {(0.633, 0.633)}
    assert named["step duration"] == {(0.0, 2.0)}
    assert named["separation of the trailing foot"] == {(0.05, math.inf)}
    assert named["touchdown direction"] == {(-math.inf, -0.07)}
    assert named["touchdown ahead of the stance foot"] == {(0.08, math.inf)}
    assert named["normal force"] == {(0.06, math.inf)}
    assert named["normal force, inner point 1"] == {(0.06, math.inf)}
    assert named["forward friction cone"] == {(0.0, math.inf)}
    assert named["impact friction cone"] == {(0.0, 0.0)}
    assert named["slip onset on the cone"] == {(0.0, 0.0)}
    assert data_vector(problem)[-2:].tolist() == [0.02, 0.03]


def test_a_foot_slides_the_right_way_and_rests_where_it_should(slipping):
    _, transcription, limits = slipping
    forward, backward = (transcription.variables[name][1] for name in ((Unknown.SLIDE, 0), (Unknown.SLIDE, 2)))
    # From a slipping impact to rest: at least the margin, fading to an exact zero at the end.
    assert limits.x_lower[forward] == pytest.approx([0.04, 0.04, 0.04, 0.02, 0.0])
    assert limits.x_upper[forward].tolist() == [math.inf] * 4 + [0.0]
    # From rest to the touchdown: an exact zero, then backward.
    assert limits.x_upper[backward] == pytest.approx([0.0, -0.01, -0.04, -0.04, -0.04])
    assert limits.x_lower[backward].tolist() == [0.0] + [-math.inf] * 4


def test_a_slide_counts_from_its_own_start(slipping):
    _, transcription, limits = slipping
    for name in ((Unknown.SLIDE, 0), (Unknown.SLIDE, 2)):
        start = transcription.variables[name][0, 0]
        assert limits.x_lower[start] == limits.x_upper[start] == 0


def test_a_slip_from_rest_needs_a_sticking_force_outside_the_cone():
    """The slip acceleration times the effective mass is the excess of the sticking force over the cone."""
    transcription = sized("slip+ | stick", (2,), TorqueSquared())
    p = ROBOT.vector(ROBOT.resolve({"friction": 0.1}))
    x = np.zeros(transcription.variables.size)
    x[transcription.variables["angles"][:, 0]] = [-0.2, -0.2]
    x[transcription.variables["rates"][:, 0]] = [0.8, -0.3]
    x[transcription.variables["duration"]] = x[transcription.variables["travel"]] = 0.5
    row = transcription.constraints[Group.START, 0][0, 0]
    values = transcription.nlp.derivatives["jac_g"]
    found, beyond = (np.asarray(values(x, [*p, margin, 0])[0]).ravel()[row] for margin in (0, 0.05))
    state = [0, 0, -0.2, -0.2], [0, 0, 0.8, -0.3], [0, 0]
    acceleration = ROBOT.acceleration[Mode.SLIP_FORWARD](*state, p)[0]
    effective_mass = float(ROBOT.wellposed(state[0], p)[0]) * 10.0  # of a total of 10 kg
    assert found * float(ROBOT.weight(p)) * 0.1 == pytest.approx(float(acceleration[0]) * effective_mass)
    normal = float(ROBOT.acceleration[Mode.STICK](*state, p)[1][1] / ROBOT.weight(p))
    assert beyond == pytest.approx(found - 0.05 * normal)
    assert transcription.constraints.label(row) == ("phase 1 (slip+), node 0", "sticking force outside the cone")


def test_the_planned_touchdown_is_the_exact_impact(solved):
    """End to end: the post-impact state of a solved gait is what solve_impact makes of its last state."""
    for sequence in ("stick | stick", "slip+ stick | slip+"):
        gait = solved(sequence=sequence)
        jump = gait.motion.jumps[0]
        exact = solve_impact(ROBOT, jump.q, jump.v_minus, ROBOT.vector(gait.motion.parameters))
        assert exact.mode is gait.sequence.impact
        assert exact.v_plus == pytest.approx(jump.v_plus, abs=1e-7)
        assert exact.impulse == pytest.approx(jump.impulse, abs=1e-6)
        assert exact.energy_lost == pytest.approx(jump.energy_lost, abs=1e-6)
        assert exact.separation >= Margins().separation - 1e-7
