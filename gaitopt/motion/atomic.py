"""Atomic writing of files in the format of their suffix, only to places where a result may be written."""

import contextlib
import os
import stat
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from gaitopt.errors import ArchiveError, InputError
from gaitopt.interrupts import defer_interrupt

GAIT_SUFFIXES = {".h5": "HDF5", ".hdf5": "HDF5"}
"""Suffixes of gait files, and their format."""

_WRITTEN: ContextVar[list[Path] | None] = ContextVar("written", default=None)


@contextmanager
def record_writes(written: list[Path]) -> Iterator[None]:
    """Add the files that are written in the block to a list, in order.

    Examples
    --------
    >>> written = []
    >>> with record_writes(written), write_atomically("note.txt") as temporary:
    ...     _ = temporary.write_text("whole")
    >>> [path.name for path in written]
    ['note.txt']
    >>> Path("note.txt").unlink()
    """
    token = _WRITTEN.set(written)
    try:
        yield
    finally:
        _WRITTEN.reset(token)


@contextmanager
def write_atomically(path: str | Path, *, heading: str | None = None) -> Iterator[Path]:
    """Yield a temporary path beside `path` that replaces it if the block succeeds, and is removed if it fails.

    The file reaches the disk before it is renamed, and the folder after: even if the machine loses power, `path`
    contains either the old or the new content.  A symbolic link is followed, and a file that exists keeps its
    permissions.

    Parameters
    ----------
    path : str or Path
    heading : str, optional
        Text with which the Python modules begin that may be replaced.

    Raises
    ------
    InputError
        If `path` has the suffix of a Python script, and is not a module that begins with `heading`.
    ArchiveError
        If the folder is missing or not writable, or `path` is a device, a pipe, a folder or a read-only file.

    Examples
    --------
    >>> with write_atomically("note.txt") as temporary:
    ...     _ = temporary.write_text("whole")
    >>> Path("note.txt").read_text()
    'whole'
    >>> Path("note.txt").unlink()
    """
    target = _resolve_target(Path(path), heading)
    with _temporary_file(target, Path(path)) as temporary:
        try:
            yield temporary
            _set_permissions(temporary, target)
            _sync(temporary, os.O_RDWR)
            temporary.replace(target)
            if (written := _WRITTEN.get()) is not None:
                written.append(Path(path))
            if os.name == "posix":  # Windows cannot open a folder
                _sync(target.parent, os.O_RDONLY)
        except OSError as error:
            raise ArchiveError(f"Cannot write {path}: {error.strerror or error}.") from error


def _resolve_target(path: Path, heading: str | None = None) -> Path:
    """Return the file that is written for a path, behind symbolic links; raise an error if it must not be replaced."""
    if path.suffix.lower() == ".py" and not _is_replaceable(path, heading):
        raise InputError(f"Cannot write {path}: the suffix '.py' is that of a script, which is not overwritten.")
    try:
        target = Path(os.path.realpath(path))
        mode = target.stat().st_mode
    except FileNotFoundError:
        return target
    except NotADirectoryError:
        raise ArchiveError(
            f"Cannot write {path}: the folder {path.parent} does not exist. Create it, or choose another folder."
        ) from None
    except (OSError, ValueError) as error:
        raise ArchiveError(f"Cannot write {path!r}: {getattr(error, 'strerror', None) or error}.") from None
    if stat.S_ISDIR(mode):
        raise ArchiveError(f"Cannot write {path}: it is a folder. Specify a file name.")
    if not stat.S_ISREG(mode):
        raise ArchiveError(f"Cannot write {path}: it is a device, a pipe or a socket. Specify a file name.")
    if not mode & 0o222 or not os.access(target, os.W_OK):
        raise ArchiveError(
            f"Cannot write {path}: the file is read-only. Change its permissions or choose another name."
        )
    return target


def _set_permissions(temporary: Path, target: Path) -> None:
    """Give a new file the permissions and the owner of the file that it replaces, or those of any new file."""
    try:
        former = target.stat()
    except FileNotFoundError:
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        return
    if hasattr(os, "chown"):
        with contextlib.suppress(OSError):  # only the superuser may give a file to another owner
            os.chown(temporary, former.st_uid, former.st_gid)
    temporary.chmod(stat.S_IMODE(former.st_mode))


def _sync(path: Path, flags: int) -> None:
    """Wait until a file or a folder has reached the disk."""
    handle = os.open(path, flags)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def reserve(path: Path, size: int) -> None:
    """Raise OSError unless a disk has room for a file of `size` bytes, for writers that fail on a full disk."""
    if hasattr(os, "posix_fallocate"):
        with path.open("wb") as file:
            os.posix_fallocate(file.fileno(), 0, max(1, size))


def check_writable(path: str | Path, *, heading: str | None = None) -> None:
    """Raise an error if `path` may not be written, before the computation of its content; see `write_atomically`."""
    with _temporary_file(_resolve_target(Path(path), heading), Path(path)):
        pass


def check_suffix(path: Path, kinds: Mapping[str, str]) -> str:
    """Return the suffix of a path in lower case, or raise InputError with the accepted ones.

    Parameters
    ----------
    path : Path
    kinds : mapping of str to str
        Accepted suffixes with their dot, and a description of each.

    Examples
    --------
    >>> check_suffix(Path("gait.PNG"), {".png": "image"})
    '.png'
    >>> check_suffix(Path("gait.bmp"), {".png": "image"})
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: Cannot write gait.bmp: the suffix '.bmp' is not that of a known format. Use .png (image).
    """
    suffix = path.suffix.lower()
    if suffix in kinds:
        return suffix
    possible = ", ".join(f"{kind} ({description})" for kind, description in kinds.items())
    wrong = f"the suffix {suffix!r} is not that of a known format" if suffix else "the file name has no suffix"
    raise InputError(f"Cannot write {path}: {wrong}. Use {possible}.")


def check_gait_suffix(path: Path) -> None:
    """Raise InputError unless a path has the suffix of a gait file; the message states what writes other formats."""
    if path.is_dir():
        return  # which the writer rejects
    try:
        check_suffix(path, GAIT_SUFFIXES)
    except InputError as error:
        raise InputError(
            f"{error} CSV, JSON and C files are written by 'gaitopt export' or write_csv, write_torques and write_c."
        ) from None


def _is_replaceable(script: Path, heading: str | None) -> bool:
    """Return whether a Python file may be written: none exists, or its text begins with a heading."""
    if heading is None:
        return False
    return not script.exists() or (script.is_file() and script.read_bytes().startswith(heading.encode()))


@contextmanager
def _temporary_file(target: Path, path: Path) -> Iterator[Path]:
    """Yield an empty temporary file beside the file that is written for `path`; no Ctrl-C leaves it behind."""
    temporary: Path | None = None
    try:
        with defer_interrupt():
            temporary = _create_temporary(target, path)
        yield temporary
    finally:
        if temporary is not None:
            try:
                temporary.unlink(missing_ok=True)
            finally:  # in case a Ctrl-C has ended the first call before it removed the file
                temporary.unlink(missing_ok=True)


def _create_temporary(target: Path, path: Path) -> Path:
    """Create an empty temporary file beside the file that is written for `path`."""
    folder = target.parent
    if not folder.is_dir():
        raise ArchiveError(
            f"Cannot write {path}: the folder {folder} does not exist. Create it, or choose another folder."
        )
    try:
        handle, name = tempfile.mkstemp(prefix=f".{target.stem}-", suffix=target.suffix, dir=folder)
    except OSError as error:
        raise ArchiveError(
            f"Cannot write {path}: the folder {folder} is not writable ({error.strerror}). Choose another folder with "
            "-o."
        ) from None
    os.close(handle)
    return Path(name)
