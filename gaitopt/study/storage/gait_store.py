"""A folder that keeps the gaits of a study while it runs, one file each, so that it can go on after any end."""

import json
from collections.abc import Iterable, Iterator, MutableMapping
from pathlib import Path
from typing import Any

from gaitopt.errors import ArchiveError, InputError
from gaitopt.motion.archive import load, save
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.gait import Gait
from gaitopt.motion.summary import plain

QUESTION = "question.json"

TOLD = 3
"""Differences between two questions that are told one by one."""


class GaitStore(MutableMapping[str, Gait]):
    """Gaits by key, each in a file of its own that is written whole or not at all.

    Parameters
    ----------
    path : str or Path
        Made if there is none.
    question : dict
        What the study computes, as plain data; a folder with another question is refused.

    Raises
    ------
    InputError
        If the folder belongs to another study, or is no folder of a study.
    ArchiveError
        If it cannot be made or read.
    """

    def __init__(self, path: str | Path, question: dict[str, Any]) -> None:
        self.path = Path(path)
        asked = json.loads(json.dumps(plain(question)))
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ArchiveError(f"Cannot make the folder {self.path}: {error.strerror or error}.") from None
        if (self.path / QUESTION).is_file():
            check_same_study(_read(self.path / QUESTION), asked, self.path)
        elif any(self.path.glob("*.h5")):
            raise InputError(f"{self.path} holds files that no study wrote; name another folder.")
        else:
            with write_atomically(self.path / QUESTION) as temporary:
                temporary.write_text(json.dumps(asked, indent=1), encoding="utf-8")

    @staticmethod
    def beside(path: Path) -> Path:
        """Return the folder that belongs to the file of a study; ArchiveError if the file would be a folder itself."""
        if path.is_dir():
            raise ArchiveError(f"Cannot write {path}: it is a folder. Give a file name.")
        return path.with_name(f"{path.name}.parts")

    def file(self, key: str) -> Path:
        """Return the file of a key, there or not."""
        return self.path / f"{key}.h5"

    def __getitem__(self, key: str) -> Gait:
        if key not in self:
            raise KeyError(key)
        try:
            return load(self.file(key))
        except ArchiveError as error:
            raise ArchiveError(f"{error} Delete that file and run the same again to compute it anew.") from None

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
        """Delete all gaits but some."""
        for key in set(self) - set(keys):
            self.file(key).unlink(missing_ok=True)  # another run of the same study may have been faster


def check_same_study(held: Any, asked: dict[str, Any], path: Path) -> None:
    """Raise InputError, naming what differs, unless a file or folder holds the study that is asked for."""
    asked = json.loads(json.dumps(plain(asked)))
    there, here = _axes_of(held), _axes_of(asked)
    if held == asked and there == here:  # results are numbered in the order of the axes
        return
    held = held if isinstance(held, dict) else {}
    parts = [_differing(name, held.get(name), asked[name]) for name in asked if held.get(name) != asked[name]]
    if held == asked:
        parts = [f"its axes are in the order {', '.join(there)}"]
    differing = f" ({' and '.join(parts)})" if parts else ""
    raise InputError(f"{path} holds another study{differing}: name another place, or delete it to start afresh.")


def _axes_of(question: Any) -> list[str]:
    axes = question.get("axes") if isinstance(question, dict) else None
    return list(axes) if isinstance(axes, dict) else []


def _differing(part: str, held: Any, asked: Any) -> str:
    """Return that a part of a question is another one, and the first numbers and texts in it that are."""
    there, here = _short(held), _short(asked)
    told = [
        f"{name} {there[name]} there, {here[name]} here" for name in here if there.get(name, here[name]) != here[name]
    ]
    more = f", and {len(told) - TOLD} more" if len(told) > TOLD else ""
    return f"another {part}{': ' if told else ''}{'; '.join(told[:TOLD])}{more}"


def _short(nested: Any, name: str = "") -> dict[str, str]:
    """Return what fits into a sentence of nested data: numbers and texts by their names."""
    if isinstance(nested, dict):
        inner = (_short(item, f"{name}.{key}" if name else str(key)) for key, item in nested.items())
        return {place: text for found in inner for place, text in found.items()}
    return {name: f"{nested}"} if name and not isinstance(nested, list) else {}


def _read(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ArchiveError(f"{path} is damaged ({error}); delete its folder to start afresh.") from None
