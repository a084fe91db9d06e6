"""Checksum of a file: a block of 512 bytes at its end with the SHA-256 digest of all bytes before it.

Other programs ignore bytes behind the end of an HDF5 file.  The block is checked before the HDF5 library reads
anything, since the library may not return from a damaged file, or return other numbers.
"""

import hashlib
import os
import struct
from pathlib import Path

from gaitopt.errors import ArchiveError

BLOCK = 512
"""Size of the block [bytes]."""

_TAG = b"gaitopt sha256 "
_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_END_OFFSET = {0: 40, 1: 44, 2: 28, 3: 28}
"""Place of the end of the file in its superblock, by the version of that (HDF5 file format, section II.A)."""


def make_block(digest: str) -> bytes:
    """Return the block with a digest, a line of text that is padded with blanks.

    Examples
    --------
    >>> len(make_block(hashlib.sha256(b"content").hexdigest()))
    512
    """
    return (_TAG + digest.encode()).ljust(BLOCK - 1) + b"\n"


def append_checksum(path: Path) -> None:
    """Append the block to a complete HDF5 file.

    Raises
    ------
    OSError
        If the disk is full.
    """
    block = make_block(_digest(path, path.stat().st_size))
    with path.open("ab") as file:
        file.write(block)


def verify_checksum(path: Path) -> bool:
    """Return whether a file has a checksum, which is checked; without one, only the size of the file is.

    Raises
    ------
    ArchiveError
        If the file does not agree with its checksum, is truncated, or is not an HDF5 file.
    OSError
        If the file is not readable.

    Examples
    --------
    >>> verify_checksum(Path("docs/examples/compass_slip.h5"))
    True
    """
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - BLOCK))
        last = file.read(BLOCK)
        file.seek(0)
        first = file.read(52)
    if last.startswith(_TAG):
        if last != make_block(_digest(path, size - BLOCK)):
            raise _unreadable(path, "its content does not agree with its checksum")
        return True
    end = _end_of(first)
    if end is None:
        raise _unreadable(path, "it does not begin like an HDF5 file")
    if size != end:
        raise _unreadable(path, f"it has {size} bytes, but its header states {end}")
    return False


def _unreadable(path: Path, reason: str) -> ArchiveError:
    return ArchiveError(f"{path} is not a readable HDF5 file: it is damaged or of another kind ({reason}).")


def _digest(path: Path, size: int) -> str:
    """Return the digest of the first `size` bytes of a file."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while size > 0 and (part := file.read(min(size, 1 << 20))):
            digest.update(part)
            size -= len(part)
    return digest.hexdigest()


def _end_of(first: bytes) -> int | None:
    """Return the size of an HDF5 file that its first bytes state; None for another file."""
    if not first.startswith(_SIGNATURE) or len(first) < 52 or first[8] not in _END_OFFSET:
        return None
    return int(struct.unpack_from("<Q", first, _END_OFFSET[first[8]])[0])
