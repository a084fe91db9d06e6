"""Check of a file of gaitopt: kind, version, checksum, and whether it is readable."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from gaitopt.errors import ArchiveError
from gaitopt.motion.printable import format_count

CHECKSUM = {True: "agrees with the content", False: "none, as in files of earlier versions"}


def examine_file(path: Path) -> dict[str, Any]:
    """Return the facts of a file, with an empty `error` if all of it is readable.

    Examples
    --------
    >>> facts = examine_file(Path("docs/examples/compass_slip.h5"))
    >>> facts["kind"], facts["format_version"], facts["checksum"], facts["error"]
    ('gait', 5, True, '')
    >>> examine_file(Path("README.md"))["error"].startswith("README.md is not a readable HDF5 file")
    True
    """
    from gaitopt.motion.hdf5 import identify_file

    facts: dict[str, Any] = {"file": str(path), "kind": None, "format_version": None, "checksum": None, "content": ""}
    try:
        facts |= identify_file(path)
        facts["content"] = _READERS[facts["kind"]](path)
    except ArchiveError as error:
        return facts | {"error": str(error)}
    except KeyError:
        kinds = ", ".join(_READERS)
        return facts | {"error": f"{path} has the unknown kind {facts['kind']!r}; known kinds are {kinds}."}
    return facts | {"error": ""}


def _read_gait(path: Path) -> str:
    from gaitopt.motion.archive import load

    gait = load(path)
    return f"{gait.sequence}, robot {gait.robot_name}, {gait.status.key}"


def _read_sweep(path: Path) -> str:
    from gaitopt.study.sweeps.sweep_file import load_sweep, read_named_gaits

    table = load_sweep(path)
    gaits = sum(1 for _ in read_named_gaits(path))
    return f"{format_count(table.status.size, 'point')}, {format_count(gaits, 'gait')}"


def _read_basin(path: Path) -> str:
    from gaitopt.study.basins.basin_file import load_basin

    return format_count(load_basin(path).ending.size, "start")


def _read_diagram(path: Path) -> str:
    from gaitopt.continuation.diagram_file import load_diagram

    return format_count(len(load_diagram(path).branches), "branch", "branches")


def _read_optima(path: Path) -> str:
    from gaitopt.continuation.optimal.optimal_file import load_optima

    return f"optimal gaits over {load_optima(path).parameter}"


def _read_front(path: Path) -> str:
    from gaitopt.study.trade_offs.front_table import load_front

    return format_count(load_front(path).sizes["point"], "point")


def _read_branch_basin(path: Path) -> str:
    from gaitopt.study.basins.branch_basin_file import load_branch_basin

    return format_count(load_branch_basin(path).push.size, "gait")


def _read_steps(path: Path) -> str:
    from gaitopt.ocp.multistep.multistep_file import load_steps

    return format_count(len(load_steps(path).sequences), "step")


_READERS: dict[str, Callable[[Path], str]] = {
    "gait": _read_gait,
    "sweep": _read_sweep,
    "basin": _read_basin,
    "branch diagram": _read_diagram,
    "diagram of optimal gaits": _read_optima,
    "front": _read_front,
    "set of basins along a branch": _read_branch_basin,
    "gait of several steps": _read_steps,
}


def tabulate_facts(facts: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the facts of a file as rows of a table."""
    rows = [("file", facts["file"])]
    if facts["kind"] is not None:
        rows.append(("kind", f"{facts['kind']}, format version {facts['format_version']}"))
        rows.append(("checksum", CHECKSUM[facts["checksum"]]))
    if facts["content"]:
        rows.append(("content", facts["content"]))
    return rows
