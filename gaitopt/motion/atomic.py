"""Files written whole or not at all."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gaitopt.errors import ArchiveError


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside `path` that takes its place when the block succeeds, and vanishes if it fails.

    Raises
    ------
    ArchiveError
        If the folder is missing or cannot be written.

    Examples
    --------
    >>> with replacing("note.txt") as temporary:
    ...     _ = temporary.write_text("whole")
    >>> Path("note.txt").read_text()
    'whole'
    >>> Path("note.txt").unlink()
    """
    path = Path(path)
    temporary = _temporary(path)
    try:
        yield temporary
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        temporary.replace(path)
    except OSError as error:
        raise ArchiveError(f"Cannot write {path}: {error.strerror or error}.") from error
    finally:
        temporary.unlink(missing_ok=True)


def check_writable(path: str | Path) -> None:
    """Raise ArchiveError if a file could not be written at `path`, before any work is done for it."""
    _temporary(Path(path)).unlink()


def _temporary(path: Path) -> Path:
    """Create an empty temporary file beside `path`."""
    folder = path.parent
    if not folder.is_dir():
        raise ArchiveError(f"Cannot write {path}: the folder {folder} does not exist. Create it, or choose another.")
    if path.is_dir():
        raise ArchiveError(f"Cannot write {path}: it is a folder. Give a file name.")
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=folder)
    except OSError as error:
        raise ArchiveError(
            f"Cannot write {path}: the folder {folder} is not writable ({error.strerror}). Choose another with -o."
        ) from None
    os.close(handle)
    return Path(name)
