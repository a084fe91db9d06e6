"""Versions of gaitopt and of the packages on which its results depend."""

import functools
import platform
import sys
from pathlib import Path

UNKNOWN = "0+unknown"
"""Version of a package that is not installed."""


def versions() -> dict[str, str]:
    """Return the versions of gaitopt and of the packages on which its results depend."""
    names = ("gaitopt", "casadi", "numpy", "scipy")
    return {name: _version_of(name) for name in names} | {"python": platform.python_version()}


@functools.cache
def _version_of(name: str) -> str:
    """Return the version in the name of the folder with a package's metadata; their reader takes long to import."""
    for entry in sys.path:
        for folder in Path(entry).glob(f"{name}-*.dist-info"):
            return folder.stem.partition("-")[2]
    from importlib import metadata

    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return UNKNOWN
