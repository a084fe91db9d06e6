"""Every problem script takes its parameters; those of optimised gaits give a verified gait at their defaults."""

import functools
import inspect
import math
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from gaitopt import Collocation, GaitProblem, InputError, check_robot, replay, solve, verify
from gaitopt.cli.script import build_problem, call_script, load_script, script_parameters
from gaitopt.ocp.solution import grid_solve
from gaitopt.ocp.transcription.method_names import TRANSCRIPTIONS

SCRIPTS = [
    path
    for path in sorted((Path(__file__).parents[2] / "problems").glob("*.py"))
    if "def study(" not in path.read_text() and (find_spec("mujoco") or not path.stem.startswith("imported"))
]
OPTIMISED = [path for path in SCRIPTS if isinstance(call_script(path, []), GaitProblem)]

every_script = pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
every_optimised = pytest.mark.parametrize("path", OPTIMISED, ids=lambda path: path.stem)


def test_the_optimised_scripts_are_here():
    assert {"compass_slip", "compass_stick", "five_link"} <= {path.stem for path in OPTIMISED}


@every_script
def test_it_has_keyword_defaults_only(path):
    function = load_script(path)
    kinds = {parameter.kind for parameter in inspect.signature(function).parameters.values()}
    assert kinds <= {inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY}
    assert len(script_parameters(function)) == len(inspect.signature(function).parameters)
    function()


def resolved(problem):
    """Return the problem as plain data, without the record of its script, which names every setting."""
    return problem.replace(script=None).describe()


@every_optimised
def test_every_parameter_can_be_set_to_its_default(path):
    defaults = script_parameters(load_script(path))
    plain = build_problem(path, [])
    again = build_problem(path, [f"{name}={value}" for name, value in defaults.items()])
    assert again.script.parameters == plain.script.parameters == defaults
    assert again.script.changed == tuple(defaults)
    assert resolved(again) == resolved(plain)


@every_optimised
def test_every_number_changes_the_problem(path):
    plain = resolved(build_problem(path, []))
    for name, value in script_parameters(load_script(path)).items():
        if isinstance(value, int | float):
            changed = value * 1.5 if isinstance(value, float) and value else value + 1
            assert resolved(build_problem(path, [f"{name}={changed}"])) != plain, name


QUICK = {"five_link": ["sequence=stick | stick", "intervals=40"]}
"""Settings of scripts whose defaults take long; tests/benchmarks solves those."""


@functools.cache
def solved(path, method="collocation"):
    problem = build_problem(path, [*QUICK.get(path.stem, []), f"transcription={method}"])
    return problem, verify(solve(problem))


SLOW = ("five_link", "multiple_shooting")
"""Shooting needs minutes where errors grow 50 000 times within a step; tests/benchmarks solves that."""

PAIRS = [(path, method) for path in OPTIMISED for method in TRANSCRIPTIONS if (path.stem, method) != SLOW]


@pytest.mark.slow
@pytest.mark.parametrize(("path", "method"), PAIRS, ids=[f"{path.stem}-{method}" for path, method in PAIRS])
def test_it_is_solved_and_verified(path, method):
    problem, gait = solved(path, method)
    assert gait.status.ok, gait.solver.violations
    assert gait.verification.passed, gait.verification.reasons
    assert gait.sequence == problem.sequence


@pytest.mark.slow
@pytest.mark.parametrize("path", [path for path in OPTIMISED if path.stem != SLOW[0]], ids=lambda path: path.stem)
def test_both_transcriptions_give_the_same_cost(path):
    costs = [solved(path, method)[1].cost_of_transport for method in TRANSCRIPTIONS]
    assert costs[0] == pytest.approx(costs[1], rel=1e-3)


@every_optimised
def test_the_transcription_is_that_of_the_parameter(path):
    for method, kind in TRANSCRIPTIONS.items():
        assert type(build_problem(path, [f"transcription={method}"]).transcription) is kind


@every_optimised
def test_an_unknown_transcription_is_refused(path):
    with pytest.raises(InputError, match="Did you mean 'collocation'"):
        build_problem(path, ["transcription=colocation"])


@pytest.mark.slow
def test_the_five_link_walker_keeps_its_knees_from_bending_backwards():
    problem, gait = solved(SCRIPTS[0].parent / "five_link.py")
    assert check_robot(problem.robot).passed
    for knee in ("stance knee", "swing knee"):
        angles = np.concatenate([segment.q[2 + gait.motion.angles.index(knee)] for segment in gait.motion.segments])
        assert angles.min() > 0.02 - 1e-4  # held at nodes, sampled between them too


@pytest.mark.slow
def test_the_five_link_walker_lifts_its_feet_in_replay_too():
    problem, gait = solved(SCRIPTS[0].parent / "five_link.py")
    walked, clearance = replay(gait).motion, problem.limits.clearance
    assert clearance == 0.02
    ahead, height = np.hstack([_swing_foot(segment, walked.points) for segment in walked.segments])
    assert np.all(height >= clearance * (1 - (ahead / ahead[-1]) ** 2) ** 2 - 1e-5)
    assert np.interp(0, ahead, height) == pytest.approx(clearance, abs=1e-4)  # it costs something


@pytest.mark.slow
def test_the_optimum_of_the_five_link_walker_is_a_strict_minimum():
    """Without typical sizes of its unknowns its least curvature counted as zero."""
    _, gait = solved(SCRIPTS[0].parent / "five_link.py")
    assert gait.certificate.verdict == "strict"


def _swing_foot(segment, points):
    """Return how far ahead of the stance foot and how high the swing foot is, on many samples between those stored."""
    place = segment.points[:, points.index("swing foot")] - segment.q[:2]
    return CubicSpline(segment.time, place, axis=1)(np.linspace(*segment.time[[0, -1]], 2000))


@pytest.mark.slow
def test_a_grid_on_which_the_foot_is_too_low_between_nodes_is_doubled(monkeypatch):
    problem = build_problem(SCRIPTS[0].parent / "five_link.py", ["sequence=stick | stick"])
    coarse = problem.replace(friction=math.inf, transcription=Collocation(intervals=6, tolerance=10))
    fine = solve(coarse)
    assert fine.problem["intervals"] > [6]
    assert fine.solver.warnings == ()
    monkeypatch.setattr(grid_solve, "SCUFF", 1.0)
    left = solve(coarse)
    assert left.problem["intervals"] == [6]
    assert "below Limits.clearance between nodes" in left.solver.warnings[0]


def test_the_two_compass_scripts_differ_in_their_sequence_only():
    slip, stick = (
        resolved(build_problem(path, [])) for path in OPTIMISED if path.stem in ("compass_slip", "compass_stick")
    )
    different = {name for name in slip if slip[name] != stick[name]}
    assert {"sequence", "intervals"} <= different <= {"sequence", "intervals", "name"}
