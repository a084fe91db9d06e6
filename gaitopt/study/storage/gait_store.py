"""A folder that stores the gaits of a study while it runs, one file each, so that the study can be resumed."""

import json
from collections.abc import Iterable, Iterator, MutableMapping
from pathlib import Path
from typing import Any

from gaitopt.errors import ArchiveError, InputError
from gaitopt.motion.archive import load, save
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.gait import Gait
from gaitopt.motion.summary import plain
from gaitopt.study.storage.study_lock import SUFFIX

QUESTION, RANKING = "question.json", "ranking.json"
"""Files of the key of a study and of the ranking of a search in their folder."""

MAX_DIFFERENCES = 3
"""Number of differences between two studies that an error message lists."""


class GaitStore(MutableMapping[str, Gait]):
    """Gaits by key, each in a separate file that is written atomically.

    Parameters
    ----------
    path : str or Path
        Created if it does not exist.
    key : dict
        Key of the study as plain data; a folder with results of a different study is rejected.

    Raises
    ------
    InputError
        If the folder belongs to another study, or to none.
    ArchiveError
        If it is not writable or readable.
    """

    def __init__(self, path: str | Path, key: dict[str, Any]) -> None:
        self.path = Path(path)
        requested = json.loads(json.dumps(plain(key)))
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ArchiveError(f"Cannot create the folder {self.path}: {error.strerror or error}.") from None
        if (self.path / QUESTION).is_file():
            try:
                check_same_study(_read(self.path / QUESTION), requested, self.path)
            except InputError:
                if not self._is_unused():
                    raise
                self._write_key(requested)
        elif any(self.path.glob("*.h5")):
            raise InputError(
                f"The folder {self.path} contains gait files that belong to no study; choose another folder."
            )
        else:
            self._write_key(requested)

    def _is_unused(self) -> bool:
        """Return whether the folder has no result of its study, nor a process that computes one."""
        return not any(self.path.glob("*.h5")) and not any(self.path.glob(f"*{SUFFIX}"))

    def _write_key(self, key: dict[str, Any]) -> None:
        with write_atomically(self.path / QUESTION) as temporary:
            temporary.write_text(json.dumps(key, indent=1), encoding="utf-8")

    @staticmethod
    def beside(path: Path) -> Path:
        """Return the folder that belongs to the file of a study; ArchiveError if the file is a folder itself."""
        if path.is_dir():
            raise ArchiveError(f"Cannot write {path}: it is a folder. Specify a file name.")
        return path.with_name(f"{path.name}.parts")

    def file(self, key: str) -> Path:
        """Return the file of a key, whether it exists or not."""
        return self.path / f"{key}.h5"

    def __getitem__(self, key: str) -> Gait:
        if key not in self:
            raise KeyError(key)
        try:
            gait: Any = load(self.file(key))
            return gait
        except ArchiveError as error:
            raise ArchiveError(f"{error} Delete that file and run the same study again to compute it again.") from None

    def __setitem__(self, key: str, gait: Gait) -> None:
        save(gait, self.file(key))

    def __delitem__(self, key: str) -> None:
        self.file(key).unlink()

    def __contains__(self, key: object) -> bool:
        return isinstance(key, str) and self.file(key).is_file()

    def __iter__(self) -> Iterator[str]:
        return (path.stem for path in sorted(self.path.glob("*.h5")) if not path.name.startswith("."))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def keep_only(self, keys: Iterable[str]) -> None:
        """Delete all gaits except those with the given keys."""
        for key in set(self) - set(keys):
            self.file(key).unlink(missing_ok=True)  # another run of the same study may have deleted it


def check_same_study(stored: Any, requested: dict[str, Any], path: Path) -> None:
    """Raise InputError with the differences unless a file or folder contains the requested study."""
    requested = json.loads(json.dumps(plain(requested)))
    stored_axes = _axes_of(stored)
    if stored == requested and stored_axes == _axes_of(requested):  # results are numbered in the order of the axes
        return
    stored = stored if isinstance(stored, dict) else {}
    parts = [
        _describe_difference(name, stored.get(name), requested[name])
        for name in requested
        if stored.get(name) != requested[name]
    ]
    if stored == requested:
        parts = [f"its axes are in the order {', '.join(stored_axes)}"]
    differences = f" ({' and '.join(parts)})" if parts else ""
    raise InputError(
        f"{path} contains a different study{differences}: choose another path, or delete it to start again."
    )


def _axes_of(key: Any) -> list[str]:
    axes = key.get("axes") if isinstance(key, dict) else None
    return list(axes) if isinstance(axes, dict) else []


def _describe_difference(part: str, stored: Any, requested: Any) -> str:
    """Return that a part of the key of a study differs, with the first numbers and texts that do."""
    before, now = _leaves(stored), _leaves(requested)
    differences = [
        f"{name} {before[name]} stored, {now[name]} requested"
        for name in now
        if before.get(name, now[name]) != now[name]
    ]
    more = f", and {len(differences) - MAX_DIFFERENCES} more" if len(differences) > MAX_DIFFERENCES else ""
    return f"different {part}{': ' if differences else ''}{'; '.join(differences[:MAX_DIFFERENCES])}{more}"


def _leaves(nested: Any, name: str = "") -> dict[str, str]:
    """Return the numbers and texts of nested data by their names; lists are left out."""
    if isinstance(nested, dict):
        inner = (_leaves(item, f"{name}.{key}" if name else str(key)) for key, item in nested.items())
        return {place: text for leaves in inner for place, text in leaves.items()}
    return {name: f"{nested}"} if name and not isinstance(nested, list) else {}


def _read(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ArchiveError(f"{path} is damaged ({error}); delete its folder to start again.") from None
