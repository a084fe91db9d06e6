"""Columns of a recorded motion: which column belongs to which quantity of a robot, in SI units."""

import math
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.motion.column_table import ColumnTable
from gaitopt.motion.motion import Array

ANGLE_UNITS = {"rad": 1.0, "deg": math.pi / 180}
_LENGTH_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
_TIME_UNITS = {"s": 1.0, "ms": 1e-3}
_FORCE_UNITS = {"torque_Nm": 1.0, "force_N": 1.0}

TIME = "time"

LARGEST_ANGLE = 2 * math.pi
"""Angle [rad] beyond which a warning states that the unit of a column may be degrees."""


class RecordedQuantity(NamedTuple):
    """A quantity of a robot: its name, and ``"m"`` or ``"rad"``."""

    name: str
    unit: str


@dataclass(frozen=True, eq=False)
class RecordedColumns:
    """Columns of a file that belong to a robot, in SI units.

    Attributes
    ----------
    time : (K,) array [s]
    coordinates, rates, torques : mapping of name to (K,) array
    ignored : tuple of str
        Columns that belong to no quantity.
    warnings : tuple of str
    """

    time: Array
    coordinates: Mapping[str, Array]
    rates: Mapping[str, Array]
    torques: Mapping[str, Array]
    ignored: tuple[str, ...]
    warnings: tuple[str, ...]


def assign_columns(
    table: ColumnTable,
    path: Path,
    quantities: Iterable[RecordedQuantity],
    actuators: Iterable[str],
    renamed: Mapping[str, str],
    angle_unit: str | None,
) -> RecordedColumns:
    """Return the columns of a robot: ``NAME_UNIT``, ``NAME_rate_UNIT_per_s`` and ``NAME_torque_Nm``, or names alone.

    Parameters
    ----------
    table : ColumnTable
    path : Path
        For messages.
    quantities : iterable of RecordedQuantity
        Coordinates of the robot.
    actuators : iterable of str
    renamed : mapping of str to str
        Column of a coordinate, or of the time (``time``), that has another name in the file.
    angle_unit : str or None
        Unit of angles whose column does not state it; None for the unit in the header of the file.

    Raises
    ------
    InputError
        If a unit is missing, or a name in `renamed` is unknown.
    """
    unit, used = angle_unit or table.angle_unit, set()
    quantities = tuple(quantities)
    names = [quantity.name for quantity in quantities]
    renamed = {TIME if is_time(name) and name not in names else name: column for name, column in renamed.items()}
    _check_names(renamed, names, table, path)

    def take(pattern: str, units: Mapping[str, float], bare: float | None = None) -> Array | None:
        for column, values in table.columns.items():
            match = re.fullmatch(pattern, column)
            if match:
                used.add(column)
                factor = units[match[1]] if match[1] else bare
                if factor is None:
                    raise InputError(
                        f"{path}: the column {column!r} has no unit; name it {column}_rad or {column}_deg, or specify "
                        "the unit of all angles (angle_unit, --angle-unit)."
                    )
                return values * factor
        return None

    time = take(_time_pattern(renamed.get(TIME)), _TIME_UNITS, 1.0)
    if time is None:
        raise InputError(
            f"{path} has no column with the time. {suggest('time_s', table.columns)} State the column by "
            "columns={'time': 'COLUMN'}, or --column time=COLUMN."
        )
    coordinates: dict[str, Array] = {}
    rates: dict[str, Array] = {}
    for quantity in quantities:
        units = ANGLE_UNITS if quantity.unit == "rad" else _LENGTH_UNITS
        column, listed = renamed.get(quantity.name, quantity.name), "|".join(units)
        named = re.fullmatch(rf"(.+)_({listed})", column) if quantity.name in renamed else None
        label = re.escape(named[1] if named else column)
        bare = 1.0 if quantity.unit == "m" else None if unit is None else ANGLE_UNITS[unit]
        values = take(rf"{label}_({named[2]})" if named else rf"{label}(?:_({listed}))?", units, bare)
        rate = take(rf"{label}_rate_({listed})_per_s", units)
        coordinates |= {} if values is None else {quantity.name: values}
        rates |= {} if rate is None else {quantity.name: rate}
    columns = {name: take(rf"{re.escape(name)}_({'|'.join(_FORCE_UNITS)})", _FORCE_UNITS) for name in actuators}
    torques = {name: values for name, values in columns.items() if values is not None}
    ignored = tuple(name for name in (*table.columns, *table.texts) if name not in used)
    return RecordedColumns(time, coordinates, rates, torques, ignored, _doubtful_units(quantities, coordinates))


def is_time(name: str) -> bool:
    """Return whether a name in `renamed` is that of the time.

    Examples
    --------
    >>> is_time("time"), is_time("t_s"), is_time("th1")
    (True, True, False)
    """
    return name.partition("_")[0] in (TIME, "t")


def _time_pattern(column: str | None) -> str:
    """Return the pattern of the column of the time, whose unit is its last group; seconds without a unit."""
    units = "|".join(_TIME_UNITS)
    if column is None:
        return rf"(?:time|t)(?:_({units}))?"
    named = re.fullmatch(rf"(.+)_({units})", column)
    return rf"{re.escape(named[1])}_({units})" if named else rf"{re.escape(column)}(?:_({units}))?"


def _check_names(renamed: Mapping[str, str], names: list[str], table: ColumnTable, path: Path) -> None:
    """Raise InputError if a name is neither that of a coordinate nor the time, or a column does not exist."""
    for name, column in renamed.items():
        if name not in (*names, TIME):
            known = suggest(name, (*names, TIME))
            raise InputError(f"The robot has no coordinate {name!r} for the column {column!r}. {known}")
        if column not in table.columns:
            raise InputError(f"{path} has no column {column!r}. {suggest(column, table.columns)}")


def require_coordinates(columns: RecordedColumns, path: Path, quantities: Iterable[RecordedQuantity]) -> None:
    """Raise InputError unless every coordinate has a column; the message names the nearest one, or those to add."""
    missing = [quantity for quantity in quantities if quantity.name not in columns.coordinates]
    if not missing:
        return
    name, listed = missing[0].name, ", ".join(repr(quantity.name) for quantity in missing)
    start = f"{path} has no {'columns of the coordinates' if len(missing) > 1 else 'column of the coordinate'} {listed}"
    if columns.ignored:
        raise InputError(
            f"{start}. {suggest(name, columns.ignored)} Specify the column by columns={{{name!r}: 'COLUMN'}}, or "
            f"--column {name}=COLUMN."
        )
    added = ", ".join(f"{quantity.name}_{'m' if quantity.unit == 'm' else 'deg'}" for quantity in missing)
    lengths = ", ".join(quantity.name for quantity in missing if quantity.unit == "m")
    place = f"; state {lengths} such that the standing foot is on the ground" if lengths else ""
    known = f" and of {', '.join(columns.coordinates)}" if columns.coordinates else ""
    raise InputError(f"{start}; it has those of the time{known}. Add {added}{place}.")


def _doubtful_units(quantities: Iterable[RecordedQuantity], values: Mapping[str, Array]) -> tuple[str, ...]:
    angles = [quantity.name for quantity in quantities if quantity.unit == "rad" and quantity.name in values]
    return tuple(
        f"{name} reaches {np.max(np.abs(values[name])):.3g} rad; if the values are in degrees, the name of the "
        "column must state it"
        for name in angles
        if np.max(np.abs(values[name])) > LARGEST_ANGLE
    )
