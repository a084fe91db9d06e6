"""Figures of a robot whose points are all on the ground, which slides slowly and never tilts."""

import numpy as np
import pytest

from gaitopt import plot_gait
from gaitopt.ocp import solve_planar
from tests.ocp.multicontact_examples import inchworm
from tests.plot.test_gait_figure import axes_of, check_texts

SEQUENCE = "rear stick, front stick > rear stick, front slip+ > rear stick, front stick > rear slip+, front stick >"


@pytest.fixture(scope="module")
def figure():
    return plot_gait(solve_planar(inchworm(SEQUENCE)))


@pytest.mark.slow
def test_the_stick_figures_of_a_flat_robot_fill_the_width_and_leave_the_height_to_the_panels(figure):
    axes = axes_of(figure)
    check_texts(figure)
    assert axes["stick figures"].get_position().width > 0.95
    heights = [axes[name].get_position().height for name in ("angles", "lengths", "force ratio", "foot speed")]
    assert min(heights) > 0.07
    forces = [line for line in axes["stick figures"].lines if line.get_label() == "_force"]
    assert max(np.ptp(line.get_ydata()) for line in forces) > 0.02  # of a body of 0.25 m


@pytest.mark.slow
def test_a_coordinate_that_is_zero_but_for_rounding_has_a_range_of_one_unit(figure):
    axes = axes_of(figure)["angles"]
    values = axes.lines[0].get_ydata()
    assert np.abs(values[np.isfinite(values)]).max() < 1e-6
    assert axes.get_ylim() == pytest.approx((-0.5, 0.5))
    assert axes.yaxis.get_offset_text().get_text() == ""


@pytest.mark.slow
def test_a_sequence_has_two_lines_with_the_result_of_the_replay_at_their_end(figure):
    first, second = figure.get_suptitle().splitlines()[1:3]
    sequence = "rear stick, front stick > rear stick, front slip+ > rear stick, front stick > rear slip+, front stick >"
    assert f"{first} {second}" == f"'{sequence}' (not replayed)"
