"""Version of gaitopt, read from the metadata of the installed package."""

from importlib import metadata

try:
    __version__ = metadata.version("gaitopt")
except metadata.PackageNotFoundError:  # a source tree that is not installed
    __version__ = "0+unknown"
