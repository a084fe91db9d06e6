"""gaitopt doctor FILE: what a file is, and what is wrong with it."""

import h5py
import pytest

from gaitopt import GaitProblem, Limits, MultipleShooting, basin, compass_biped, rimless_wheel, sweep
from tests.hdf5 import edit_hdf5


@pytest.fixture
def swept(folder):
    problem = GaitProblem(
        robot=compass_biped(),
        sequence="stick | stick",
        speed=0.6,
        step_length=0.45,
        limits=Limits(torque=6),
        objective="torque_squared",
        transcription=MultipleShooting(intervals=8),
    )
    sweep(problem, {"friction": [0.3]}, starts=1, path=folder / "sweep.nc")
    return folder / "sweep.nc"


def test_intact_files_of_every_kind(command, folder, root, slip_file, swept):
    basin(rimless_wheel(), {"slope": 0.23}, {"theta_rate": [0.1, 2.0]}, path=folder / "basin.nc")
    for path, kind, content in [
        (slip_file, "gait", "slip+ stick | slip+, robot compass_biped, solved"),
        (swept, "sweep", "1 point, 1 gait"),
        (folder / "basin.nc", "basin", "2 starts"),
        (root / "docs/examples/compass_slope.nc", "branch diagram", "5 branches"),
    ]:
        done = command("doctor", path, "--json")
        facts = done.json
        assert (done.status, facts["well"], facts["error"]) == (0, True, "")
        assert (facts["kind"], facts["checksum"], facts["content"]) == (kind, True, content)
    assert "checksum  agrees with the content" in command("doctor", slip_file).out


def test_what_is_wrong_is_stated(command, folder, root, slip_file, swept):
    damaged = folder / "damaged.h5"
    damaged.write_bytes(slip_file.read_bytes()[:5000])
    with h5py.File(folder / "foreign.h5", "w") as file:
        file["x"] = 1.0
    with edit_hdf5(swept) as file:
        (gait,) = file["word_gaits"].values()
        del gait["solver"]
    with h5py.File(folder / "unknown.h5", "w") as file:
        file.attrs["format"] = "gaitopt poem"
    for path, message in [
        (damaged, "is not a readable HDF5 file"),
        (folder / "foreign.h5", "was not written by gaitopt"),
        (folder / "unknown.h5", "has the unknown kind 'poem'; known kinds are gait, "),
        (folder / "nowhere.h5", "There is no file"),
        (swept, "is damaged: KeyError"),
    ]:
        done = command("doctor", path)
        assert done.status == 1
        assert message in done.out
    old = command("doctor", root / "tests/motion/compass_slip_version_2.h5")
    assert old.status == 0
    assert "checksum  none, as in files of earlier versions" in old.out
