"""A parameter that a robot has, but the function of its script does not accept: the error states how it is set."""

import pytest

from gaitopt.cli.script import call_script, read_script
from gaitopt.errors import InputError

SINGLE = """\
from gaitopt import GaitProblem, compass_biped


def problem(ARGUMENTSspeed=0.6):
    return GaitProblem(
        robot=compass_biped(), sequence="stick | stick", friction=0.14, speed=speed, step_length=0.45, PASSED
    )
"""
SEVERAL = """\
from gaitopt.model import monopod
from gaitopt.ocp import PlanarProblem


def problem(ARGUMENTSspeed=1.5):
    return PlanarProblem(
        robot=monopod(), sequence="foot stick > flight |", friction=1.0, speed=speed, step_length=0.6, PASSED
    )
"""
PASSIVE = """\
from gaitopt import WalkProblem, rimless_wheel


def problem(ARGUMENTSfriction=0.3):
    return WalkProblem(robot=rimless_wheel(), PASSED)
"""
LINES = {
    "hip_mass": (SINGLE, "hip_mass=2", "parameters={'hip_mass': hip_mass}", "GaitProblem"),
    "slope": (SINGLE, "slope=0", "slope=slope", "GaitProblem"),
    "body_mass": (SEVERAL, "body_mass=8", "parameters={'body_mass': body_mass}", "PlanarProblem"),
    "mass": (PASSIVE, "mass=1", "parameters={'mass': mass}", "WalkProblem"),
}


@pytest.mark.parametrize("name", LINES)
def test_the_stated_change_makes_the_parameter_settable(script, name):
    text, argument, passed, kind = LINES[name]
    path = script(text.replace("ARGUMENTS", "").replace("PASSED", ""))
    hint = f"to set it, add the argument {argument} to problem() and pass {passed} to {kind}."
    with pytest.raises(InputError, match="has no parameter") as refused:
        read_script(path, [f"{name}=0.25"])
    assert str(refused.value).endswith(f"{name!r} is a parameter of the robot: {hint}")
    changed = script(text.replace("ARGUMENTS", f"{argument}, ").replace("PASSED", passed), "changed.py")
    stated = call_script(changed, [f"{name}=0.25"])
    assert getattr(stated, name, stated.parameters.get(name)) == 0.25


@pytest.mark.parametrize("text", [SINGLE, "def problem(speed=1):\n    raise ValueError\n"])
def test_an_unknown_name_has_no_such_hint(script, text):
    with pytest.raises(InputError) as refused:
        read_script(script(text.replace("ARGUMENTS", "").replace("PASSED", "")), ["nose=1"])
    assert str(refused.value).endswith("Known: speed.")
