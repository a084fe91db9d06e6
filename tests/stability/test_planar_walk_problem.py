"""Walking problems of planar robots: search of gaits, sequences, invalid input."""

import pickle

import pytest

from gaitopt import load, trace
from gaitopt.cli.script import call_script
from gaitopt.continuation import TraceOptions
from gaitopt.errors import InputError, NoGaitError
from gaitopt.model import compass_biped, compass_with_two_feet, kneed_walker
from gaitopt.stability import PlanarWalkProblem, assess_planar
from gaitopt.tuning import planar_lqr
from tests.conftest import ROOT

COMPASS = {
    "section": "foot B closes",
    "coordinates": {"x": 0, "a": 0.1478, "b": -0.1478},
    "rates": {"a": -0.7328, "b": -0.5007},
    "on": ("foot A",),
}


def compass(**changes):
    return PlanarWalkProblem(robot=compass_with_two_feet(), **COMPASS | changes)


def test_a_gait_is_found_once_from_several_starts():
    cycles = list(compass(parameters={"slope": 0.01745329252, "friction": 0.3}).search(3))
    assert len(cycles) == 1
    assert cycles[0].period == pytest.approx(0.744620868, abs=1e-8)  # Gait A of Gamus & Or (2015)
    assert cycles[0].critical_friction.friction == pytest.approx(0.17492, abs=5e-6)


def test_only_gaits_with_the_stated_sequence_are_kept():
    parameters = {"slope": 0.01745329252, "friction": 0.3}
    assert len(list(compass(parameters=parameters, sequence="foot A stick |").search(1))) == 1
    assert not list(compass(parameters=parameters, sequence="foot A slip+ > foot A stick |").search(1))


def test_without_a_gait_the_search_is_empty():
    assert not list(compass(parameters={"slope": -0.1}).search(2))


def test_invalid_problems_are_rejected():
    with pytest.raises(InputError, match="robot must be a PlanarRobot such as kneed_walker"):
        PlanarWalkProblem(robot="kneed walker", **COMPASS)
    with pytest.raises(InputError, match=r"robot must be a PlanarRobot .*; Robot '.*' is for WalkProblem"):
        PlanarWalkProblem(robot=compass_biped(), **COMPASS)
    with pytest.raises(InputError, match="has no parameter 'slop'"):
        compass(parameters={"slop": 1})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"section": "foot C closes"}, "An event must be one of .*got 'foot C closes'"),
        ({"on": ("foot",)}, "on: there is no contact 'foot' of 'compass_with_two_feet'"),
        ({"coordinates": {"hip": 0}}, "coordinates: there is no coordinate 'hip'"),
        ({"rates": {"a_rate": 0}}, "rates: there is no coordinate 'a_rate' .*Known: x, y, a, b"),
    ],
)
def test_unknown_names_are_rejected_at_construction(changes, message):
    with pytest.raises(InputError, match=message):
        compass(**changes)


def test_the_reason_for_no_gait_from_the_given_state():
    slope = {"slope": 0.01745329252, "friction": 0.3}
    assert "at least one gap must be at least 0" in compass(parameters=slope, on=()).explain_failure()
    slow = compass(parameters=slope, rates={"a": -0.1, "b": -0.1})
    assert "does not reach the event 'foot B closes': The walker fell" in slow.explain_failure()
    with pytest.raises(NoGaitError, match=r"begin the range where there is a gait\. The motion .* The walker fell"):
        trace(slow, {"slope": (0.017, 0.018)}, options=TraceOptions(starts=1))
    other = compass(parameters=slope, sequence="foot A slip+ > foot A stick |")
    assert other.explain_failure() == "The gait that is found from the given state has the sequence 'foot A stick |'."


@pytest.mark.slow
def test_the_walk_of_an_optimal_gait_is_found_from_its_state():
    gait = load(ROOT / "docs/examples/heel_toe.h5")
    law = planar_lqr(gait)
    walk, assessed = PlanarWalkProblem.from_gait(gait, law), assess_planar(gait, law)
    (cycle,) = walk.search(1)
    assert (walk.section, walk.on) == ("heel b closes", ("heel a",))
    assert cycle.radius == pytest.approx(assessed.radius, rel=1e-5)
    assert cycle.period == pytest.approx(gait.period, abs=1e-6)


def test_the_parameters_of_the_scripts_are_those_of_the_robots():
    for name in ("kneed_walker", "hopper", "round_feet"):
        problem = call_script(ROOT / "problems" / f"{name}.py", [])
        assert isinstance(problem, PlanarWalkProblem)
        assert not problem.sequence


def test_a_planar_robot_is_sent_to_other_processes():
    robot = pickle.loads(pickle.dumps(kneed_walker()))
    assert robot.contacts == kneed_walker().contacts
    q, p = [0.1] * 6, robot.vector(robot.resolve({}))
    assert (robot.gaps(q, p)[0] - kneed_walker().gaps(q, p)[0]).is_zero()
