"""Errors caused by wrong types name the argument; others stay as they are."""

import importlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol

import attrs
import numpy as np
import pytest
from numpy.typing import NDArray

import gaitopt
from gaitopt import GaitProblem, InputError, Limits, compass_biped
from gaitopt.arguments import check_arguments
from gaitopt.design import RobustProblem
from gaitopt.model import monopod
from gaitopt.ocp import PlanarProblem


class Engine(Protocol):
    def flow(self) -> None: ...


class Scipy:
    def flow(self):
        pass


@pytest.mark.parametrize(
    ("kind", "right", "wrong", "message"),
    [
        (float, [1.0, 2, np.float64(3), np.array(1.5)], ["6", None, True, 1j, float("nan"), np.zeros(2)], "a number"),
        (int, [1, np.int64(2)], [1.5, True, "1"], "a whole number"),
        (bool, [True, np.bool_(False)], [1, "yes"], "True or False"),
        (str, ["a"], [b"a", 1, None], "a string"),
        (str | Path | None, ["a", Path("a"), None], [1, b"a"], "a string or a path or None"),
        (Literal["a", "b"], ["a"], ["c", 1], "'a' or 'b'"),
        (Sequence[float], [[1.0], (1, 2), np.ones(2)], ["12", {1: 2}, ["a"], 3, {1}.__iter__()], "a sequence of"),
        (tuple[int, int], [(1, 2), [1, 2]], [(1,), (1.5, 2), 1], "a sequence of a whole number"),
        (Iterable[str], [["a"], iter("a")], ["a", 1], "a sequence of a string"),
        (
            Mapping[str, float],
            [{"a": 1.0}, {}],
            [{1: 1.0}, {"a": "b"}, [1], None],
            "a mapping from a string to a number",
        ),
        (NDArray[np.float64], [np.ones(2), [1, 2]], [1.0, "a", [None], np.array([np.nan])], "an array of finite"),
        (Callable[[int], int], [len], [1], "a function"),
        (Engine, [Scipy()], [1, None], "an Engine"),
        (Any, [1, None], [], ""),
        ("NoSuchType", [1, None], [], ""),
    ],
)
def test_types_and_their_names(kind, right, wrong, message):
    def fail(value):
        raise KeyError("inside")

    fail.__annotations__["value"] = kind
    checked = check_arguments(fail)
    for value in right:
        with pytest.raises(KeyError, match="inside"):
            checked(value)
    for value in wrong:
        with pytest.raises(InputError, match=f"fail: value must be {message}.*, got "):
            checked(value=value)


def test_the_function_that_was_called_is_named_not_one_inside():
    @check_arguments
    def inner(width: float):
        return width + 1

    @check_arguments
    def outer(height: float):
        return inner(height)

    with pytest.raises(InputError, match="outer: height must be a number, got 'a'"):
        outer("a")

    @check_arguments
    def loose(height):
        return inner(height)

    with pytest.raises(InputError, match="inner: width must be a number, got 'a'"):
        loose("a")


def test_a_class_stays_a_class_and_a_call_that_succeeds_is_as_before():
    @check_arguments
    @dataclass(frozen=True)
    class Mass:
        value: float

        def __post_init__(self):
            object.__setattr__(self, "value", self.value + 0.0)

    assert Mass(1).value == 1.0
    assert isinstance(Mass(1), Mass)
    with pytest.raises(InputError, match="Mass: value must be a number, got None"):
        Mass(None)
    with pytest.raises(TypeError, match="missing 1 required positional argument"):
        Mass()


def test_an_object_without_text_is_described_by_its_type():
    class Silent:
        def __repr__(self):
            raise ValueError

    @check_arguments
    def double(width: float):
        return 2 * width + 1

    with pytest.raises(InputError, match="width must be a number, got a Silent"):
        double(Silent())


@pytest.mark.parametrize(
    "wing", ["model", "ocp", "control", "simulation", "stability", "tuning", "continuation", "design", "study", "plot"]
)
def test_an_unknown_keyword_of_a_public_option_is_reported_in_a_sentence(wing):
    module = importlib.import_module(f"gaitopt.{wing}")
    public = [getattr(module, name) for name in dir(module) if name[0].isupper()]
    options = [each for each in public if attrs.has(each) or each.__name__.endswith("Problem")]
    for option in options:
        with pytest.raises(InputError, match=f"{option.__name__} has no argument 'no_such_option'. "):
            option(no_such_option=1)


def test_an_unknown_keyword_has_the_most_similar_one():
    with pytest.raises(InputError, match=r"Limits has no argument 'torqe'. Did you mean 'torque'\?"):
        Limits(torqe=6)
    with pytest.raises(InputError, match="Ipopt has no argument 'tolerence'") as of_ipopt:
        gaitopt.Ipopt(tolerence=1e-8)
    assert "_deadline" not in str(of_ipopt.value)
    with pytest.raises(InputError, match="Limits has no argument 'torqe'"):
        attrs.evolve(Limits(), torqe=6)
    with pytest.raises(InputError, match=r"load has no argument 'file'. Known: path\."):
        gaitopt.load("gait.h5", file=1)


@pytest.mark.parametrize("law", [gaitopt.lqr, gaitopt.step_lqr, gaitopt.joint_pd])
def test_a_law_of_robots_with_one_foot_on_the_ground_names_that_of_several_contacts(law):
    with pytest.raises(InputError, match=rf"PlanarRobot 'monopod' is for planar_{law.__name__}\."):
        law(monopod(), None)


def test_arguments_that_must_be_named_are_listed():
    with pytest.raises(InputError, match=r"only the arguments robot, motion .* by name: stiffness=\.\.\., damping="):
        gaitopt.joint_pd(gaitopt.compass_biped(), None, 20, 5)
    with pytest.raises(TypeError, match="missing 1 required positional argument"):
        gaitopt.joint_pd(gaitopt.compass_biped())


def test_the_problem_of_an_optimal_gait_is_followed_by_another_function():
    problem = gaitopt.GaitProblem(robot=gaitopt.compass_biped(), sequence="stick | stick", friction=0.2, speed=0.6)
    with pytest.raises(InputError, match=r"trace_optimum follows the optimal gaits of a GaitProblem\."):
        gaitopt.trace(problem, {"friction": (0.1, 0.2)})


@pytest.mark.parametrize("parameters", [["hip_mass"], "hip_mass"])
def test_the_accepted_name_of_an_object_is_not_reported_instead_of_a_wrong_argument(parameters):
    with pytest.raises(InputError, match=r"^GaitProblem: parameters must be a mapping from a string to a number, got"):
        GaitProblem(robot=compass_biped(), sequence="stick | stick", parameters=parameters)


def test_robust_gaits_have_one_foot_on_the_ground():
    problem = PlanarProblem(robot=monopod(), sequence="foot stick > flight |", friction=1, speed=1, step_length=0.5)
    with pytest.raises(InputError, match=r"with one foot on the ground .* tune a law of its gait for several friction"):
        RobustProblem(problem, gaitopt.Scenarios(ranges={"friction": (0.5, 0.9)}))


def test_parameters_of_a_robot_belong_to_its_problem():
    with pytest.raises(InputError, match=r"no arguments\. State .* in the problem: parameters=\{'leg_length': 2\}\."):
        compass_biped(leg_length=2)
    with pytest.raises(InputError, match=r"monopod has no arguments\. .* parameters=\{\.\.\.\}\."):
        monopod(2)
