"""The source distribution is complete, and the conda recipe and the citation agree with pyproject.toml."""

import re
import subprocess
import sys
import tarfile
import tomllib
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CONDA_NAMES = {"matplotlib": "matplotlib-base"}


def test_the_source_distribution_builds_the_same_package(tmp_path):
    pytest.importorskip("hatchling")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", str(tmp_path)]
    subprocess.run(build, cwd=ROOT, capture_output=True, check=True, timeout=120)
    with tarfile.open(next(tmp_path.glob("*.tar.gz"))) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    kept = [
        *("pyproject.toml", "README.md", "LICENSE", "CHANGELOG.md", "CITATION.cff", "gaitopt/py.typed"),
        *("problems/compass_slip.py", "tests/conftest.py", "docs/conf.py", "docs/packaging/meta.yaml"),
        *(path.relative_to(ROOT).as_posix() for path in (ROOT / "gaitopt").rglob("*.py*") if "__pyc" not in str(path)),
    ]
    assert not [name for name in kept if name not in names]


def test_the_conda_recipe_has_the_dependencies_of_the_project():
    recipe = yaml.safe_load((ROOT / "docs/packaging/meta.yaml").read_text(encoding="utf-8"))
    required = [re.fullmatch(r"([\w.-]+)(>=[\d.]+)", text) for text in PROJECT["dependencies"]]
    expected = {f"{CONDA_NAMES.get(bound[1], bound[1])} {bound[2]}" for bound in required}
    python = f"python {PROJECT['requires-python']}"
    assert set(recipe["requirements"]["run"]) == {python, *expected}
    assert python in recipe["requirements"]["host"]
    assert recipe["package"]["version"] == PROJECT["version"]
    assert recipe["build"]["entry_points"] == [f"gaitopt = {PROJECT['scripts']['gaitopt']}"]
    assert recipe["about"]["license"] == PROJECT["license"]


def test_the_citation_has_the_version_and_the_license_of_the_project():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["cff-version"] == "1.2.0"
    assert str(citation["version"]) == PROJECT["version"]
    assert citation["license"] == PROJECT["license"]
    assert citation["authors"]
