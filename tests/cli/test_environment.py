"""Commands in an unusual environment."""

import os
import subprocess
import sys

import pytest


@pytest.mark.skipif(sys.platform == "win32", reason="uses a shell of POSIX")
def test_a_figure_without_home_terminal_locale_and_backend(root, folder):
    """No folder is writable except the present one; standard input is closed; lines have 20 letters."""
    environment = {
        "PATH": os.environ["PATH"],
        "PYTHONPATH": str(root),
        "HOME": "/nonexistent",
        "XDG_CACHE_HOME": "/nonexistent",
        "XDG_CONFIG_HOME": "/nonexistent",
        "LC_ALL": "C",
        "COLUMNS": "20",
        "TERM": "dumb",
        "MPLBACKEND": "no such backend",
    }
    gait = root / "docs" / "examples" / "compass_slip.h5"
    run = subprocess.run(
        ["sh", "-c", 'exec "$0" "$@" <&-', sys.executable, "-m", "gaitopt", "plot", str(gait), "-o", "gait.png"],
        capture_output=True, text=True, env=environment, cwd=folder, timeout=240,
    )  # fmt: skip
    assert (run.returncode, run.stdout) == (0, "wrote gait.png\n"), run.stderr
    assert "Traceback" not in run.stderr
    assert (folder / "gait.png").stat().st_size > 10_000
