"""Versions of gaitopt and of the packages on which its results depend."""

import functools
import platform


def versions() -> dict[str, str]:
    """Return the versions of gaitopt and of the packages on which its results depend."""
    names = ("gaitopt", "casadi", "numpy", "scipy")
    return {name: _version_of(name) for name in names} | {"python": platform.python_version()}


@functools.cache
def _version_of(name: str) -> str:
    from importlib import metadata  # whose import takes as long as that of all commands

    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "0+unknown"
