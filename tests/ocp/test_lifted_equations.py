"""Optima with recursive and with lifted equations."""

import numpy as np
import pytest

from gaitopt import InputError, Ipopt
from gaitopt.ocp import FromPlanarGait, solve_planar
from gaitopt.ocp.multicontact.planar_bounds import planar_structure
from gaitopt.ocp.multicontact.planar_start import planar_start
from gaitopt.ocp.multicontact.planar_transcription import transcribe_planar
from gaitopt.ocp.nlp.keys import Kind, Unknown
from tests.ocp.multicontact_examples import drag, hop, march, stride, walk


def count_joint_rows(gait):
    return sum("joint coordinate" in row for table in gait.solution.unknowns.values() for row in table.rows)


@pytest.mark.slow
@pytest.mark.parametrize(
    "problem",
    [stride(), stride(friction=0.2).replace(sequence="slip+ stick | slip+"), march(9), hop(), drag()],
    ids=["five links", "slip", "nine links", "flight", "double support"],
)
def test_both_forms_have_the_same_optimum(problem):
    recursive = solve_planar(problem.replace(equations="recursive"))
    assert recursive.status.ok
    # Long chains have several local optima: their second solve starts from the motion of the first one.
    guess = FromPlanarGait(recursive) if problem.robot.n_q > 10 else problem.guess
    lifted = solve_planar(problem.replace(equations="lifted", guess=guess))
    assert lifted.status.ok
    assert lifted.solver.objective == pytest.approx(recursive.solver.objective, rel=1e-8)
    assert count_joint_rows(recursive) == 0
    assert (count_joint_rows(lifted) > 0) == (problem.robot.lifted.n_j > 0)
    np.testing.assert_allclose(lifted.motion.channel("force"), recursive.motion.channel("force"), atol=1e-2)
    assert lifted.energy.relative_residual == pytest.approx(recursive.energy.relative_residual, rel=1e-3, abs=1e-7)


def test_the_form_depends_on_the_number_of_coordinates():
    assert [march(links).lifted for links in (5, 7, 9, 21)] == [False, False, True, True]
    assert not stride().lifted
    assert not walk().replace(equations="recursive").lifted
    assert stride(equations="lifted").lifted
    assert march(9).describe()["equations"] == "lifted"


def test_linear_systems_of_the_lifted_form_are_ordered_by_nested_dissection():
    options = [
        Ipopt(permute=True)._options(transcribe_planar(planar_structure(stride(equations=form))).nlp, None)
        for form in ("recursive", "lifted")
    ]
    assert "ipopt.mumps_pivot_order" not in options[0]
    assert options[1]["ipopt.mumps_pivot_order"] == 5
    assert options[1]["ipopt.mumps_permuting_scaling"] == 0
    assert ["ipopt.fast_step_computation" in each for each in options] == [False, True]


def test_the_initial_point_satisfies_the_rows_of_the_joints():
    problem = march(9)
    transcription = transcribe_planar(planar_structure(problem))
    x = planar_start(transcription, problem)
    data = [*problem.robot.vector(problem.values), 0, 0]
    g = np.array(transcription.nlp.values(x, data)[1]).ravel()
    rows = transcription.constraints
    for kind in (Kind.JOINT_ACCELERATION, Kind.JOINT_FORCE):
        assert np.abs(g[rows.find(kind)]).max() < 1e-9
    assert np.abs(x[transcription.variables[Unknown.ACCELERATION, 0]]).max() > 100  # joints carry the weight


def test_other_names_of_equations_are_invalid():
    with pytest.raises(InputError, match="equations must be one of"):
        stride(equations="symbolic")
