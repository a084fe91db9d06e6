"""Bifurcation diagrams in NetCDF files: a table of points and a table of special points."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gaitopt.arguments import check_arguments
from gaitopt.continuation.branch_diagram import BranchDiagram, GaitBranch, section_unit
from gaitopt.continuation.diagram_table import (
    join_rows,
    make_attributes,
    pad_columns,
    split_complex,
    write_diagram,
)
from gaitopt.continuation.special_curve import SpecialCurve
from gaitopt.continuation.special_point import SpecialKind, SpecialPoint
from gaitopt.motion.hdf5 import read_hdf5
from gaitopt.motion.netcdf import load_netcdf

if TYPE_CHECKING:
    import xarray as xr

KIND, VERSION = "branch diagram", 2


@check_arguments
def diagram_dataset(diagram: BranchDiagram) -> "xr.Dataset":
    """Return a diagram as a labelled dataset with the dimensions ``point`` and ``special``.

    Parameters
    ----------
    diagram : BranchDiagram

    Returns
    -------
    Dataset
        Variables of each point: ``value``, ``branch``, ``state`` at the start of each step of the period,
        ``multiplier_real``, ``multiplier_imag``, ``stable`` and ``sequence``; of each special point the same with the
        prefix ``special_``.

    Examples
    --------
    >>> from gaitopt import load_diagram
    >>> table = diagram_dataset(load_diagram("docs/examples/compass_slope.nc"))
    >>> table.state.dims, int(table.branch.max())
    (('point', 'step', 'coordinate'), 4)
    """
    import xarray as xr

    branches = diagram.branches
    names = tuple(dict.fromkeys(name for branch in branches for name in branch.names))
    special = [(number, point) for number, branch in enumerate(branches) for point in branch.special]
    most = max((branch.multipliers.shape[1] for branch in branches), default=0)
    unit = {"units": diagram.unit}
    points = {
        "value": ("point", join_rows([branch.values for branch in branches]), unit | {"long_name": diagram.parameter}),
        "branch": ("point", np.repeat(np.arange(len(branches)), [branch.values.size for branch in branches])),
        "state": (("point", "step", "coordinate"), _stack_orbits(branches, names)),
        "sequence": ("point", _text([name for branch in branches for name in branch.sequences])),
    }
    multipliers = join_rows([pad_columns(branch.multipliers, most) for branch in branches], most)
    points |= split_complex("multiplier", ("point", "multiplier"), multipliers)
    points["stable"] = ("point", join_rows([branch.stable for branch in branches]).astype(np.int8))

    def place(number: int, values: NDArray[Any]) -> NDArray[Any]:
        return _place(values, branches[number].names, names)

    states = _stack([place(number, point.z) for number, point in special], len(names))
    places = {
        "special_kind": ("special", _text([point.kind.key for _, point in special])),
        "special_branch": ("special", np.array([number for number, _ in special], dtype=int)),
        "special_value": ("special", np.array([point.value for _, point in special]), unit),
        "special_width": ("special", np.array([point.width for _, point in special]), unit),
        "special_test": ("special", np.array([point.test for _, point in special])),
        "special_state": (("special", "coordinate"), states),
        "special_before": ("special", _text([point.before for _, point in special])),
        "special_after": ("special", _text([point.after for _, point in special])),
    }
    for side in ("before", "after"):
        values = _stack([getattr(point, f"multipliers_{side}") for _, point in special], most)
        places |= split_complex(f"special_multiplier_{side}", ("special", "multiplier"), values)
    directions = [
        np.array([]) if point.direction is None else place(number, point.direction) for number, point in special
    ]
    places["special_direction"] = (("special", "coordinate"), _stack(directions, len(names)).real)
    attributes = _attributes(diagram)
    return xr.Dataset(points | places, {"coordinate": list(names)}, attributes)


@check_arguments
def save_diagram(diagram: BranchDiagram, path: str | Path) -> Path:
    """Write a diagram to a NetCDF file atomically.

    Parameters
    ----------
    diagram : BranchDiagram
    path : str or Path
        Ends in ``.nc``.

    Raises
    ------
    ArchiveError
        If the file is not writable; an older file of that name is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> from gaitopt import load_diagram
    >>> diagram = load_diagram("docs/examples/compass_slope.nc")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     load_diagram(save_diagram(diagram, f"{folder}/copy.nc")).ratios == diagram.ratios
    True
    """
    return write_diagram(diagram_dataset(diagram), path)


@check_arguments
def load_diagram(path: str | Path) -> BranchDiagram:
    """Read a diagram from a NetCDF file.

    Raises
    ------
    ArchiveError
        If the file is missing, damaged, newer or of another kind.

    Examples
    --------
    >>> from gaitopt import load_diagram
    >>> load_diagram("docs/examples/compass_slope.nc").robot
    'compass_biped'
    """
    with read_hdf5(path, KIND, VERSION):
        table = load_netcdf(path)
        facts = json.loads(table.attrs["diagram"])
        curves = tuple(map(SpecialCurve.from_record, facts.pop("curves", [])))
        branches = tuple(_read_branch(table, number, record) for number, record in enumerate(facts.pop("branches")))
    return BranchDiagram(**facts | {"ends": tuple(facts["ends"])}, branches=branches, curves=curves)


def _attributes(diagram: BranchDiagram) -> dict[str, Any]:
    facts = {name: getattr(diagram, name) for name in ("robot", "parameter", "unit", "parameters", "complete")}
    facts |= {"ends": list(diagram.ends), "curves": [curve.record() for curve in diagram.curves]}
    facts["branches"] = [
        {name: getattr(branch, name) for name in ("kind", "steps", "names", "units", "begin", "end", "parent")}
        for branch in diagram.branches
    ]
    return make_attributes(KIND, VERSION, f"{diagram.robot}: gaits over {diagram.parameter}", facts)


def _read_branch(table: "xr.Dataset", number: int, record: dict[str, Any]) -> GaitBranch:
    points, places = table.branch.values == number, np.flatnonzero(table.special_branch.values == number)
    known = tuple(map(str, table.coordinate.values))
    names = tuple(record.get("names", known))
    columns = [known.index(name) for name in names]
    multipliers = (table.multiplier_real.values + 1j * table.multiplier_imag.values)[points, : len(names)]
    return GaitBranch(
        **record | {"names": names, "units": tuple(record.get("units", map(section_unit, names)))},
        values=table.value.values[points],
        orbits=table.state.values[points, : record["steps"]][:, :, columns],
        multipliers=multipliers,
        sequences=tuple(map(str, table.sequence.values[points])),
        special=tuple(_read_special(table.isel(special=place), columns) for place in places),
    )


def _read_special(row: "xr.Dataset", columns: list[int]) -> SpecialPoint:
    sides = {}
    for side in ("before", "after"):
        real, imaginary = (row[f"special_multiplier_{side}_{part}"].values for part in ("real", "imag"))
        values = real + 1j * imaginary
        sides[f"multipliers_{side}"] = values[np.isfinite(values)]
    direction = row.special_direction.values[columns]
    return SpecialPoint(
        kind=SpecialKind[str(row.special_kind.values).upper()],
        value=float(row.special_value),
        width=float(row.special_width),
        z=row.special_state.values[columns],
        before=str(row.special_before.values),
        after=str(row.special_after.values),
        test=float(row.special_test),
        direction=None if np.any(np.isnan(direction)) else direction,
        **sides,
    )


def _stack_orbits(branches: Sequence[GaitBranch], names: tuple[str, ...]) -> NDArray[Any]:
    """Return the states of all steps of all gaits, with nan beyond the period of a gait."""
    most = max((branch.steps for branch in branches), default=1)
    padded = [
        np.pad(
            _place(branch.orbits, branch.names, names),
            ((0, 0), (0, most - branch.steps), (0, 0)),
            constant_values=np.nan,
        )
        for branch in branches
    ]
    return np.concatenate([np.zeros((0, most, len(names))), *padded])


def _place(values: NDArray[Any], names: tuple[str, ...], among: tuple[str, ...]) -> NDArray[Any]:
    """Return values of some coordinates, the last axis, among those of all branches, with nan for the others."""
    if names == among:
        return values
    placed = np.full((*values.shape[:-1], len(among)), np.nan)
    placed[..., [among.index(name) for name in names]] = values
    return placed


def _stack(rows: Sequence[NDArray[Any]], columns: int) -> NDArray[np.complex128]:
    """Return rows of at most this many entries as one array, with nan in place of missing entries."""
    table = np.full((len(rows), columns), np.nan, dtype=complex)
    for target, row in zip(table, rows, strict=True):
        target[: row.size] = row
    return table if any(np.iscomplexobj(row) for row in rows) else table.real


def _text(values: Sequence[str]) -> NDArray[Any]:
    return np.array(values, dtype=object)
