"""Diagrams of optimal gaits in NetCDF files: a table of points and a table of special points."""

import dataclasses
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.continuation.diagram_table import (
    join_rows,
    make_attributes,
    pad_columns,
    split_complex,
    write_diagram,
)
from gaitopt.continuation.optimal.optimal_branch import (
    LowestCostChange,
    OptimalBranch,
    OptimalDiagram,
    OptimalSpecialPoint,
)
from gaitopt.motion.hdf5 import read_hdf5
from gaitopt.motion.netcdf import load_netcdf

if TYPE_CHECKING:
    import xarray as xr

KIND, VERSION = "diagram of optimal gaits", 1

COLUMNS = {
    "values": "value",
    "costs": "cost",
    "cost_slopes": "cost_slope",
    "cost_errors": "cost_error",
    "replayed": "replayed",
    "passed": "passed",
    "state_errors": "state_error",
    "negative": "negative",
    "dependent": "dependent",
    "strictness": "strictness",
    "active": "active",
}
"""Arrays of a branch with one entry per gait, and their names in files."""

SPECIAL = ("kind", "value", "width", "cost", "constraint", "before", "after", "turns", "place")
"""Fields of a special point."""


@check_arguments
def optimal_dataset(diagram: OptimalDiagram) -> "xr.Dataset":
    """Return a diagram of optimal gaits as a labelled dataset with the dimensions ``point`` and ``special``.

    Parameters
    ----------
    diagram : OptimalDiagram

    Returns
    -------
    Dataset
        Variables of each point: ``value``, ``branch``, ``cost``, ``state`` after touchdown, ``multiplier_real``,
        ``multiplier_imag``, the results of replay and certificate; of each special point with the prefix ``special_``.

    Examples
    --------
    >>> from gaitopt import Collocation, GaitProblem, Limits, compass_biped
    >>> from gaitopt.continuation import trace_optimum
    >>> problem = GaitProblem(robot=compass_biped(), sequence="stick | stick", friction=0.25, speed=0.6,
    ...                       step_length=0.45, limits=Limits(torque=6), objective="torque_squared",
    ...                       transcription=Collocation(intervals=10))
    >>> table = optimal_dataset(trace_optimum(problem, {"friction": (0.25, 0.2)}))
    >>> table.cost.dims, table.state.dims
    (('point',), ('point', 'coordinate'))
    """
    import xarray as xr

    branches = diagram.branches
    names = max((branch.names for branch in branches), key=len, default=())
    unit, size = {"units": diagram.unit}, len(names)
    points: dict[str, Any] = {
        short: ("point", join_rows([getattr(branch, name) for branch in branches])) for name, short in COLUMNS.items()
    }
    points = {
        key: (dims, array.astype(np.int8) if array.dtype == bool else array) for key, (dims, array) in points.items()
    }
    points["value"] = (*points["value"], unit | {"long_name": diagram.parameter})
    points["cost"] = (*points["cost"], {"long_name": diagram.objective})
    points["branch"] = ("point", np.repeat(np.arange(len(branches)), [branch.values.size for branch in branches]))
    points["state"] = (
        ("point", "coordinate"),
        join_rows([pad_columns(branch.states, size) for branch in branches], size),
    )
    multipliers = join_rows([pad_columns(branch.multipliers, size) for branch in branches], size)
    points |= split_complex("multiplier", ("point", "multiplier"), multipliers)
    special = [(number, point) for number, branch in enumerate(branches) for point in branch.special]
    for name in SPECIAL:
        column = [getattr(point, name) for _, point in special]
        text = name in ("kind", "constraint", "before", "after")
        points[f"special_{name}"] = (
            "special",
            np.array(column, dtype=object if text else np.int8 if name == "turns" else float),
        )
    points["special_branch"] = ("special", np.array([number for number, _ in special], dtype=int))
    states = [pad_columns(point.state[None, :], size) for _, point in special]
    points["special_state"] = (("special", "coordinate"), join_rows(states, size))
    return xr.Dataset(points, {"coordinate": list(names)}, _attributes(diagram))


@check_arguments
def save_optima(diagram: OptimalDiagram, path: str | Path) -> Path:
    """Write a diagram of optimal gaits to a NetCDF file atomically.

    Parameters
    ----------
    diagram : OptimalDiagram
    path : str or Path
        Ends in ``.nc``.

    Raises
    ------
    ArchiveError
        If the file is not writable; an older file of that name is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> from gaitopt import Collocation, GaitProblem, Limits, compass_biped
    >>> from gaitopt.continuation import trace_optimum
    >>> problem = GaitProblem(robot=compass_biped(), sequence="stick | stick", friction=0.25, speed=0.6,
    ...                       step_length=0.45, limits=Limits(torque=6), objective="torque_squared",
    ...                       transcription=Collocation(intervals=10))
    >>> diagram = trace_optimum(problem, {"friction": (0.25, 0.2)})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     load_optima(save_optima(diagram, f"{folder}/optima.nc")).parameter
    'friction'
    """
    return write_diagram(optimal_dataset(diagram), path)


@check_arguments
def load_optima(path: str | Path) -> OptimalDiagram:
    """Read a diagram of optimal gaits from a NetCDF file.

    Raises
    ------
    ArchiveError
        If the file is missing, damaged, newer or of another kind.

    Examples
    --------
    >>> load_optima("nowhere.nc")
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: There is no file nowhere.nc.
    """
    with read_hdf5(path, KIND, VERSION):
        table = load_netcdf(path)
        facts = json.loads(table.attrs["diagram"])
        branches = tuple(_read_branch(table, number, record) for number, record in enumerate(facts.pop("branches")))
        borders = tuple(LowestCostChange(**border) for border in facts.pop("borders"))
    return OptimalDiagram(**facts | {"ends": tuple(facts["ends"])}, branches=branches, borders=borders)


def _attributes(diagram: OptimalDiagram) -> dict[str, Any]:
    facts = {
        name: getattr(diagram, name)
        for name in ("robot", "objective", "parameter", "unit", "parameters", "complete", "targets")
    }
    facts |= {"ends": list(diagram.ends), "borders": [dataclasses.asdict(border) for border in diagram.borders]}
    facts["branches"] = [
        {name: getattr(branch, name) for name in ("kind", "sequence", "names", "begin", "end", "parent")}
        for branch in diagram.branches
    ]
    return make_attributes(KIND, VERSION, f"{diagram.robot}: optimal gaits over {diagram.parameter}", facts)


def _read_branch(table: "xr.Dataset", number: int, record: dict[str, Any]) -> OptimalBranch:
    rows, names = table.branch.values == number, tuple(record.pop("names"))
    columns = {name: table[short].values[rows] for name, short in COLUMNS.items()}
    for name in ("replayed", "passed"):
        columns[name] = columns[name].astype(bool)
    multipliers = (table.multiplier_real.values + 1j * table.multiplier_imag.values)[rows, : len(names)]
    special = [
        OptimalSpecialPoint(
            **{name: _plain(table[f"special_{name}"].values[place], name) for name in SPECIAL},
            state=table.special_state.values[place, : len(names)],
        )
        for place in np.flatnonzero(table.special_branch.values == number)
    ]
    states = table.state.values[rows, : len(names)]
    return OptimalBranch(
        **record, **columns, names=names, states=states, multipliers=multipliers, special=tuple(special)
    )


def _plain(value: Any, name: str) -> Any:
    """Return an entry of the table of special points as text, number or truth value."""
    if name in ("value", "width", "cost"):
        return float(value)
    if name == "place":
        return int(value)
    return bool(value) if name == "turns" else str(value)
