"""A process that is forked while a thread solves can solve, too."""

import os
import subprocess
import sys

import pytest

SCRIPT = """
import os, threading, time, warnings
from gaitopt.locks import ONE_AT_A_TIME

acquired, done = threading.Event(), threading.Event()


def hold():
    with ONE_AT_A_TIME:
        acquired.set()
        done.wait()


threading.Thread(target=hold).start()
acquired.wait()
warnings.simplefilter("ignore")
child = os.fork()
if child == 0:
    with ONE_AT_A_TIME:
        os._exit(7)
status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
done.set()
print(status)
"""

REENTRANT = """
import os, warnings
from gaitopt.locks import ForkSafeLock

warnings.simplefilter("ignore")
lock, main = ForkSafeLock(), os.getpid()
with lock:
    child = os.fork()
with lock:
    pass
if os.getpid() != main:
    os._exit(7)
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows does not fork")
@pytest.mark.parametrize("script", [SCRIPT, REENTRANT])
def test_a_forked_process_finds_the_locks_free(script):
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "7\n"
