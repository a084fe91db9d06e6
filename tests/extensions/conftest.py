"""Fixtures of the extensions."""

from tests.cli.conftest import command, folder
from tests.ocp.conftest import reference_problem

__all__ = ["command", "folder", "reference_problem"]
