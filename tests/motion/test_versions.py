"""Versions that results record."""

from importlib import metadata

import pytest

from gaitopt.motion import versions as module
from gaitopt.motion.versions import UNKNOWN, versions


@pytest.fixture(autouse=True)
def _forget():
    module._version_of.cache_clear()
    yield
    module._version_of.cache_clear()


def test_versions_are_those_of_the_installed_packages():
    for name in ("casadi", "numpy", "scipy"):
        assert versions()[name] == metadata.version(name)


def test_versions_are_found_in_the_metadata_where_no_folder_is_named_after_the_package(monkeypatch):
    monkeypatch.setattr(module.sys, "path", [])
    assert versions()["numpy"] == UNKNOWN
    monkeypatch.setattr(metadata, "version", lambda name: "1.2.3")
    module._version_of.cache_clear()
    assert versions()["numpy"] == "1.2.3"
