"""Import of URDF and MJCF files: against a robot written by hand, and against the dynamics of MuJoCo itself."""

from pathlib import Path

import numpy as np
import pytest

from gaitopt import InputError
from gaitopt.model import check_planar, import_planar
from gaitopt.model.importing import mechanism
from tests.ocp.multicontact_examples import five_link

mujoco = pytest.importorskip("mujoco")

FOLDER = Path(__file__).parent
CONTACTS = {f"{side} foot": (f"{side}_shank", (0, 0, -0.4)) for side in ("left", "right")}
MIRROR = {"left_hip": "right_hip", "left_knee": "right_knee", "left foot": "right foot"}
MOTORS = {f"left {joint} motor": f"right {joint} motor" for joint in ("hip", "knee")}
HOPPER = """<mujoco model="hopper"><worldbody><body name="body">
<joint name="ahead" type="slide" axis="1 0 0"/><joint name="height" type="slide" axis="0 0 1" ref="0.5"/>
<geom type="sphere" size="0.1" mass="2"/>
<body name="leg" pos="0 0 -0.3"><joint name="leg" type="slide" axis="0 0 -1" stiffness="500" springref="0.1"/>
<inertial pos="0 0 -0.1" mass="0.5" diaginertia="0.01 0.01 0.001"/></body></body></worldbody></mujoco>"""


def imported(kind, **changes):
    return import_planar(FOLDER / f"five_link.{kind}", **({"contacts": CONTACTS} | changes))


def evaluate(function, *arguments):
    return [np.array(part, dtype=float).squeeze() for part in function.call(list(arguments))]


@pytest.mark.parametrize("kind", ["urdf", "xml"])
def test_it_is_the_robot_that_is_written_by_hand(kind, rng):
    """The hand-written robot has forward angles of torso and thighs and flexions of the knees."""
    robot, other = imported(kind).robot, five_link()
    p, p_other = (each.vector(each.resolve({"slope": 0.1})) for each in (robot, other))
    for _ in range(5):
        x, y, pitch, *legs = rng.uniform(-0.5, 0.5, 7)
        v = rng.normal(size=7)

        def angles(part):  # hip joints turn forward from the torso; knees flex backward
            return [part[0], part[1], part[2], part[3] - part[2], part[4], part[5] - part[2], part[6]]

        q = np.array([x, y, pitch, *legs])
        ours, theirs = (q, v), (np.array(angles(q)), np.array(angles(v)))
        assert sum(evaluate(robot.energy, *ours, p)[0:1]) == pytest.approx(evaluate(other.energy, *theirs, p_other)[0])
        potential = [
            evaluate(each.energy, *state, values)[1]
            for each, state, values in ((robot, ours, p), (other, theirs, p_other))
        ]
        assert potential[0] == pytest.approx(potential[1])
        heights = [
            evaluate(each.gaps, state[0], values)[0]
            for each, state, values in ((robot, ours, p), (other, theirs, p_other))
        ]
        assert heights[0] == pytest.approx(heights[1])


def test_the_mass_matrix_is_that_of_mujoco(rng):
    """MuJoCo counts rotations about y clockwise, like the pitch, and positions of the base in its own frame."""
    robot, model = imported("xml").robot, mujoco.MjModel.from_xml_path(str(FOLDER / "five_link.xml"))
    data, p = mujoco.MjData(model), robot.vector(robot.resolve({}))
    for _ in range(5):
        q = rng.uniform(-0.6, 0.6, 7)
        data.qpos[:] = [q[0], 0, q[1], np.cos(q[2] / 2), 0, np.sin(q[2] / 2), 0, *q[3:]]
        mujoco.mj_forward(model, data)
        full = np.zeros((model.nv, model.nv))
        for unit, column in zip(np.eye(model.nv), full, strict=True):
            mujoco.mj_mulM(model, data, column, unit)
        planar = [0, 2, 4, *range(6, 10)]
        assert evaluate(robot.dynamics, q, np.zeros(7), p)[0] == pytest.approx(full[np.ix_(planar, planar)], abs=1e-12)


@pytest.mark.parametrize(("kind", "mirror"), [("urdf", MIRROR), ("xml", MIRROR | MOTORS)])
def test_it_passes_its_check(kind, mirror):
    assert check_planar(imported(kind, mirror=mirror).robot).passed


def test_what_is_dropped_is_reported():
    dropped = imported("urdf").dropped
    assert "Joint 'left_roll' (hinge, axis 1, 0, 0) is fixed in its zero position." in dropped
    assert "The range of joint 'left_knee', 0 to 2, is omitted." in dropped
    assert "Lateral distances of centres of mass, up to 0.1 m, are omitted." in dropped
    assert imported("xml").dropped[-1] == "1 shapes are omitted."


def test_masses_are_parameters_and_actuators_those_of_the_file():
    robot = imported("xml").robot
    assert robot.resolve({})["left_thigh_mass"] == 6.8
    assert float(robot.mass(robot.vector(robot.resolve({"torso_mass": 20})))) == pytest.approx(40)
    assert robot.actuators == ("left hip motor", "left knee motor", "right hip motor", "right knee motor")
    assert imported("urdf").robot.actuators == ("left_hip", "left_knee", "right_hip", "right_knee")
    assert imported("urdf", actuated=["left_hip"]).robot.actuators == ("left_hip",)


def test_a_file_with_slides_at_its_root_has_no_further_base():
    robot = import_planar(HOPPER, contacts={"sole": ("leg", (0, 0, -0.2))}).robot
    assert (robot.coordinates, robot.travel) == (("ahead", "height", "leg"), "ahead")
    p = robot.vector(robot.resolve({}))
    q = [0.3, 0.9, 0.05]
    assert evaluate(robot.gaps, q, p)[0] == pytest.approx(0.9 - 0.5 - 0.3 - 0.05 - 0.2)
    assert evaluate(robot.force_powers, q, [0, 0, 0], p)[0] == pytest.approx(500 * 0.05**2 / 2)


@pytest.mark.parametrize(
    ("source", "changes", "message"),
    [
        ("nowhere.urdf", {}, "There is no file nowhere.urdf"),
        ("<robot>", {}, "MuJoCo cannot read the robot"),
        (HOPPER, {"contacts": {"sole": ("legs", (0, 0, 0))}}, "on body 'legs', which is not in the file. Did you mean"),
        (HOPPER, {"contacts": {"sole": ("leg", (0, 0))}}, "must have three finite coordinates"),
        (HOPPER, {"actuated": ["knee"]}, "actuated names 'knee', which is not a planar joint"),
        ("<mujoco><worldbody/></mujoco>", {}, "must have one root body, which has no parent, got none"),
    ],
)
def test_invalid_sources_are_refused(source, changes, message):
    with pytest.raises(InputError, match=message):
        import_planar(source, **({"contacts": {"sole": ("leg", (0, 0, -0.2))}} | changes))


def test_without_mujoco_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)
    with pytest.raises(InputError, match=r"pip install 'gaitopt\[import\]'"):
        mechanism.read_mechanism(HOPPER)
