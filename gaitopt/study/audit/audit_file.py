"""Files of audits: the result of each problem as JSON, stored when it is finished."""

import time
from collections.abc import Iterator, MutableMapping
from pathlib import Path
from typing import Any

from gaitopt.errors import InputError
from gaitopt.motion.json_file import read_json, write_json
from gaitopt.motion.versions import versions

KIND = "gaitopt audit", 1

PERIOD = 2.0
"""Least time between two writes [s]."""


class AuditFile(MutableMapping[str, dict[str, Any]]):
    """Results of an audit by the number of the problem, in memory and, if there is a path, in a file.

    Parameters
    ----------
    path : Path or None
    seed : int
    starts : int or None
        Seed and number of starts of the audit; a file with others is refused.
    impulses : bool
        Whether the problems have impulses of actuators; a file with the other kind is refused.

    Raises
    ------
    InputError
        If the file contains the results of another audit.
    ArchiveError
        If the file is unreadable.

    Examples
    --------
    >>> results = AuditFile(None, 1, None)
    >>> results["0"] = {"result": "verified"}
    >>> dict(results)
    {'0': {'result': 'verified'}}
    """

    def __init__(self, path: Path | None, seed: int, starts: int | None, *, impulses: bool = False) -> None:
        self._path, self._settings = path, {"seed": seed, "starts": starts, "impulses": impulses}
        self._written = 0.0
        self._problems: dict[str, dict[str, Any]] = {}
        if path is not None and path.exists():
            self._problems = _read(path, self._settings)

    def __getitem__(self, key: str) -> dict[str, Any]:
        return self._problems[key]

    def __setitem__(self, key: str, value: dict[str, Any]) -> None:
        self._problems[key] = value
        if time.monotonic() - self._written > PERIOD:
            self.write()

    def __delitem__(self, key: str) -> None:
        del self._problems[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._problems)

    def __len__(self) -> int:
        return len(self._problems)

    def write(self) -> None:
        """Write the file, if there is one."""
        self._written = time.monotonic()
        if self._path is not None:
            problems = dict(sorted(self._problems.items(), key=lambda item: int(item[0])))
            write_json({**self._settings, "versions": versions(), "problems": problems}, self._path, KIND)


def _read(path: Path, settings: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the results in a file."""
    with read_json(path, KIND, "gaitopt audit -o") as facts:
        same = {name: {"impulses": False, **facts}[name] for name in settings} == settings  # once without this option
        problems = {
            str(int(key)): {**value, "result": str(value["result"])} for key, value in facts["problems"].items()
        }
    if not same:
        raise InputError(
            f"{path} contains an audit with another seed, number of starts or kind of problems (--impulses); choose "
            "another file."
        )
    return problems
