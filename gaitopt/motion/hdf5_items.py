"""Attributes and arrays of HDF5 files, written in a third of the time that the general interface of h5py takes.

A gait has some 200 attributes and 80 arrays, nearly all of them texts or arrays of floating-point numbers.
"""

from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np

_TEXT, _NUMBER = h5py.string_dtype(), np.dtype(float)
_KINDS = {
    kind: (dtype, h5py.h5t.py_create(dtype, logical=True), h5py.h5t.py_create(dtype))
    for kind, dtype in ((str, _TEXT), (float, _NUMBER), (int, np.dtype(np.int64)))
}
"""By type of a value: its NumPy type, and its HDF5 types in the file and in memory."""

_SCALAR = h5py.h5s.create_simple(())

_WITHOUT_TIMES = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
_WITHOUT_TIMES.set_obj_track_times(False)
"""Properties of a new array: without the time at which it was written, so that equal gaits have equal files."""


def write_attributes(item: h5py.Group | h5py.Dataset, values: Mapping[str, Any]) -> None:
    """Write attributes of a new item, as ``item.attrs.update`` does.

    Parameters
    ----------
    item : Group or Dataset
        An item without these attributes.
    values : mapping of str to float, int, str or another value that h5py accepts

    Examples
    --------
    >>> with h5py.File("note.h5", "w", driver="core", backing_store=False) as file:
    ...     write_attributes(file, {"name": "compass", "mass": 10.0})
    ...     file.attrs["name"], float(file.attrs["mass"])
    ('compass', 10.0)
    """
    for name, value in values.items():
        kinds = _KINDS.get(type(value))
        if kinds is None:
            item.attrs[name] = value
            continue
        dtype, stored, memory = kinds
        attribute = h5py.h5a.create(item.id, name.encode(), stored, _SCALAR)
        attribute.write(np.array(value, dtype=dtype), mtype=memory)


def write_dataset(group: h5py.Group, name: str, values: Any, unit: str) -> None:
    """Write an array of floating-point numbers with its unit, as ``group.create_dataset`` does.

    Parameters
    ----------
    group : Group
    name : str
    values : array
    unit : str

    Examples
    --------
    >>> with h5py.File("note.h5", "w", driver="core", backing_store=False) as file:
    ...     write_dataset(file, "time", np.linspace(0, 1, 3), "s")
    ...     file["time"][...], file["time"].attrs["unit"]
    (array([0. , 0.5, 1. ]), 's')
    """
    values = np.asarray(values, order="C")
    if values.dtype == _NUMBER and values.size:
        space = h5py.h5s.create_simple(values.shape)
        number = _KINDS[float][1]
        dataset = h5py.Dataset(h5py.h5d.create(group.id, name.encode(), number, space, dcpl=_WITHOUT_TIMES))
        dataset.id.write(h5py.h5s.ALL, h5py.h5s.ALL, values)
    else:
        dataset = group.create_dataset(name, data=values)
    write_attributes(dataset, {"unit": unit})
