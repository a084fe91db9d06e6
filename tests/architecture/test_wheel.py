"""The wheel holds what an installation needs: types, stubs, templates and the problem scripts."""

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Return a folder into which the wheel is unpacked, as an installation does."""
    pytest.importorskip("hatchling")
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def test_the_wheel_holds_types_templates_and_scripts(installed):
    package = installed / "gaitopt"
    assert (package / "py.typed").is_file()
    assert (package / "cli/templates/problem.py").is_file()
    for origin, pattern in ((ROOT / "gaitopt", "*.pyi"), (ROOT / "problems", "*.py")):
        files = [path.relative_to(origin) for path in origin.rglob(pattern)]
        base = package / "problems" if origin.name == "problems" else package
        assert len(files) > 10
        assert not [path for path in files if not (base / path).is_file()]


@pytest.mark.slow
def test_an_installation_lists_and_copies_its_scripts(installed, tmp_path):
    def run(*arguments):
        environment = {**os.environ, "PYTHONPATH": str(installed)}
        command = [sys.executable, "-m", "gaitopt", *arguments]
        return subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120, check=True
        ).stdout

    scripts = {Path(entry["script"]) for entry in json.loads(run("problems", "--json"))["problems"]}
    assert installed / "gaitopt/problems/compass_slip.py" in scripts
    run("new", "mine", "--from", "compass_slip")
    assert "problem(" in (tmp_path / "mine.py").read_text()
