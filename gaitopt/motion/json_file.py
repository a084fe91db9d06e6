"""JSON files of results: their format and version are written first and checked on reading."""

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gaitopt.errors import ArchiveError, describe_missing_file
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.summary import plain
from gaitopt.version import __version__


def write_json(facts: Mapping[str, Any], path: Path, kind: tuple[str, int]) -> Path:
    """Write the facts of a result, after its format and version; numbers that are not finite become null.

    Parameters
    ----------
    facts : mapping of str to data
    path : Path
    kind : (str, int)
        Format, such as ``"gaitopt push test"``, and version.

    Raises
    ------
    ArchiveError
        If writing the file fails; an older file of that name is then unchanged.
    """
    head = {"format": kind[0], "format_version": kind[1], "gaitopt": __version__}
    text = json.dumps(plain({**head, **facts}), indent=1, allow_nan=False)
    with write_atomically(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")
    return path


@contextmanager
def read_json(path: Path, kind: tuple[str, int], writer: str) -> Iterator[dict[str, Any]]:
    """Yield the facts of a result; errors of their conversion in the block are reported as a damaged file.

    Parameters
    ----------
    path : Path
    kind : (str, int)
        Format and newest version.
    writer : str
        Command that writes such files.

    Raises
    ------
    ArchiveError
        If there is no such file, or it does not contain a result of this format.
    """
    if not path.is_file():
        raise ArchiveError(describe_missing_file(path))
    try:
        facts = json.loads(path.read_text(encoding="utf-8"))
        if facts["format"] != kind[0] or facts["format_version"] > kind[1]:
            raise ValueError(f"it contains {facts['format']} of version {facts['format_version']}")
        yield facts
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ArchiveError(
            f"Cannot read {path}: expected the format '{kind[0]}', version {kind[1]}, which '{writer}' writes; "
            f"{_explain(error)}."
        ) from None


def _explain(error: Exception) -> str:
    """Return in words why a file was not read."""
    if isinstance(error, KeyError):
        return f"the entry {error} is missing"
    if isinstance(error, json.JSONDecodeError | UnicodeDecodeError):
        return f"it is not JSON text: {error}"
    if isinstance(error, TypeError | AttributeError):
        return f"an entry has an invalid type: {error}"
    return str(error)
