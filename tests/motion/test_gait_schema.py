"""A file whose checksum is right but whose content is inconsistent is refused in a sentence that names the place."""

import json

import h5py
import numpy as np
import pytest

from gaitopt import ArchiveError, load, save
from tests.hdf5 import edit_hdf5

PLANAR = "tests/problems/bounding_quadruped.h5"


def put(place, value):
    """Return a change that replaces a dataset."""

    def change(file):
        unit = file[place].attrs.get("unit", "1")
        del file[place]
        file.create_dataset(place, data=value).attrs["unit"] = unit

    return change


def fill(place, value):
    """Return a change of one number of a dataset."""

    def change(file):
        file[place][(0,) * file[place].ndim] = value

    return change


def remove(place):
    def change(file):
        for name in list(file[place]):
            del file[f"{place}/{name}"]

    return change


def swap(place):
    def change(file):
        put(place, file[place][...].T)(file)

    return change


def attribute(place, name, value):
    return lambda file: file[place].attrs.create(name, value)


def problem(**changes):
    def change(file):
        stored = json.loads(file.attrs["problem"]) | changes
        file.attrs["problem"] = json.dumps({name: value for name, value in stored.items() if value != "absent"})

    return change


def no_friction(file):
    del file["motion/parameters"].attrs["friction"]


WALKER = [
    (swap("motion/segments/0000/q"), "shape of q in phase 1 is"),
    (put("motion/segments/0001/force", np.zeros((2, 3))), "shape of force in phase 2"),
    (put("motion/segments/0000/time", 1.0), r"time of phase 1 is \(\), accepted: a vector of increasing times"),
    (put("motion/segments/0000/time", np.zeros(0)), "time of phase 1"),
    (fill("motion/segments/0000/time", 9.0), "time of phase 1"),
    (fill("motion/segments/0000/time", np.nan), "time of phase 1"),
    (fill("motion/segments/0000/torque", 1e200), r"torque in phase 1 is not finite, accepted: .* at most 1e\+100"),
    (put("motion/segments/0000/points", np.zeros((2, 1, 1))), "shape of points in phase 1"),
    (fill("motion/segments/0000/v", np.nan), "v in phase 1 is not finite"),
    (fill("motion/jumps/0000/impulse", np.inf), "impulse in touchdown 1 is not finite"),
    (put("motion/jumps/0000/q_next", np.zeros(9)), "shape of q_next in touchdown 1"),
    (attribute("motion/jumps/0000", "energy_lost", np.nan), "energy_lost of touchdown 1 is nan"),
    (remove("motion/segments"), "number of phases is 0, accepted: 1 to 1000"),
    (remove("motion/jumps"), "number of touchdowns is 0"),
    (attribute("motion", "total_mass", 0.0), "total mass is 0.0, accepted: > 0"),
    (attribute("motion", "total_mass", np.nan), "total mass is nan"),
    (attribute("motion", "links", "[[0, 99]]"), "links is .*accepted: numbers of points from 0 to"),
    (attribute("motion", "links", "[[-1, 0]]"), "links"),
    (attribute("motion/parameters", "leg_mass", -1.0), "parameter leg_mass is -1.0, accepted: >= 0"),
    (attribute("motion/parameters", "leg_com", np.nan), "parameter leg_com is nan, accepted: a number"),
    (attribute("motion/parameters", "gravity", 0.0), "parameter gravity is 0.0, accepted: > 0"),
    (no_friction, "parameter friction is missing"),
    (attribute("/", "problem", "[1]"), r"problem is \[1\], accepted: a JSON object"),
    (problem(objective="absent"), "objective of the problem"),
    (problem(torque_limit="high"), "torque_limit of the problem is high, accepted: numbers >= 0"),
    (problem(torque_limit={"hip": "high"}), "torque_limit of the problem"),
    (problem(intervals=[0]), "intervals of the problem"),
    (problem(objective_parameters=3), "objective_parameters of the problem"),
    (attribute("solver", "iterations", "many"), "iterations of solver is 'many', accepted: int"),
    (attribute("verification", "state_error", "small"), "state_error of verification"),
    (put("solution/unknowns/torque/multipliers", np.zeros((1, 1))), "shape of the multipliers of torque"),
    (attribute("solution/unknowns/torque", "rows", '["one"]'), "shape of torque"),
]
PLANAR_CHANGES = [
    (swap("motion/segments/0000/q"), "shape of q in phase 1"),
    (swap("motion/segments/0000/gap"), "shape of gap in phase 1"),
    (fill("motion/segments/0000/torque", np.nan), "torque in phase 1 is not finite"),
    (put("motion/events/0000/impulse", np.zeros(2)), "shape of impulse in event 1"),
    (attribute("motion", "units", '["m"]'), "number of units is 1, accepted: 7"),
    (attribute("motion", "travel", '"sideways"'), "travel is sideways, accepted: a coordinate"),
    (attribute("motion", "exchange", "[0, 0, 1, 2]"), "exchange"),
    (attribute("motion/segments/0000", "modes", '{"front foot": "stick"}'), "contacts of phase 1"),
    (attribute("motion", "total_mass", -2.0), "total mass"),
]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("source", "change", "message"),
    [("slip", *case) for case in WALKER] + [(PLANAR, *case) for case in PLANAR_CHANGES],
)
def test_inconsistent_content_is_named(slip_gait, tmp_path, source, change, message):
    path = save(slip_gait if source == "slip" else load(source), tmp_path / "gait.h5")
    with edit_hdf5(path) as file:
        change(file)
    with pytest.raises(ArchiveError, match=f"is damaged: .*{message}"):
        load(path)


def test_the_units_of_the_file_stay(slip_gait, tmp_path):
    """The changes above would be of no use if the file they change was refused anyway."""
    path = save(slip_gait, tmp_path / "gait.h5")
    with edit_hdf5(path) as file:
        put("motion/segments/0000/q", file["motion/segments/0000/q"][...])(file)
    with h5py.File(path) as file:
        assert file["motion/segments/0000/q"].attrs["unit"]
    assert load(path).status.ok
