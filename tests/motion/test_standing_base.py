"""The base of a recorded motion without its position follows from the standing foot."""

import numpy as np
import pytest

from gaitopt import InputError, load
from gaitopt.model import monopod
from gaitopt.motion import read_motion

ROLL = "heel a stick | toe a stick |"


@pytest.fixture(scope="module")
def gait():
    return load("docs/examples/heel_toe.h5")


def write(gait, folder, names):
    """Write the coordinates of a gait at the nodes of its phases."""
    motion, segments = gait.motion, gait.motion.segments
    time = np.concatenate([segment.time for segment in segments])
    q = np.concatenate([segment.q for segment in segments], axis=1)
    units = dict(zip(motion.coordinates, gait.robot.units, strict=True))
    header = ["time_s", *(f"{name}_{units[name]}" for name in names)]
    rows = np.vstack([time, *(q[motion.coordinates.index(name)] for name in names)]).T
    path = folder / "walk.csv"
    np.savetxt(path, rows, delimiter=",", header=",".join(header), comments="", fmt="%.15g")
    return path, time, dict(zip(motion.coordinates, q, strict=True))


@pytest.mark.parametrize("names", [("a", "b"), ("x", "a", "b"), ("y", "a", "b")])
def test_the_position_of_the_base_is_that_of_a_foot_at_rest_on_the_ground(gait, tmp_path, names):
    path, time, planned = write(gait, tmp_path, names)
    recorded = read_motion(path, gait.robot, parameters=gait.motion.parameters, sequence=ROLL)
    derived = {name: np.interp(time, recorded.time, recorded.coordinates[name]) for name in ("x", "y")}
    assert derived["y"] == pytest.approx(planned["y"], abs=2e-3)
    shift = planned["x"][0] if "x" not in names else 0.0
    assert derived["x"] == pytest.approx(planned["x"] - shift, abs=5e-3)
    missing = [name for name in ("y", "x") if name not in names]
    assert recorded.fit.warnings == (
        f"{' and '.join(missing)} {'are' if len(missing) > 1 else 'is'} not in the file: derived from heel a and then "
        "toe a, on the ground without slip",
    )
    assert f"warning: {recorded.fit.warnings[0]}" in str(recorded.fit)


def test_the_base_is_required_without_a_sequence_or_another_coordinate(gait, tmp_path):
    path, _, _ = write(gait, tmp_path, ("a", "b"))
    with pytest.raises(InputError, match="has no columns of the coordinates 'x', 'y'"):
        read_motion(path, gait.robot)
    path, _, _ = write(gait, tmp_path, ("a",))
    with pytest.raises(InputError, match="has no columns of the coordinates 'x', 'y', 'b'"):
        read_motion(path, gait.robot, sequence=ROLL)


@pytest.mark.parametrize("sequence", ["foot stick > flight |", "foot any |"])
def test_the_base_is_required_if_no_foot_stands_in_all_phases(tmp_path, sequence):
    path = tmp_path / "hop.csv"
    path.write_text("time_s,phi_rad,a_rad,s_m\n0,0,0,0.5\n0.2,0,0.1,0.5\n0.4,0,0.2,0.5\n")
    with pytest.raises(InputError, match="has no columns of the coordinates 'x', 'y'"):
        read_motion(path, monopod(), sequence=sequence)
