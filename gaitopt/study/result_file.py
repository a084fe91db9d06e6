"""load_result: the result of a file or a folder of any kind."""

import json
from importlib import import_module
from pathlib import Path
from typing import Any

from gaitopt.arguments import check_arguments
from gaitopt.errors import ArchiveError
from gaitopt.motion.hdf5 import identify_file
from gaitopt.study.storage.gait_store import RANKING

LOADERS = {
    "gait": "gaitopt.motion.archive:load",
    "sweep": "gaitopt.study.sweeps.sweep_file:load_sweep",
    "basin": "gaitopt.study.basins.basin_file:load_basin",
    "set of basins along a branch": "gaitopt.study.basins.branch_basin_file:load_branch_basin",
    "branch diagram": "gaitopt.continuation.diagram_file:load_diagram",
    "diagram of optimal gaits": "gaitopt.continuation.optimal.optimal_file:load_optima",
    "front": "gaitopt.study.trade_offs.front_table:load_front",
    "gait of several steps": "gaitopt.ocp.multistep.multistep_file:load_steps",
}
"""Readers of the kinds of HDF5 files, by name, so that only the one that is used is imported."""

JSON_LOADERS = {
    "gaitopt tuned gains": "gaitopt.tuning.tuning_file:load_tuning",
    "gaitopt push test": "gaitopt.study.robustness.robustness_record:load_robustness",
}
"""Readers of the formats of JSON files."""


@check_arguments
def load_result(path: str | Path) -> Any:
    """Read a result of any kind from its file or folder.

    Parameters
    ----------
    path : str or Path
        File of a gait of one or several steps, sweep, basin, basins along a branch, front, diagram of periodic or
        optimal gaits, tuned gains or push test; or the folder of a search.

    Returns
    -------
    Gait, PlanarGait, MultiStepGait, xarray.Dataset, BranchDiagram, OptimalDiagram, Ranking, TunedGains or \
RobustnessRecord
        The attribute ``format`` of a dataset is ``"gaitopt sweep"``, ``"gaitopt basin"``,
        ``"gaitopt set of basins along a branch"`` or ``"gaitopt front"``.

    Raises
    ------
    ArchiveError
        If the file is missing, damaged or of an unknown kind.

    Examples
    --------
    >>> load_result("docs/examples/compass_slope.nc").parameter
    'slope'
    """
    path = Path(path)
    if path.is_dir() or path.name == RANKING:
        return _load("gaitopt.study.sequence_search.ranking_folder:load_ranking", path)
    if path.suffix.lower() == ".json":
        return _load_json(path)
    kind = identify_file(path)["kind"]
    if kind not in LOADERS:
        raise ArchiveError(f"{path} has the unknown kind {kind!r}; known kinds are {', '.join(LOADERS)}.")
    return _load(LOADERS[kind], path)


def _load(reader: str, path: Path) -> Any:
    """Return what a reader, given as ``module:function``, reads from a file."""
    module, _, function = reader.partition(":")
    return getattr(import_module(module), function)(path)


def _load_json(path: Path) -> Any:
    if not path.is_file():
        raise ArchiveError(f"There is no file {path}.")
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        loader = JSON_LOADERS[content["format"]]
    except (OSError, ValueError, KeyError, TypeError):
        kinds = ", ".join(f"'{name}'" for name in JSON_LOADERS)
        raise ArchiveError(f"{path} is not a JSON file of {kinds}, or is damaged.") from None
    return _load(loader, path)
