"""Gait files: what is saved is what is loaded, and anybody can read it."""

import dataclasses
import json
import math
import stat

import h5py
import numpy as np
import pytest

from gaitopt import InputError, Status, load, save
from gaitopt.motion import Conflict, Jump, Segment, Solution, Table, Verification, Violation, motion_archive


def assert_same(one, other, at="gait"):
    """Compare everything, arrays bit by bit and nan with nan."""
    assert type(one) is type(other), at
    if dataclasses.is_dataclass(one):
        for field in dataclasses.fields(one):
            assert_same(getattr(one, field.name), getattr(other, field.name), f"{at}.{field.name}")
    elif isinstance(one, np.ndarray):
        assert one.dtype == other.dtype, at
        np.testing.assert_array_equal(one, other, err_msg=at)
    elif isinstance(one, tuple | list):
        assert len(one) == len(other), at
        for i, (a, b) in enumerate(zip(one, other, strict=True)):
            assert_same(a, b, f"{at}[{i}]")
    elif isinstance(one, dict):
        assert one.keys() == other.keys(), at
        for key in one:
            assert_same(one[key], other[key], f"{at}[{key!r}]")
    else:
        assert one == other or (one != one and other != other), at


@pytest.fixture
def awkward(slip_gait):
    """Return the example with everything in it that is hard to write."""
    solver = dataclasses.replace(
        slip_gait.solver,
        objective=math.nan,
        constraint_violation=math.inf,
        message="",
        violations=(Violation("phase 1", "µ", 2.0), Violation("a", "b", math.inf), Violation("c", "d", math.nan)),
        conflicts=(
            Conflict(
                name="µ",
                setting="Limits.torque",
                limit=1.0,
                missing=math.inf,
                sufficient=math.nan,
                unit="N m",
                separable=False,
                item="µ",
            ),
        ),
        warnings=("a duration is at its bound", 'quotes " and \\ and\nlines'),
    )
    verification = Verification(False, "", "fell", math.inf, 0.1, math.nan, math.nan, -math.inf, ("because", "∞"))
    motion = slip_gait.motion
    first = dataclasses.replace(motion.segments[0], force=np.full_like(motion.segments[0].force, np.nan))
    motion = dataclasses.replace(
        motion, segments=(first, *motion.segments[1:]), parameters={**motion.parameters, "friction": math.inf}
    )
    table = Table(("a/b", "µ"), np.array([[math.inf], [math.nan]]), np.zeros((2, 1)))
    odd = Solution(intervals=(1,), unknowns={"power": table}, constraints={})
    problem = {**slip_gait.problem, "friction": math.inf, "speed": [-math.inf, math.inf], "step_length": None}
    return dataclasses.replace(
        slip_gait, solver=solver, verification=verification, motion=motion, problem=problem, solution=odd
    )


def test_the_example_comes_back(slip_gait, tmp_path):
    assert save(slip_gait, tmp_path / "gait.h5") == tmp_path / "gait.h5"
    assert_same(load(tmp_path / "gait.h5"), slip_gait)


def test_works_of_dampers_and_springs_are_written_where_they_are_not_zero(slip_gait, tmp_path):
    """A file without them, as all older files are, is read with zeros."""
    first, second = slip_gait.motion.segments
    first = dataclasses.replace(first, elastic=np.sin(first.time), damping_work=first.time**2)
    motion = dataclasses.replace(slip_gait.motion, segments=(first, second))
    gait = dataclasses.replace(slip_gait, motion=motion)
    path = save(gait, tmp_path / "gait.h5")
    assert_same(load(path), gait)
    with h5py.File(path) as file:
        groups = [set(file[f"motion/segments/{number:04d}"]) for number in range(2)]
    assert groups[0] - groups[1] == {"elastic", "damping_work"}
    assert not np.any(load(path).motion.segments[1].elastic)


def test_infinities_nan_and_odd_texts_come_back(awkward, tmp_path):
    failed = dataclasses.replace(awkward, status=Status.INVALID_NUMBER)
    save(failed, str(tmp_path / "gait.h5"))
    assert_same(load(str(tmp_path / "gait.h5")), failed)


def test_a_solved_gait_that_is_not_finite_is_not_written(awkward, tmp_path):
    with pytest.raises(InputError, match=r"in phase 1 is not finite, accepted: finite numbers"):
        save(awkward, tmp_path / "gait.h5")
    assert not list(tmp_path.iterdir())


def test_a_gait_that_was_not_replayed_comes_back(slip_gait, tmp_path):
    gait = dataclasses.replace(slip_gait, verification=None)
    save(gait, tmp_path / "gait.h5")
    assert_same(load(tmp_path / "gait.h5"), gait)


def test_a_gait_that_never_landed_is_not_written(slip_gait, tmp_path):
    gait = dataclasses.replace(slip_gait, motion=dataclasses.replace(slip_gait.motion, jumps=()))
    with pytest.raises(InputError, match="number of touchdowns is 0, accepted: 1 to 1000"):
        save(gait, tmp_path / "gait.h5")


def test_more_than_ten_segments_come_back_in_order(slip_gait, tmp_path):
    one = slip_gait.motion.segments[0]
    many = tuple(dataclasses.replace(one, step=i) for i in range(12))
    gait = dataclasses.replace(slip_gait, motion=dataclasses.replace(slip_gait.motion, segments=many))
    save(gait, tmp_path / "gait.h5")
    assert [segment.step for segment in load(tmp_path / "gait.h5").motion.segments] == list(range(12))


def test_long_texts_come_back(slip_gait, tmp_path):
    """HDF5 keeps short attributes in a header of 64 kB."""
    gait = dataclasses.replace(slip_gait, problem={**slip_gait.problem, "guess": "x" * 100_000})
    save(gait, tmp_path / "gait.h5")
    assert load(tmp_path / "gait.h5").problem["guess"] == "x" * 100_000


def test_bare_h5py_reads_numbers_with_their_units(slip_gait, tmp_path):
    save(slip_gait, tmp_path / "gait.h5")
    units = {"time": "s", "torque": "N m", "force": "N", "power": "W", "work": "J", "points": "m"}
    with h5py.File(tmp_path / "gait.h5", "r") as file:
        assert file.attrs["format"] == "gaitopt gait"
        assert file.attrs["format_version"] == 5
        assert file.attrs["sequence"] == "slip+ stick | slip+"
        assert json.loads(file["motion"].attrs["angles"]) == ["th1", "th2"]
        assert file["motion/parameters"].attrs["friction"] == 0.14
        for i, segment in enumerate(slip_gait.motion.segments):
            group = file[f"motion/segments/{i:04d}"]
            assert group.attrs["mode"] == segment.mode.value
            np.testing.assert_array_equal(group["q"][...], segment.q)
            for name, unit in units.items():
                assert group[name].attrs["unit"] == unit
        assert file["motion/jumps/0000/impulse"].attrs["unit"] == "N s"
        assert file["motion/jumps/0000"].attrs["energy_lost_unit"] == "J"


def test_every_array_in_the_file_carries_a_unit(slip_gait, tmp_path):
    save(slip_gait, tmp_path / "gait.h5")
    bare = []

    def look(name, item):
        if isinstance(item, h5py.Dataset) and "unit" not in item.attrs:
            bare.append(name)

    with h5py.File(tmp_path / "gait.h5", "r") as file:
        file.visititems(look)
    assert bare == []


def test_the_problem_is_strict_json(awkward, tmp_path):
    def refuse(constant):
        raise ValueError(constant)

    save(dataclasses.replace(awkward, status=Status.INVALID_NUMBER), tmp_path / "gait.h5")
    with h5py.File(tmp_path / "gait.h5", "r") as file:
        texts = [file.attrs["problem"], file["solver"].attrs["violations"], file["verification"].attrs["reasons"]]
    problem, violations, _ = (json.loads(text, parse_constant=refuse) for text in texts)
    assert problem["friction"] == "inf"
    assert [violation["size"] for violation in violations] == [2.0, "inf", None]


def test_every_field_is_written(slip_gait):
    """A field added to a record and forgotten in the archive would be lost without a word."""
    own = {"mode", "step"}
    assert {f.name for f in dataclasses.fields(Segment)} - own == set(
        motion_archive._SEGMENT_UNITS | motion_archive._FORCE_UNITS
    )
    assert {f.name for f in dataclasses.fields(Jump)} - own == set(motion_archive._JUMP_UNITS) | set(
        motion_archive._JUMP_SCALARS
    )
    kinds = {int, float, str, bool, tuple}
    for record in (slip_gait.solver, slip_gait.verification):
        assert {type(value) for value in vars(record).values()} <= kinds


def test_a_saved_file_has_the_permissions_of_any_new_file(slip_gait, tmp_path):
    (tmp_path / "other").touch()
    save(slip_gait, tmp_path / "gait.h5")
    modes = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("other", "gait.h5")]
    assert modes[0] == modes[1]
