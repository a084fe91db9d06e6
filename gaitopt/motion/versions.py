"""Versions of gaitopt and of the packages on which its results depend."""

import contextlib
import functools
import os
import platform
import sys

UNKNOWN = "0+unknown"
"""Version of a package that is not installed."""


def versions() -> dict[str, str]:
    """Return the versions of gaitopt and of the packages on which its results depend."""
    names = ("gaitopt", "casadi", "numpy", "scipy")
    return {name: _version_of(name) for name in names} | {"python": platform.python_version()}


@functools.cache
def _version_of(name: str) -> str:
    """Return the version in the name of the folder with a package's metadata; their reader takes long to import."""
    for folder in _list_metadata():
        package, _, version = folder.removesuffix(".dist-info").partition("-")
        if package == name:
            return version
    from importlib import metadata

    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return UNKNOWN


def _list_metadata() -> list[str]:
    """Return the names of the folders with the metadata of packages, in the order in which packages are found."""
    folders: list[str] = []
    for entry in sys.path:
        with contextlib.suppress(OSError):  # an archive, or a folder that does not exist
            folders += [folder.name for folder in os.scandir(entry or ".") if folder.name.endswith(".dist-info")]
    return folders
