"""Folders of killed processes are removed at the next start, those of running ones are not."""

import os
import subprocess
import sys
import tempfile

import pytest

from gaitopt.parallel.payload_folder import PayloadFolder

OWNER = """
import sys
from gaitopt.parallel.payload_folder import PayloadFolder
folder = PayloadFolder()
print(folder.path, flush=True)
sys.stdin.read()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="uses locks of POSIX")
def test_the_folder_of_a_killed_process_is_removed_at_the_next_start(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    unknown = tmp_path / "gaitopt-of-someone"
    unknown.mkdir()
    owner = subprocess.Popen(
        [sys.executable, "-c", OWNER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env={**os.environ, "TMPDIR": str(tmp_path)},
    )  # fmt: skip
    folder = tmp_path / owner.stdout.readline().strip().rpartition("/")[2]
    assert folder.is_dir()
    PayloadFolder().remove()
    assert folder.is_dir()
    owner.kill()
    owner.communicate()
    assert folder.is_dir()
    own = PayloadFolder()
    assert sorted(tmp_path.iterdir()) == sorted([own.path, unknown])
    own.remove()
    assert [*tmp_path.iterdir()] == [unknown]
