"""The end of the process of a command: its status and its output are complete, and its objects are not freed."""

import subprocess
import sys

import pytest

SCRIPT = """
import builtins, sys
from gaitopt import __main__

class Object:
    def __del__(self):
        print("freed")

builtins.kept = Object()
sys.argv = ["gaitopt", *{words}]
__main__.run()
"""


def run(words, **options):
    return subprocess.run(
        [sys.executable, "-c", SCRIPT.format(words=words)], text=True, timeout=60, check=False, **options
    )


@pytest.mark.parametrize(("words", "status", "said"), [(["--version"], 0, "0."), (["show", "nothing.h5"], 2, "")])
def test_the_process_ends_with_the_status_and_the_output_of_the_command(words, status, said):
    ended = run(words, capture_output=True)
    assert ended.returncode == status
    assert ended.stdout.startswith(said)
    assert "freed" not in ended.stdout
    assert ("nothing.h5" in ended.stderr) == (status == 2)


def test_functions_registered_by_the_command_are_called_at_the_end():
    code = (
        "import atexit, sys\nfrom gaitopt import __main__\n"
        "def main():\n    atexit.register(print, 'called')\n    sys.exit(3)\n"
        "__main__.main = main\n__main__.run()"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert (ended.returncode, ended.stdout) == (3, "called\n")


def test_an_error_of_the_program_is_shown_as_by_the_interpreter():
    code = "from gaitopt import __main__\n__main__.main = lambda: 1 / 0\n__main__.run()"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 1
    assert "ZeroDivisionError" in ended.stderr
