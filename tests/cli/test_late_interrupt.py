"""The end of a command, and a Ctrl-C just before it begins, or after it has ended, during the final clean-up."""

import os
import subprocess
import sys
from importlib.metadata import version

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


EARLY = """
import signal, sys
from gaitopt import __main__
from gaitopt.cli import app

def interrupt(*arguments, make=app.{name}):
    signal.raise_signal(signal.SIGINT)
    return make(*arguments)

signal.signal(signal.SIGINT, signal.default_int_handler)
app.{name} = interrupt
sys.argv = ["gaitopt", "problems"]
__main__.main()
"""

END = """
import atexit, builtins, sys
{first}
from gaitopt.__main__ import main{alias}
from gaitopt.cli import app

class Late:
    def __del__(self):
        print("deleted", flush=True)

builtins.late = Late()
run = app.main
app.main = lambda **options: (atexit.register(print, "called"), run(**options))
sys.argv = ["gaitopt", *sys.argv[1:]]
sys.exit({call}())
"""

FIRST = """
import signal, sys

class Interrupt:
    def find_spec(self, name, *_):
        if name == "gaitopt.cli.collection":
            signal.raise_signal(signal.SIGINT)

signal.signal(signal.SIGINT, signal.default_int_handler)
sys.meta_path.insert(0, Interrupt())
from gaitopt import __main__
__main__.main()
"""


@pytest.mark.skipif(os.name != "posix", reason="Windows has no such signal")
def test_an_interrupt_in_the_first_import_of_the_command_line_ends_in_a_sentence():
    run = subprocess.run([sys.executable, "-c", FIRST], capture_output=True, text=True, timeout=60, check=False)
    assert (run.returncode, run.stderr) == (130, "Interrupted; no result was written.\n")


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="Windows has no such signal")
@pytest.mark.parametrize("name", ["record_interrupts", "collect_rarely"])
def test_an_interrupt_between_the_imports_and_the_command_ends_it_with_a_sentence(name):
    words = [sys.executable, "-c", EARLY.format(name=name)]
    run = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert (run.returncode, run.stderr) == (130, "Interrupted; no result was written.\n")


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="Windows has no such signal")
def test_the_status_of_the_command_remains():
    assert subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, timeout=60, check=False).returncode == 0


@pytest.mark.parametrize(("words", "status"), [(["--version"], 0), (["problem"], 2)])
def test_a_command_ends_with_its_status_without_deleting_modules(words, status):
    run = end_command(*words)
    assert run.returncode == status
    assert "No such command" in run.stderr or run.stdout.startswith(version("gaitopt"))
    assert run.stdout.endswith("called\n")


@pytest.mark.parametrize(
    "changes", [{"first": "atexit.register(print, 'first')"}, {"alias": " as other", "call": "other"}]
)
def test_a_process_that_does_more_than_a_command_ends_as_usual(changes):
    printed = end_command("--version", **changes).stdout.splitlines()
    assert printed[1:] == ["called", *(["first"] if "first" in changes else []), "deleted"]


def end_command(*words, first="", alias="", call="main"):
    """Run a command in a script that registers a function for the end of the process."""
    script = END.format(first=first, alias=alias, call=call)
    command = [sys.executable, "-c", script, *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
