"""A Ctrl-C that arrives after the command has ended, while the interpreter is finalised."""

import os
import subprocess
import sys

import pytest

SCRIPT = """
import builtins, os, signal, sys
from gaitopt import __main__

class Late:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)

builtins.late = Late()
sys.argv = ["gaitopt", "problems"]
__main__.main()
"""


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="Windows has no such signal")
def test_the_status_of_the_command_remains():
    assert subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, timeout=60, check=False).returncode == 0
