"""Versions of gaitopt and of what its numbers depend on."""

import functools
import platform
from importlib import metadata


def versions() -> dict[str, str]:
    """Return the versions of gaitopt and of what its numbers depend on."""
    names = ("gaitopt", "casadi", "numpy", "scipy")
    return {name: _installed(name) for name in names} | {"python": platform.python_version()}


@functools.cache
def _installed(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "0+unknown"
