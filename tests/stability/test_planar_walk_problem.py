"""Walking problems of planar robots: search of gaits, sequences, invalid input."""

import pickle

import pytest

from gaitopt.cli.script import call_script
from gaitopt.errors import InputError
from gaitopt.model import compass_biped, compass_with_two_feet, kneed_walker
from gaitopt.stability import PlanarWalkProblem
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
