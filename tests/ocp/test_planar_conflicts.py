"""Limits named for infeasible problems of a walker with heel and toe."""

from types import SimpleNamespace

import pytest

from gaitopt import Collocation, Status
from gaitopt.motion.ground_penetration import find_penetrations
from gaitopt.motion.planar_gait_table import tabulate_planar_gait
from gaitopt.ocp import PlanarLimits, solve_planar
from gaitopt.ocp.multicontact.planar_infeasibility import PlanarElastic, _find_conflicts, _list_insufficient
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.progress import silent
from tests.ocp.multicontact_examples import walk
from tests.walkers.heel_toe import Build, heel_toe_step

SMALL = {"ankle A": 1.0, "hip": 1.0, "ankle B": 0.0}
"""Torque limits [N m] with which the compass does not reach its speed."""


def relax(problem, name):
    """Return the elastic problem, the number of a limit, and the motion that exceeds this limit alone."""
    elastic = PlanarElastic(problem, Ipopt(tolerance=1e-6), silent)
    (number,) = (i for i, limit in enumerate(elastic.limits) if name in limit.name)
    return elastic, number, elastic._relax_only(number)


def weak_walker(torque):
    """Return the problem of a walker that drags its heel through the ground if only its torque were relaxed."""
    problem = heel_toe_step(0.05, build=Build(12.0, 3.0, 0.15, 0.9, 0.36, -0.05, 0.10, torque))
    return problem.replace(speed=0.8, step_length=0.42)


def test_a_motion_that_exceeds_a_limit_has_no_touchdown_from_below():
    elastic, number, alone = relax(weak_walker(2.0), "torque")
    assert elastic.suffices(number, alone)
    motion = elastic.motion(alone)
    assert not any(each.is_touchdown_from_below for each in find_penetrations(elastic.problem.robot, motion))
    assert alone.multipliers[1].size == elastic._relax(only=number)._plain.nlp.n_constraints


@pytest.mark.slow
def test_a_limit_does_not_suffice_if_a_contact_drags_through_the_ground():
    problem = weak_walker(60.0).replace(sequence="toe a stick | heel a stick |")
    elastic = PlanarElastic(problem, Ipopt(tolerance=1e-6), silent)
    nearest = elastic.minimise_excess()
    assert nearest.status is Status.PLAN_INACCURATE
    assert elastic.excess(nearest) > 1e-3  # no gait exists even if contacts may drag
    assert not elastic.suffices(0, nearest)


@pytest.mark.slow
def test_the_torque_that_suffices_leads_to_a_gait():
    conflicts = {conflict.setting: conflict.sufficient for conflict in solve_planar(weak_walker(2.0)).solver.conflicts}
    assert solve_planar(weak_walker(conflicts["PlanarLimits.torque"])).status is Status.SOLVED


@pytest.mark.slow
def test_a_limit_that_suffices_alone_is_found_from_the_guess():
    """A motion exists with the named torque, and none with 90 % of the missing torque."""
    problem = heel_toe_step(0.05).replace(limits=PlanarLimits(torque=1.0))
    elastic, number, alone = relax(problem, "torque")
    assert elastic.suffices(number, alone)
    missing, torque = alone.slacks[number], elastic.record_conflict(number, alone, separable=True).sufficient
    assert torque == pytest.approx(1 + 1.02 * missing)
    enough, _, motion = relax(problem.replace(limits=PlanarLimits(torque=torque)), "torque")
    assert enough.is_feasible(motion)
    _, _, weak = relax(problem.replace(limits=PlanarLimits(torque=1 + 0.9 * missing)), "torque")
    assert weak.slacks[number] == pytest.approx(0.1 * missing, rel=0.2)


def test_a_contact_that_is_not_armed_at_its_touchdown_is_named():
    """A step of 0.45 m with legs of 1 m lands with 0.45 rad between the legs, less than the threshold of 0.6 rad."""
    elastic, number, alone = relax(heel_toe_step(0.6), "armed")
    assert elastic.suffices(number, alone)
    assert 0.05 < alone.slacks[number] < 0.3
    text = str(elastic.record_conflict(number, alone, separable=True))
    assert text.startswith("condition 'armed' of the robot at touchdown (Margins.touchdown_armed) is violated by 0.")


def test_a_table_lists_the_conflicting_limits_instead_of_the_equations():
    limits = PlanarLimits(torque=SMALL)
    refused = solve_planar(walk("foot A stick |", limits=limits, transcription=Collocation(intervals=10)))
    facts = tabulate_planar_gait(refused)
    assert [text for name, text in facts if name == "conflict"] == [str(each) for each in refused.solver.conflicts]
    assert not any(name == "not met" for name, _ in facts)


def test_limits_are_relaxed_from_the_guess_if_the_least_excess_is_unknown():
    elastic = SimpleNamespace(is_feasible=lambda result: False, relax_from_guess=lambda: ("torque",))
    assert _find_conflicts(elastic, SimpleNamespace(status=Status.ITERATION_LIMIT)) == ("torque",)
    assert _find_conflicts(elastic, SimpleNamespace(status=Status.TIME_LIMIT)) == ()


def test_the_limits_of_which_none_suffices_are_listed():
    assert _list_insufficient(()) == ""
    assert _list_insufficient(("speed", "friction")).endswith("if it alone is relaxed: speed, friction")
