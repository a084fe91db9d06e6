"""Copies of files with flipped bits, zeroed or overwritten ranges, or a lost end, from fixed seeds."""

from gaitopt import ArchiveError, InputError, load, load_basin, load_diagram, load_sweep

READERS = {"gait": load, "basin": load_basin, "sweep": load_sweep, "diagram": load_diagram}

UNNOTICED, REFUSED, UNCHANGED = "unnoticed", "refused", "unchanged"


def flip_bits(content, rng):
    for place in rng.integers(0, len(content), int(rng.integers(1, 9))):
        content[place] ^= 1 << int(rng.integers(8))
    return content


def zero_range(content, rng):
    start, size = int(rng.integers(0, len(content))), int(rng.choice([1, 16, 512, 4096]))
    content[start : start + size] = bytes(len(content[start : start + size]))
    return content


def overwrite_range(content, rng):
    start = int(rng.integers(0, len(content)))
    size = len(content[start : start + int(rng.choice([8, 512]))])
    content[start : start + size] = rng.bytes(size)
    return content


def truncate(content, rng):
    return content[: int(rng.integers(0, len(content)))]


def truncate_checksum(content, rng):
    return content[: len(content) - int(rng.integers(1, 1025))]


def append(content, rng):
    return content + rng.bytes(int(rng.integers(1, 1025)))


DAMAGES = (flip_bits, zero_range, overwrite_range, truncate, truncate_checksum, append)


def damage(content, rng):
    """Return a damaged copy of the content of a file."""
    return bytes(DAMAGES[int(rng.integers(len(DAMAGES)))](bytearray(content), rng))


def read_damaged(kind, content, original, path):
    """Return what a reader does with content written to a path."""
    path.write_bytes(content)
    try:
        READERS[kind](path)
    except (ArchiveError, InputError):
        return REFUSED
    return UNCHANGED if content == original else UNNOTICED
