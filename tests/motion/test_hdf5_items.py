"""Attributes and arrays written through the low-level interface of h5py equal those of its general interface."""

import h5py
import numpy as np
import pytest

from gaitopt.motion.hdf5_items import write_attributes, write_dataset

VALUES = {
    "text": "Füße: 3 m/s",
    "empty": "",
    "number": 0.1,
    "infinite": float("inf"),
    "count": -3,
    "flag": True,
    "numpy": np.float64(2.5),
    "list": [1.0, 2.0],
    "array": np.arange(3),
}


@pytest.fixture
def file():
    with h5py.File("memory.h5", "w", driver="core", backing_store=False) as opened:
        yield opened


def test_attributes_have_the_types_and_values_of_the_general_interface(file):
    plain, quick = file.create_group("plain"), file.create_group("quick")
    plain.attrs.update(VALUES)
    write_attributes(quick, VALUES)
    assert list(quick.attrs) == list(plain.attrs)
    for name in VALUES:
        one, other = plain.attrs.get_id(name), quick.attrs.get_id(name)
        assert one.get_type().equal(other.get_type())
        assert one.shape == other.shape
        assert type(plain.attrs[name]) is type(quick.attrs[name])
        np.testing.assert_array_equal(plain.attrs[name], quick.attrs[name])


@pytest.mark.parametrize(
    "values",
    [
        np.arange(6.0).reshape(2, 3),
        np.arange(6.0).reshape(2, 3).T,
        np.arange(8.0)[::2],
        np.array(1.5),
        np.empty((0, 3)),
        np.arange(4),
        np.arange(4, dtype=np.float32),
    ],
)
def test_arrays_equal_those_of_the_general_interface(file, values):
    plain = file.create_dataset("plain", data=values)
    write_dataset(file, "quick", values, "m")
    quick = file["quick"]
    assert (quick.dtype, quick.shape, quick.chunks) == (plain.dtype, plain.shape, plain.chunks)
    assert plain.id.get_type().equal(quick.id.get_type())
    times = {h5py.h5g.get_objinfo(dataset.id).mtime for dataset in (plain, quick)}
    assert times == {0}  # a file does not contain when it was written
    np.testing.assert_array_equal(quick[...], values)
    assert quick.attrs["unit"] == "m"
