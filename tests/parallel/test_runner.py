"""Tasks in processes: order, dependence, death and dismissal."""

import os
import subprocess
import sys
import textwrap
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from gaitopt import InputError
from gaitopt.parallel.runner import run_tasks
from gaitopt.parallel.task_graph import Task
from tests.study import works


def chain(count, apart=3):
    """Return tasks each of which needs the one `apart` places before it."""
    return [Task(str(i), i, (str(i - apart),) if i >= apart else ()) for i in range(count)]


def results(*arguments, **options):
    return {done.task.key: done.result for done in run_tasks(*arguments, **options)}


def alive(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def test_results_do_not_depend_on_who_does_the_work():
    serial = results(works.slow_add, chain(10), 100)
    assert list(serial) == [str(i) for i in range(10)]
    assert serial["9"] == sum(100 + i for i in (0, 3, 6, 9))
    assert results(works.slow_add, chain(10), 100, workers=2) == serial
    with ThreadPoolExecutor(2) as executor:
        assert results(works.slow_add, chain(10), 100, executor=executor, workers=2) == serial


def test_known_results_are_used_and_not_computed_again():
    found = results(works.add, chain(6), 0, known={"0": 1000, "1": 0, "3": 2000})
    assert found == {"2": 2, "4": 4, "5": 7}
    assert results(works.add, chain(7), 0, known={"3": 2000})["6"] == 2006


def test_tasks_in_no_order_are_refused():
    with pytest.raises(InputError, match="'a' needs 'b', which does not come before"):
        results(works.add, [Task("a", 1, ("b",)), Task("b", 1)], 0)
    with pytest.raises(InputError, match="Two tasks are called 'a'"):
        results(works.add, [Task("a", 1), Task("a", 2)], 0)
    with pytest.raises(InputError, match="workers must be at least 1"):
        results(works.add, chain(1), 0, workers=0)


def test_a_worker_that_dies_costs_only_the_task_that_kills_it(tmp_path):
    names = ["one", "unlucky", "two", "guilty", "three"]
    tasks = [*map(Task, names, names), Task("after", "after", ("guilty", "unlucky"))]
    ended = {done.task.key: done for done in run_tasks(works.die, tasks, str(tmp_path), workers=2)}
    assert {key for key, done in ended.items() if done.failure} == {"guilty"}
    assert "process after process died" in ended["guilty"].failure
    assert all(done.result == key for key, done in ended.items() if key != "guilty")


def test_an_error_in_a_task_comes_through_and_ends_the_workers():
    tasks = [Task("a", 1), Task("b", 2)]
    with pytest.raises(ValueError, match=r"shared [12]"):
        results(works.fail, tasks, "shared", workers=2)


def test_what_cannot_be_sent_is_said_before_anything_runs():
    with pytest.raises(InputError, match="cannot be sent to worker processes"):
        results(works.add, chain(2), lambda: None, workers=2)


def test_workers_keep_to_one_thread_and_do_not_hear_ctrl_c():
    tasks = [Task(str(i)) for i in range(8)]
    ended = results(works.environment, tasks, workers=2)
    processes = {process for process, _, _ in ended.values()}
    assert os.getpid() not in processes
    assert len(processes) <= 2
    assert {(threads, blocked) for _, threads, blocked in ended.values()} == {("1", True)}
    assert not any(map(alive, processes))


def test_leaving_early_ends_the_workers_at_once():
    running = run_tasks(works.rest, [Task("short", 0.1), Task("long", 60), Task("longer", 60)], workers=2)
    assert next(running).task.key == "short"
    began = time.monotonic()
    running.close()
    assert time.monotonic() - began < 30


ORPHANS = """
    import os, signal, time
    from gaitopt.parallel.runner import run_tasks
    from gaitopt.parallel.task_graph import Task
    from tests.study import works

    if __name__ == "__main__":
        tasks = [Task("a"), Task("b"), Task("long 1"), Task("long 2")]
        for number, done in enumerate(run_tasks(works.environment, tasks, workers=2)):
            print(done.result[0], flush=True)
            if number == 1:
                os.kill(os.getpid(), signal.SIGKILL)
"""


def test_workers_do_not_outlive_a_killed_parent(tmp_path):
    script = tmp_path / "killed.py"
    script.write_text(textwrap.dedent(ORPHANS))
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=60, check=False)
    workers = [int(line) for line in done.stdout.split()]
    assert workers
    deadline = time.monotonic() + 20
    while any(map(alive, workers)):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_a_script_without_guard_is_told_what_is_wrong(tmp_path):
    script = tmp_path / "unguarded.py"
    script.write_text(
        "from gaitopt.parallel.runner import run_tasks\nfrom gaitopt.parallel.task_graph import Task\n"
        "from tests.study import works\n"
        "tasks = [Task('a', 1), Task('b', 2)]\nlist(run_tasks(works.add, tasks, 'long' * 1_000_000, workers=2))\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 1
    assert "GaitoptError: Worker processes die before they do anything" in done.stderr
