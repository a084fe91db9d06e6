"""A file name, the name of a law or a gait where another object is needed is refused in a sentence."""

import math
import sys
from pathlib import Path
from types import ModuleType

import casadi as ca
import numpy as np
import pytest

from gaitopt import (
    ContactSequence,
    Damper,
    InputError,
    Keyframes,
    Parameter,
    PointMass,
    Spring,
    animate,
    assess_stability,
    check_robot,
    compare,
    compass_biped,
    joint_pd,
    load,
    plot_gait,
    push_off,
    replay,
    save,
    tune_feedback,
    verify,
    write_csv,
    write_report,
    write_torques,
)
from gaitopt.arguments import is_masked
from gaitopt.control import limit_torque
from gaitopt.study import Pareto

FILE = "gait.h5"
GAIT_NEEDED = rf"gait must be a Gait such as load\(\"gait.h5\"\) or solve\(problem\), got '{FILE}'"
CALLS = {
    "plot_gait": lambda: plot_gait(FILE),
    "animate": lambda: animate(FILE, "gait.gif"),
    "replay": lambda: replay(FILE),
    "verify": lambda: verify(FILE),
    "assess_stability": lambda: assess_stability(FILE),
    "tune_feedback": lambda: tune_feedback(FILE, "lqr"),
    "compare": lambda: compare({"slipping": FILE}),
    "compare a list": lambda: compare([FILE]),
    "write_report": lambda: write_report({"slipping": FILE}, "report.html"),
    "save": lambda: save(FILE, "copy.h5"),
}


def test_several_gaits_are_compared_as_a_list(slip_gait):
    with pytest.raises(
        InputError, match=r"gaits is a single argument; several are given as a list, compare\(\[\.\.\., "
    ):
        compare(slip_gait, slip_gait)
    with pytest.raises(InputError, match=r"needs several gaits: a list, compare\(\[gait, other\]\), or a mapping"):
        compare(slip_gait)
    for file in (FILE, Path(FILE)):
        with pytest.raises(InputError, match=r"compare needs gaits, not the name of a file, got 'gait.h5': load the"):
            compare(file)


@pytest.mark.parametrize("name", CALLS)
def test_a_file_is_no_gait(name):
    with pytest.raises(InputError, match=GAIT_NEEDED):
        CALLS[name]()


def test_a_name_is_no_law(slip_gait):
    with pytest.raises(InputError, match=r"law must be a Law such as lqr\(robot, gait.motion\), got 'lqr'"):
        assess_stability(slip_gait, "lqr")
    with pytest.raises(InputError, match="family must be a ControllerFamily such as controller_family_named"):
        tune_feedback(slip_gait, "lqr")


@pytest.mark.parametrize("write", [write_csv, write_torques])
def test_a_gait_is_no_motion(write, slip_gait, compass, tmp_path):
    with pytest.raises(InputError, match=r"motion must be a Motion such as gait.motion, got Gait\("):
        write(slip_gait, tmp_path / "file")
    with pytest.raises(InputError, match=r"motion must be a Motion such as gait.motion, got Gait\("):
        joint_pd(compass, slip_gait)


def test_keyframes_need_angles_by_name():
    with pytest.raises(InputError, match=r"Keyframes.angles must be angles by name such as \{\"th1\": \["):
        Keyframes([0, 0.5, 1], np.zeros((3, 2)))


RECORDS = {
    "mass as a text": (
        lambda: PointMass("6", ca.SX.sym("p", 2)),
        r"PointMass: mass must be a finite number or a CasADi expression \(SX\), got '6'",
    ),
    "stiffness of the module math": (
        lambda: Spring(ca.SX.sym("q"), math.sin(ca.SX.sym("q"))),
        r"Spring: stiffness must be a finite number or a CasADi expression \(SX\), got nan: either .* casadi.sin",
    ),
    "a truth value": (lambda: Damper(ca.SX.sym("q"), True), "Damper: damping must be"),
    "default that is nan": (lambda: Parameter("a", np.nan, "m", ""), "Parameter: default must be a number, got nan"),
    "phases as a text": (lambda: ContactSequence("6", None), "ContactSequence: phases must be a sequence of a Mode"),
    "matrix instead of names": (lambda: Pareto(objectives=ca.MX.sym("x", 2)), "Pareto: objectives must be"),
    "seed below zero": (lambda: check_robot(compass_biped(), seed=-1), "seed must be at least 0"),
}


@pytest.mark.parametrize("name", RECORDS)
def test_records_check_their_arguments_when_they_are_made(name):
    make, message = RECORDS[name]
    with pytest.raises(InputError, match=message):
        make()


def test_numbers_are_expressions():
    assert PointMass(2, ca.DM([0, 1])).mass == 2
    assert Spring(ca.SX.sym("q"), 5.0, np.float64(0.1)).stiffness == 5.0


def test_arguments_that_fitted_before_are_compared_again_if_their_type_differs():
    """1 == 1.0 == True, and only the first two are numbers."""
    Parameter("mass", 1.0, "kg", "")
    Parameter("mass", 1, "kg", "")
    with pytest.raises(InputError, match="Parameter: default must be a number, got True"):
        Parameter("mass", True, "kg", "")


def test_a_masked_array_is_recognised_while_another_thread_imports_its_module(monkeypatch):
    monkeypatch.setitem(sys.modules, "numpy.ma", ModuleType("numpy.ma"))
    assert not is_masked(np.ones(2))


def test_limits_of_a_law_are_any_sequence_of_numbers():
    law = push_off(compass_biped(), torque=-9.0, duration=0.1)
    assert limit_torque(law, range(5, 7)).limited
    for wrong in (np.eye(2), [1.0, 2.0, 3.0], [1.0, -1.0], [1.0, np.nan]):
        with pytest.raises(InputError, match="limits must be 2 positive numbers"):
            limit_torque(law, np.array(wrong))


def test_a_simulation_has_a_largest_number_of_steps():
    with pytest.raises(InputError, match=r"steps must be at least 1 and at most 1e\+06"):
        replay(load(Path(__file__).parents[1] / "docs/examples/compass_slip.h5"), steps=2**70)
