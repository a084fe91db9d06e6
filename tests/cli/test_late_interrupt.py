"""A Ctrl-C that arrives just before a command begins, or after it has ended, while the interpreter is finalised."""

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
