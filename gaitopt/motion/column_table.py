"""Tables of recorded motions in files of other programs: CSV, MATLAB (.mat) and OpenSim (.sto, .mot)."""

import csv
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.errors import ArchiveError, InputError, describe_missing_file
from gaitopt.motion.motion import Array
from gaitopt.motion.printable import format_count

DELIMITERS = (",", ";", "\t")


@dataclass(frozen=True, eq=False)
class ColumnTable:
    """Numeric columns of a file by name.

    Attributes
    ----------
    columns : mapping of str to (K,) array
    texts : tuple of str
        Names of the columns that contain text.
    angle_unit : str or None
        ``"rad"`` or ``"deg"`` if the header of the file states it.
    """

    columns: Mapping[str, Array]
    texts: tuple[str, ...] = ()
    angle_unit: str | None = None


def read_columns(path: Path, time: str | None = None) -> ColumnTable:
    """Read the table of a file, whose suffix determines the format.

    Parameters
    ----------
    path : Path
    time : str or None
        Name of the time if it is another one than ``time`` or ``t``, by which a MATLAB file is searched.

    Raises
    ------
    InputError
        If the suffix is another one, or the file contains no table of numbers.
    ArchiveError
        If the file is unreadable.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(
            f"{path} has the suffix {suffix!r}; a recorded motion ends in {', '.join(SUFFIXES)}, a gait in .h5."
        )
    if not path.is_file():
        raise ArchiveError(describe_missing_file(path))
    table = _read_matlab(path, time) if suffix == ".mat" else _READERS[suffix](path)
    lengths = {values.size for values in table.columns.values()}
    if len(lengths) != 1 or min(lengths) < 2:
        raise InputError(f"{path} contains no table with at least two rows of numbers.")
    return table


def _read_lines(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ArchiveError(f"Cannot read {path}: {error}.") from None


def _read_csv(path: Path) -> ColumnTable:
    lines = [line for line in _read_lines(path) if line.strip() and not line.startswith("#")]
    header = lines[0] if lines else ""
    delimiter = max(DELIMITERS, key=header.count)
    rows = list(csv.reader(lines, delimiter=delimiter))
    return _make_table(path, rows, decimal="," if delimiter == ";" else ".")


def _read_opensim(path: Path) -> ColumnTable:
    lines = _read_lines(path)
    ends = [number for number, line in enumerate(lines) if line.strip().lower() == "endheader"]
    if not ends:
        raise InputError(f"{path} has no line 'endheader', with which the header of an OpenSim file ends.")
    header = dict(line.lower().replace(" ", "").split("=", 1) for line in lines[: ends[0]] if "=" in line)
    unit = {"yes": "deg", "no": "rad"}.get(header.get("indegrees", ""))
    rows = [line.split() for line in lines[ends[0] + 1 :] if line.strip()]
    table = _make_table(path, rows)
    return ColumnTable(table.columns, table.texts, unit)


def _make_table(path: Path, rows: Sequence[Sequence[str]], *, decimal: str = ".") -> ColumnTable:
    """Return the columns of rows of text, the first of which contains the names."""
    names = [name.strip() for name in rows[0]] if rows else []
    if len(set(names)) != len(names) or not all(names):
        raise InputError(f"{path}: the names of the columns must be different and not empty, got {names}.")
    for number, row in enumerate(rows[1:], 2):
        if len(row) != len(names):
            entries = format_count(len(row), "entry", "entries")
            raise InputError(f"{path}: row {number} has {entries}, but the header has {len(names)}.")
    columns, texts = {}, []
    for name, *cells in zip(*rows, strict=True):
        try:
            columns[name.strip()] = np.array([float(cell.replace(decimal, ".")) for cell in cells])
        except ValueError:
            texts.append(name.strip())
    return ColumnTable(columns, tuple(texts))


def _read_matlab(path: Path, time: str | None) -> ColumnTable:
    from scipy.io import loadmat  # whose import takes longer than a solve

    try:
        content = loadmat(path, simplify_cells=True)
    except NotImplementedError:
        raise InputError(f"{path} is a MATLAB file of version 7.3; save it in MATLAB with the option '-v7'.") from None
    except Exception as error:
        raise ArchiveError(f"Cannot read {path}: {error}.") from None
    return ColumnTable(_longest_vectors(content, time))


def _longest_vectors(content: Mapping[str, Any], time: str | None) -> dict[str, Array]:
    """Return the vectors with as many entries as the time; those in a structure, if there is one with a time."""
    structures = [value for value in content.values() if isinstance(value, Mapping)]
    for names in (content, *structures):
        vectors = {
            name: np.asarray(value, dtype=float).ravel()
            for name, value in names.items()
            if isinstance(value, np.ndarray) and value.dtype.kind in "fiu" and value.size == max(value.shape)
        }
        times = [name for name in vectors if name == time or name.partition("_")[0] in ("time", "t")]
        size = vectors[times[0]].size if times else 0
        if size:
            return {name: values for name, values in vectors.items() if values.size == size}
    return {}


_READERS: dict[str, Callable[[Path], ColumnTable]] = {".csv": _read_csv, ".sto": _read_opensim, ".mot": _read_opensim}
SUFFIXES = (".csv", ".mat", ".sto", ".mot")
