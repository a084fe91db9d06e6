"""The scripts of imported robots have the optima of the same robots written by hand."""

import pytest

from gaitopt.cli.script import call_script
from gaitopt.ocp import solve_planar
from gaitopt.simulation import verify_planar
from tests.conftest import ROOT

pytest.importorskip("mujoco")


def solve_script(name):
    gait = verify_planar(solve_planar(call_script(ROOT / "problems" / f"{name}.py", [])))
    assert gait.status.ok, gait.solver.violations
    assert gait.verification.passed, gait.verification.reasons
    return gait


def test_the_five_links_of_a_urdf_file_have_the_reference_optimum():
    """Source: the five-link walker of the size of RABBIT, computed independently of this package: 76.662."""
    gait = solve_script("imported_urdf")
    assert gait.solver.objective == pytest.approx(76.662, abs=0.005)
    assert gait.energy.actuator == pytest.approx(gait.energy.impact_loss, rel=1e-6)


@pytest.mark.slow
def test_the_monopod_of_an_mjcf_file_hops_like_that_of_the_catalogue():
    imported, written = solve_script("imported_mjcf"), solve_script("monopod")
    assert imported.solver.objective == pytest.approx(written.solver.objective, rel=1e-6)
    assert imported.motion.events[-1].impulse[0] == pytest.approx(written.motion.events[-1].impulse[0], rel=1e-4)
    assert abs(written.motion.channel("q")[written.robot.coordinates.index("phi")]).max() < 0.5
