"""SciPy is not imported where its BLAS would wait for memory for ever."""

import subprocess
import sys

import pytest

from tests.conftest import ROOT

LIMITED = """
import resource
from pathlib import Path

import numpy

from gaitopt.address_space import check_imports

pages = int(Path("/proc/self/statm").read_text().split()[0])
limit = pages * resource.getpagesize() + ROOM
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
check_imports()
try:
    import scipy.linalg
except MemoryError as error:
    print(error)
else:
    import scipy.special
    print("imported")
"""


CHECKED = """
import resource
import sys

from gaitopt import Execution
from gaitopt.__main__ import main
from gaitopt.parallel.runner import run_tasks
from gaitopt.parallel.task_graph import Task
from tests.parallel import works

resource.setrlimit(resource.RLIMIT_AS, (2**40, 2**40))
tasks = [Task("one", "RoomFinder"), Task("two", "RoomFinder")]
print([outcome.result for outcome in run_tasks(works.finds_by, tasks, None, execution=Execution(workers=2))])
sys.argv = ["gaitopt", "--version"]
try:
    main()
except SystemExit:
    print(works.finds_by(None, "RoomFinder"))
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits the address space")
def test_commands_and_workers_check_the_room():
    done = subprocess.run([sys.executable, "-c", CHECKED], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.stdout.splitlines()[::2] == ["[True, True]", "True"], done.stderr


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads the size of a process from /proc")
@pytest.mark.parametrize(
    ("room", "printed"), [(10**8, "268435456 bytes of address space are not available"), (10**9, "imported")]
)
def test_scipy_is_imported_only_with_room_for_its_libraries(room, printed):
    code = LIMITED.replace("ROOM", str(room))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (done.stdout.strip(), done.stderr) == (printed, "")
