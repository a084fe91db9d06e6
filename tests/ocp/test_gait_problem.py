import math

import pytest

from gaitopt import (
    CostOfTransport,
    GaitProblem,
    InputError,
    Limits,
    Margins,
    Parameter,
    TorqueSquared,
    compass_biped,
    rimless_wheel,
)
from gaitopt.errors import SequenceError
from gaitopt.model.robots.monopod import monopod
from gaitopt.ocp import PlanarProblem


def test_names_become_objects(reference_problem):
    problem = reference_problem(sequence="slip+ stick | slip+", objective="torque_squared")
    assert str(problem.sequence) == "slip+ stick | slip+"
    assert problem.objective == TorqueSquared()


def test_parameters_not_given_keep_their_defaults(reference_problem):
    values = reference_problem(parameters={"leg_mass": 5}).values
    assert values["leg_mass"] == 5
    assert values["leg_length"] == 1.6
    assert values["friction"] == 0.14
    assert values["slope"] == 0.0


def test_replace_checks_again(reference_problem):
    problem = reference_problem()
    assert problem.replace(friction=0.2).friction == 0.2
    assert problem.friction == 0.14
    with pytest.raises(InputError, match="friction must be at least 0"):
        problem.replace(friction=-0.1)


def test_a_problem_is_checked_again_without_new_records_of_its_numbers(reference_problem, monkeypatch):
    first = reference_problem()

    def refuse(*arguments, **options):
        raise AssertionError("a parameter is made again")

    monkeypatch.setattr(Parameter, "__init__", refuse)
    assert reference_problem(friction=0.15).limits == first.limits


def test_the_description_is_complete_and_plain(reference_problem):
    facts = reference_problem(speed=(0.6, 0.7), step_length=None, margins=Margins(cone=0.01)).describe()
    assert facts["speed"] == [0.6, 0.7]
    assert facts["step_length"] is None
    assert facts["cone_margin"] == 0.01
    assert facts["touchdown_rate_margin"] == facts["touchdown_armed_margin"] == 1e-3
    assert facts["torque_limit"] == {"ankle": 6.0, "hip": 6.0}
    assert facts["intervals"] == [40]
    for name in ("leg_length", "leg_com", "leg_mass", "hip_mass", "gravity", "slope", "friction"):
        assert isinstance(facts[name], float)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"friction": math.nan}, "friction must be a finite number"),
        ({"friction": "slippery"}, "friction must be a number"),
        ({"friction": 0.0}, "greater than 0"),
        ({"friction": 0.0, "sequence": "slip+ | slip+"}, "greater than 0"),
        ({"friction": math.inf, "sequence": "slip+ stick | slip+"}, "contains slip, which needs a finite friction"),
        ({"slope": 2.0}, "slope must be at least"),
        ({"slope": math.nan}, "slope must be a finite number"),
        ({"parameters": {"leg_mass": -1}}, "leg_mass must be greater than 0"),
        ({"parameters": {"leg_mass": math.nan}}, "leg_mass must be a finite number"),
        ({"parameters": {"leg_mas": 4}}, "no parameter 'leg_mas'. Did you mean 'leg_mass'"),
        ({"parameters": {"friction": 0.2}}, r"friction must be passed as GaitProblem\(friction=...\)"),
        ({"limits": Limits(torque=0)}, "Limits.torque is 0 for every actuator"),
        ({"limits": Limits(torque={"knee": 3})}, "no actuator 'knee'"),
        ({"objective": "comfort"}, "no objective 'comfort'"),
        (
            {"objective": abs},
            r"must be a name or an Objective, .* A custom one derives from Objective, .* Known: cost_of",
        ),
        ({"objective": CostOfTransport}, r"Call it: objective=CostOfTransport\(\)\."),
        ({"name": 3}, "name must be a string, got 3"),
        ({"speed": 0}, "speed must be greater than 0"),
        ({"speed": (0.8, 0.6)}, "speed: the lower bound"),
        ({"step_length": 5.0}, "step_length 5 m is longer than the 3.2 m the robot can reach"),
        ({"step_length": 0.4, "limits": Limits(angle=0.1)}, "longer than the 0.319 m the robot can reach"),
        ({"speed": 500.0}, "speed 500 m/s and step_length leave at most .* less than"),
        ({"speed": 0.01}, "takes 47.1 s, more than Limits.longest_step"),
        ({"limits": Limits(longest_step=0.5)}, "takes 0.745 s, more than Limits.longest_step"),
        ({"speed": None, "limits": Limits(shortest_phase=3, longest_step=2)}, "more than Limits.longest_step"),
        ({"transcription": None}, "transcription must be"),
        ({"guess": "gait.h5"}, r"guess must be a Guess, such as WarmStart\(load\(.*\)\), got 'gait.h5'"),
        ({"robot": "compass"}, "robot must be a Robot"),
        ({"robot": compass_biped}, r"got the function compass_biped; call it: compass_biped\(\)"),
        ({"robot": monopod()}, r"robot must be a Robot .*; PlanarRobot 'monopod' is for PlanarProblem"),
        ({"robot": rimless_wheel()}, "no actuators; an optimal gait requires at least one"),
    ],
)
def test_problems_that_cannot_be(changes, reason):
    fields = {
        "robot": compass_biped(),
        "sequence": "stick | stick",
        "friction": 0.14,
        "speed": 0.633,
        "step_length": 0.4713,
    }
    with pytest.raises(InputError, match=reason):
        GaitProblem(**{**fields, **changes})


@pytest.mark.parametrize("sequence", ["slip+ | fly", "stick | slip+", "stick stick | stick", "", "| stick", "stick", 3])
def test_sequences_that_cannot_be(reference_problem, sequence):
    with pytest.raises(SequenceError, match="sequence"):
        reference_problem(sequence=sequence)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"guess": "gait.h5"}, r"guess must be a PlanarGuess, such as FromPlanarGait\(load\(.*\)\), got 'gait.h5'"),
        ({"name": 3}, "name must be a string, got 3"),
    ],
)
def test_planar_problems_that_cannot_be(changes, reason):
    fields = {"robot": monopod(), "sequence": "foot stick > flight |", "friction": 1, "speed": 1}
    with pytest.raises(InputError, match=reason):
        PlanarProblem(**{**fields, **changes})
