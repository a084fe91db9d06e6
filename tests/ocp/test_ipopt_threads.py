"""The number of threads of the linear algebra that Ipopt uses."""

import os
import subprocess
import sys

import pytest

CODE = """
import ctypes, os, pathlib, casadi
from gaitopt.ocp.nlp.ipopt import _load

_load()
(path,) = pathlib.Path(casadi.__file__).parent.glob("libcasadi-tp-openblas.so.0")
print(ctypes.CDLL(str(path)).openblas_get_num_threads(), os.environ.get("OPENBLAS_NUM_THREADS"))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the library has another name elsewhere")
@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="OpenBLAS has one thread on one core")
@pytest.mark.parametrize(("given", "threads"), [({}, "1 None"), ({"OMP_NUM_THREADS": "2"}, "2 None")])
def test_ipopt_uses_one_thread_unless_the_user_sets_a_number(given, threads):
    inherited = {key: value for key, value in os.environ.items() if not key.endswith("_NUM_THREADS")}
    words = [sys.executable, "-c", CODE]
    run = subprocess.run(words, env=inherited | given, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == threads
