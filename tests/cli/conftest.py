"""Running the command line: as its own process, and inside this one where many runs would be slow."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]


class Run(NamedTuple):
    """What a command left behind."""

    status: int
    out: str
    err: str

    @property
    def json(self):
        return json.loads(self.out)


@pytest.fixture(scope="session")
def root():
    """Folder of the repository."""
    return ROOT


@pytest.fixture(scope="session")
def slip_file():
    """The slipping gait of the README."""
    return ROOT / "docs/examples/compass_slip.h5"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder that commands run in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def process(folder):
    """Return a function that runs ``gaitopt ARGUMENTS`` as a separate process."""

    def run(*arguments, program=("-m", "gaitopt")):
        done = subprocess.run(
            [sys.executable, *program, *map(str, arguments)],
            capture_output=True,
            text=True,
            cwd=folder,
            env={**os.environ, "COLUMNS": "200"},
            timeout=120,
        )
        return Run(done.returncode, done.stdout, done.stderr)

    return run


@pytest.fixture
def command(folder, capsys, monkeypatch):
    """Return a function that runs ``gaitopt ARGUMENTS`` inside this process."""
    from gaitopt.cli.app import main

    monkeypatch.setenv("COLUMNS", "200")

    def run(*arguments):
        capsys.readouterr()
        with pytest.raises(SystemExit) as stop:
            main([str(argument) for argument in arguments])
        return Run(stop.value.code, *capsys.readouterr())

    return run


@pytest.fixture
def script(folder):
    """Return a function that writes a problem script and gives its path."""

    def write(text, name="own.py"):
        path = folder / name
        path.write_text(text)
        return path

    return write
