"""A custom law in a user's script for a walker with heel and toe: every command accepts it."""

import runpy
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from gaitopt import InputError, load
from gaitopt.cli.planar_law_option import PlanarLawOption
from gaitopt.cli.script_law import custom_design
from gaitopt.control import define_law
from gaitopt.stability import assess_planar
from gaitopt.tuning import load_tuning

GAIT = Path("docs/examples/heel_toe.h5").resolve()
SCRIPT = '''
import numpy as np

from gaitopt import Law, feedforward
from gaitopt.control import control_function, define_law, law_inputs, planar_feedforward


@define_law
def foot_placement(state, plan, stiffness=100.0, damping=10.0, placement=0.0):
    """The faster the hip moves, the further ahead the swing leg is placed."""
    target = plan.q["b"] + placement * (state.v["x"] - plan.v["x"])
    error, rate_error = state.q["b"] - target, state.v["b"] - plan.v["b"]
    return {"motor": plan.torque["motor"] + stiffness * error + damping * rate_error}


def replay(robot, gait, torque_limit):
    """A law of several contacts in the general form."""
    return planar_feedforward(gait)


def one_foot(robot, motion, torque_limit=np.inf):
    """A law of one foot on the ground in the general form."""
    return feedforward(robot, motion)


def samples(robot, motion, torque_limit):
    return motion.segments


def single(robot, motion, torque_limit):
    inputs = law_inputs(robot)
    return Law("single", control_function(inputs, -inputs.q[2]), np.zeros(1), np.zeros((0, 1)))


def undecorated(state, plan):
    return {}


def text(robot, motion, torque_limit):
    return "a law"


class Spring:
    pass


number = 3
'''


@pytest.fixture
def script(folder):
    (folder / "mine.py").write_text(SCRIPT)
    return folder / "mine.py"


@pytest.mark.slow
def test_tuned_gains_make_the_unstable_gait_stable(script, command):
    (script.parent / "family.py").write_text(
        "from gaitopt.tuning import ControllerFamily, Gain\n"
        "from mine import foot_placement\n\n\n"
        "def bounded(robot, gait, torque_limit):\n"
        "    law = foot_placement(robot, gait, torque_limit, damping=5.0)\n"
        "    gains = Gain('stiffness', 60.0, 0.0, 300.0), Gain('placement', 0.3, 0.0, 1.0)\n"
        "    return ControllerFamily('foot placement', gains, law.with_gains)\n"
    )
    options = (
        "--law",
        "family.py:bounded",
        "--torque-limit",
        "30",
        "--starts",
        "1",
        "--samples",
        "0",
        "--evaluations",
        "5",
    )
    tuned = command("tune", GAIT, *options, "-o", "gains.json", "--json")
    assert tuned.status == 0, tuned.err
    assert tuned.json["radius_before"] > 3
    assert tuned.json["radius_after"] < 0.8
    assert (tuned.json["law"], set(tuned.json["gains"])) == ("family.py:bounded", {"stiffness", "placement"})
    stability = command("stability", GAIT, "--law", "gains.json", "--json")
    assert stability.json["gaits"][0]["radius"] == pytest.approx(tuned.json["radius_after"], rel=1e-9)
    family = PlanarLawOption("gains.json", [], None, False).family(load(GAIT))  # gaitopt tune --law gains.json
    assert {gain.name: gain.start for gain in family.gains} == load_tuning("gains.json").gains
    assert family.law({}).parts[0].table[-1, 0] == 30.0
    law = PlanarLawOption("gains.json", ["placement=0.2"], None, False).make(load(GAIT))
    assert law.gain_values == {
        "stiffness": load_tuning("gains.json").gains["stiffness"],
        "damping": 5.0,
        "placement": 0.2,
    }
    assert law.parts[0].table[-1, 0] == 30.0


@pytest.mark.slow
def test_the_other_commands_accept_it(script, command):
    law = ("--law", "mine.py:foot_placement", "--gain", "placement=0.3")
    assert command("stability", GAIT, *law, "--json").json["gaits"][0]["radius"] < 0.75
    walk = command("simulate", GAIT, *law, "--steps", "3", "--json")
    assert (walk.status, walk.json["steps"]) == (0, 3)
    over = ("--over", "a_rate=-1.047,-1.04", "--steps", "40", "--workers", "1")
    basin = command("basin", GAIT, *law, *over, "-o", "basin.nc", "--json")
    assert basin.json["saved_gait"] == 1.0
    for suffix in ("py", "c"):
        done = command("export", GAIT, *law, "-o", f"controller.{suffix}")
        assert done.status == 0, done.err
    gait, controller = load(GAIT), runpy.run_path("controller.py")["Controller"]()
    expected = PlanarLawOption("mine.py:foot_placement", ["placement=0.3"], None, False).make(gait)
    q, v = (part[:, 3] + 0.01 for part in (gait.motion.segments[0].q, gait.motion.segments[0].v))
    controller.begin(q, v)
    np.testing.assert_allclose(controller.step(0.05, q, v), expected.parts[0].torque_at(0.05, q, v), rtol=1e-12)
    refused = command("export", GAIT, *law, "-o", "gains.json")
    assert "Gains are written for robots with one foot on the ground at a time" in " ".join(refused.err.split())


def test_the_general_form_returns_a_planar_law(script):
    gait = load(GAIT)
    law = PlanarLawOption("mine.py:replay", [], 4.0, False).make(gait)
    assert (law.name, len(law.parts), law.parts[0].limited) == ("feedforward", 2, True)


def test_an_unknown_gain_is_reported(script):
    with pytest.raises(InputError, match=r"has no gain 'placemnt'. Did you mean 'placement'"):
        PlanarLawOption("mine.py:foot_placement", ["placemnt=0.2"], None, False).make(load(GAIT))


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (
            "undecorated",
            r"undecorated of .* is not the .*: its arguments are \(state, plan\); accepted are a function",
        ),
        ("Spring", "Spring of mine.py is a class; accepted are a function"),
        ("number", "number of mine.py must be a function, got an object of type int"),
        ("text", "must return a Law or a ControllerFamily, but returned str; accepted are a function"),
        ("single", "single of mine.py returns a Law. For a robot with several contacts, the function receives the"),
        (
            "one_foot",
            "motion must be a Motion .* got PlanarGait.* For a robot with several contacts, the function receives the",
        ),
        ("samples", "'PlanarGait' object has no attribute 'segments'. For a robot with several contacts"),
        ("foot_placemen", "has no function foot_placemen. Did you mean 'foot_placement'"),
    ],
)
def test_other_forms_get_a_sentence(script, command, function, message):
    with pytest.raises(Exception, match=message):
        PlanarLawOption(f"mine.py:{function}", [], None, False).make(load(GAIT))
    done = command("stability", GAIT, "--law", f"mine.py:{function}")
    assert (done.status, done.out) == (2, "")


def test_a_torque_that_is_not_finite_is_reported():
    @define_law
    def bounded(state, plan, width=0.1):
        return {"motor": plan.torque["motor"] + width * ca.tanh((state.q["b"] - plan.q["b"]) / width)}

    gait = load(GAIT)
    with pytest.raises(InputError, match="divisions by zero, also by a gain that is zero"):
        assess_planar(gait, bounded(gait.robot, gait, width=0.0))


def test_a_law_has_the_coordinates_and_actuators_of_its_robot(script):
    gait = load(GAIT.with_name("compass_slip.h5"))
    with pytest.raises(InputError, match="returns 1 torque, but the robot has 2: ankle, hip"):
        custom_design(Path("mine.py"), "single", gait.robot, gait.motion, 6.0)
    script.write_text(
        SCRIPT.replace("planar_feedforward(gait)", "planar_feedforward(load_gait())")
        + (f"\n\ndef load_gait():\n    from gaitopt import load\n\n    return load({str(GAIT)!r})\n")
    )
    with pytest.raises(InputError, match=r"returns a PlanarLaw. A robot with one foot on the ground needs a Law"):
        custom_design(Path("mine.py"), "replay", gait.robot, gait.motion, 6.0)
