"""Versions of gaitopt and of the packages on which its results depend."""

import contextlib
import functools
import platform
import sys
from pathlib import Path

UNKNOWN = "0+unknown"
"""Version of a package that is not installed."""

METADATA = ".dist-info"
"""End of the name of the folder with a package's metadata."""


def versions() -> dict[str, str]:
    """Return the versions of gaitopt and of the packages on which its results depend."""
    names = ("gaitopt", "casadi", "numpy", "scipy")
    return {name: _version_of(name) for name in names} | {"python": platform.python_version()}


@functools.lru_cache(maxsize=1)
def _list_metadata(path: tuple[str, ...]) -> list[str]:
    """Return the names of the folders with metadata of packages in the folders that Python imports from."""
    entries: list[str] = []
    for folder in path:
        with contextlib.suppress(OSError):  # an archive, or a folder that does not exist
            entries += [entry.name for entry in Path(folder).iterdir()]
    return [entry for entry in entries if entry.endswith(METADATA)]


@functools.cache
def _version_of(name: str) -> str:
    """Return the version in the name of the folder with a package's metadata; their reader takes long to import."""
    for folder in _list_metadata(tuple(sys.path)):
        if folder.startswith(f"{name}-"):
            return folder.removesuffix(METADATA).partition("-")[2]
    from importlib import metadata

    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return UNKNOWN
