"""Tasks in processes: order, dependence, death and dismissal."""

import math
import os
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from loky import ProcessPoolExecutor

from gaitopt import Execution, GaitoptError, InputError
from gaitopt.errors import ScriptError
from gaitopt.parallel.executors import ExternalExecutor, LocalProcesses
from gaitopt.parallel.payload_folder import PayloadFolder
from gaitopt.parallel.runner import collect_tasks, run_tasks
from gaitopt.parallel.task_graph import Task, TaskOutcome, TaskQueue
from tests.parallel import works

TWO = Execution(workers=2)


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
    assert results(works.slow_add, chain(10), 100, execution=TWO) == serial
    with ThreadPoolExecutor(2) as executor:
        assert results(works.slow_add, chain(10), 100, execution=Execution(executor=executor, workers=2)) == serial


def test_known_results_are_used_and_not_computed_again():
    found = results(works.add, chain(6), 0, known={"0": 1000, "1": 0, "3": 2000})
    assert found == {"2": 2, "4": 4, "5": 7}
    assert results(works.add, chain(7), 0, known={"3": 2000})["6"] == 2006


def test_tasks_in_no_order_are_refused():
    with pytest.raises(InputError, match="'a' needs 'b', which does not precede it"):
        results(works.add, [Task("a", 1, ("b",)), Task("b", 1)], 0)
    with pytest.raises(InputError, match="Two tasks have the key 'a'"):
        results(works.add, [Task("a", 1), Task("a", 2)], 0)
    with pytest.raises(InputError, match="workers must be at least 1"):
        results(works.add, chain(1), 0, execution=Execution(workers=0))


@pytest.mark.slow
def test_a_worker_that_dies_costs_only_the_task_that_kills_it(tmp_path):
    names = ["one", "unlucky", "two", "guilty", "three"]
    tasks = [*map(Task, names, names), Task("after", "after", ("guilty", "unlucky"))]
    ended = {done.task.key: done for done in run_tasks(works.die, tasks, str(tmp_path), execution=TWO)}
    assert {key for key, done in ended.items() if done.failure} == {"guilty"}
    assert "the task repeatedly terminated its worker process" in ended["guilty"].failure
    assert all(done.result == key for key, done in ended.items() if key != "guilty")


def test_an_error_in_a_task_comes_through_and_ends_the_workers():
    tasks = [Task("a", 1), Task("b", 2)]
    with pytest.raises(ValueError, match=r"shared [12]"):
        results(works.fail, tasks, "shared", execution=TWO)


def test_what_cannot_be_pickled_is_refused_before_anything_runs():
    with pytest.raises(InputError, match=r"is not picklable for worker processes \(TypeError: cannot pickle '_thread"):
        results(works.add, chain(2), threading.Lock(), execution=TWO)


def test_functions_and_classes_of_a_function_are_sent():
    class Shift:
        def __init__(self, size):
            self.size = size

    def shift(shared, argument):
        return shared.size + argument + offset

    offset = 1000
    tasks = [Task("a", 1), Task("b", 2)]
    assert results(shift, tasks, Shift(100), execution=TWO) == {"a": 1101, "b": 1102}
    with ThreadPoolExecutor(2) as threads:
        assert results(shift, tasks, Shift(100), execution=Execution(executor=threads))["b"] == 1102


def test_a_result_of_a_class_of_a_function_comes_back():
    class Answer:
        pass

    found = results(lambda shared, argument: Answer(), [Task("a"), Task("b")], execution=TWO)
    assert isinstance(found["a"], Answer)


@pytest.mark.parametrize("where", ["processes", "threads"])
def test_what_goes_wrong_at_the_start_of_a_worker_is_reported_as_it_is(where):
    def prepare():
        raise ModuleNotFoundError("No module named 'my_walker'")

    with ThreadPoolExecutor(2) as threads:
        executor = threads if where == "threads" else None
        shared = works.Missing() if executor else 0  # an external executor prepares only what lacks something
        with pytest.raises(GaitoptError) as failure:
            results(works.add, chain(2), shared, execution=Execution(workers=2, executor=executor, prepare=prepare))
    assert str(failure.value) == (
        "A worker process cannot load the problem: ModuleNotFoundError: No module named 'my_walker'."
    )


def test_a_mistake_in_the_script_of_a_worker_comes_through():
    def prepare():
        raise ScriptError("walker.py, line 3: invalid syntax.")

    with pytest.raises(ScriptError, match="line 3"):
        results(works.add, chain(2), 0, execution=Execution(workers=2, prepare=prepare))


def test_workers_that_die_at_their_start_end_the_study():
    with pytest.raises(GaitoptError, match=r"Worker processes ended 3 times in succession before .* use fewer workers"):
        results(works.add, chain(2), 0, execution=Execution(workers=2, prepare=works.end_process))


@pytest.mark.parametrize("count", [1, 3])
def test_a_pool_whose_manager_ends_is_replaced(monkeypatch, capfd, count):
    """Without memory the manager of the first pools fails, and so does its attempt to report this to the tasks."""
    from loky.process_executor import _ExecutorManagerThread as Manager

    loop = "_run_loop" if hasattr(Manager, "_run_loop") else "run"  # the latter before loky 3.5
    run, pools = getattr(Manager, loop), []

    def fail(manager, *_):
        raise MemoryError

    def run_later_ones(manager):
        pools.append(manager)
        (fail if len(pools) <= count else run)(manager)

    monkeypatch.setattr(Manager, loop, run_later_ones)
    monkeypatch.setattr(Manager, "terminate_broken", lambda *_: None)
    assert results(works.add, chain(4), 0, execution=TWO) == results(works.add, chain(4), 0)
    assert len(pools) > count
    assert "Exception in executor manager thread" not in capfd.readouterr().err


def test_a_full_disk_is_reported(monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    def write_bytes(path, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", write_bytes)
    with pytest.raises(GaitoptError, match=r"Cannot write .*payload\.pickle for worker processes: No space left"):
        results(works.add, chain(2), 0, execution=TWO)
    assert not list(tmp_path.iterdir())


def test_workers_keep_to_one_thread_and_do_not_hear_ctrl_c():
    tasks = [Task(str(i)) for i in range(8)]
    ended = results(works.environment, tasks, execution=TWO)
    processes = {process for process, _, _ in ended.values()}
    assert os.getpid() not in processes
    assert len(processes) <= 2
    assert {(threads, blocked) for _, threads, blocked in ended.values()} == {("1", True)}
    assert not any(map(alive, processes))


def test_leaving_early_ends_the_workers_at_once():
    running = run_tasks(
        works.rest, [Task("short", 0.1), Task("long", 60), Task("longer", 60)], execution=Execution(workers=2)
    )
    assert next(running).task.key == "short"
    began = time.monotonic()
    running.close()
    assert time.monotonic() - began < 30


ORPHANS = """
    import os, signal, time
    from gaitopt import Execution
    from gaitopt.parallel.runner import run_tasks
    from gaitopt.parallel.task_graph import Task, TaskOutcome, TaskQueue
    from tests.parallel import works

    if __name__ == "__main__":
        tasks = [Task("a"), Task("b"), Task("long 1"), Task("long 2")]
        for number, done in enumerate(run_tasks(works.environment, tasks, execution=Execution(workers=2))):
            print(done.result[0], flush=True)
            if number == 1:
                os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.slow
def test_workers_do_not_outlive_a_killed_parent(tmp_path):
    script = tmp_path / "killed.py"
    script.write_text(textwrap.dedent(ORPHANS))
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, timeout=60, check=False, env=environment
    )
    workers = [int(line) for line in done.stdout.split()]
    assert workers
    deadline = time.monotonic() + 20
    while any(map(alive, workers)) or list(tmp_path.glob("gaitopt-*")):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_a_script_needs_no_guard(tmp_path):
    script = tmp_path / "unguarded.py"
    script.write_text(
        "from gaitopt import Execution\n"
        "from gaitopt.parallel.runner import run_tasks\nfrom gaitopt.parallel.task_graph import Task\n"
        "def measure(shared, argument):\n    return len(shared) + argument\n"
        "tasks = [Task('a', 1), Task('b', 2)]\n"
        "done = run_tasks(measure, tasks, 'long' * 1_000_000, execution=Execution(workers=2))\n"
        "print(sorted(outcome.result for outcome in done))\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=120, check=False)
    assert (done.stdout, done.stderr) == ("[4000001, 4000002]\n", "")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"workers": 0}, "Execution.workers must be at least 1, got 0"),
        ({"workers": 1.5}, "Execution.workers must be a whole number"),
        ({"executor": "tcp://host:8786"}, "Execution.executor must be a concurrent.futures.Executor, got 'tcp"),
        ({"prepare": 3}, "Execution.prepare must be a function that is called with no arguments, got 3"),
        ({"observer": "bar"}, "Execution.observer must be a function that is called with the number of tasks done"),
    ],
)
def test_an_execution_that_is_invalid_is_refused(options, message):
    with pytest.raises(InputError, match=message):
        Execution(**options)


def test_an_interrupt_while_the_workers_end_is_raised_afterwards(monkeypatch):
    ended = []

    def shutdown(executor, *, kill):
        signal.raise_signal(signal.SIGINT)
        ended.append(kill)

    monkeypatch.setattr(ExternalExecutor, "shutdown", shutdown)
    tasks, stored = [Task("square", 2), Task("cube", 3)], {}
    with ThreadPoolExecutor(1) as threads, pytest.raises(KeyboardInterrupt):
        results(math.pow, tasks, 10, execution=Execution(executor=threads))
    assert ended == [False]
    with ThreadPoolExecutor(1) as threads:
        report = collect_tasks(
            run_tasks(math.pow, tasks, 10, execution=Execution(executor=threads)), stored, tasks, None
        )
    assert report.interrupted
    assert stored == {"square": 100, "cube": 1000}


def test_killed_workers_leave_no_thread_that_writes_a_large_task_and_no_semaphores():
    """The thread waits for the pipe, which a process that is busy does not read."""
    before = set(threading.enumerate())
    processes = LocalProcesses(1, works.rest_with, None)
    try:
        started = processes.submit(0.0, [])
        started.result(timeout=60)
        for _ in range(3):
            processes.submit(60.0, [bytes(10**6)])
        time.sleep(0.5)  # the pipe is full
    finally:
        processes.shutdown(kill=True)
    assert not [thread for thread in threading.enumerate() if thread not in before and "Feeder" in thread.name]


@pytest.mark.parametrize(("owner", "name"), [(ProcessPoolExecutor, "shutdown"), (LocalProcesses, "_start_pool")])
def test_repeated_interrupts_do_not_leave_workers_half_started_or_half_ended(monkeypatch, owner, name):
    """The second one is raised where it comes, by default; the semaphores of the workers would be left."""
    former, completed, folders = getattr(owner, name), [], []
    remove = PayloadFolder.remove

    def interrupted(*arguments, **options):
        for _ in range(2):
            signal.raise_signal(signal.SIGINT)
        result = former(*arguments, **options)
        completed.append(name)
        return result

    monkeypatch.setattr(owner, name, interrupted)
    monkeypatch.setattr(PayloadFolder, "remove", lambda folder: (folders.append(folder.path), remove(folder)))
    with pytest.raises(KeyboardInterrupt):
        results(works.add, chain(4), 0, execution=TWO)
    assert completed == [name]
    assert len(folders) == 1
    assert not folders[0].exists()


def test_the_tasks_under_way_are_reported_one_for_each_worker():
    seen, tasks = [], [Task(str(number), number, label=f"point {number}") for number in range(3)]
    results(works.add, tasks, 0, execution=Execution(active_observer=seen.append))
    assert seen == [("point 0",), ("point 1",), ("point 2",)]
    seen.clear()
    results(works.add, [*tasks, Task("last", 3)], 0, execution=Execution(workers=2, active_observer=seen.append))
    assert seen[0] == ("point 0", "point 1")  # the third task is submitted in advance and waits
    assert all(len(names) <= 2 for names in seen)
    assert seen[-1] == ()


def test_an_interrupt_during_the_last_outcome_does_not_wait_for_the_workers(monkeypatch):
    killed, stored = [], {}
    monkeypatch.setattr(ExternalExecutor, "shutdown", lambda executor, *, kill: killed.append(kill))

    def interrupt(done, total):
        if done == total:
            signal.raise_signal(signal.SIGINT)

    tasks = [Task("square", 2), Task("cube", 3)]
    with ThreadPoolExecutor(1) as threads:
        running = run_tasks(math.pow, tasks, 10, execution=Execution(executor=threads))
        report = collect_tasks(running, stored, tasks, interrupt)
    assert (report.interrupted, killed) == (True, [True])
    assert stored == {"square": 100, "cube": 1000}


@pytest.mark.parametrize("workers", [1, 2])
def test_an_interrupt_before_the_first_outcome_is_raised(workers):
    stored = {}

    def meanwhile(check):
        signal.raise_signal(signal.SIGINT)
        check()
        stored["meanwhile"] = "completed"

    tasks = [Task("square", 2), Task("cube", 3)]
    running = run_tasks(math.pow, tasks, 10, execution=Execution(workers=workers), meanwhile=meanwhile)
    with pytest.raises(KeyboardInterrupt):
        collect_tasks(running, stored, tasks, None)
    assert stored == {}


def test_what_is_done_meanwhile_is_done_once_while_tasks_run():
    calls, begun = [], threading.Event()

    def work(shared, argument, *needed):
        assert begun.wait(10)
        return argument

    def meanwhile(check):
        check()
        calls.append("called")
        begun.set()

    with ThreadPoolExecutor(1) as threads:
        assert results(work, chain(4), execution=Execution(executor=threads), meanwhile=meanwhile).keys() == set("0123")
    assert calls == ["called"]


def test_workers_take_the_longest_chain_first():
    """The last of these tasks is where they would wait for each other at the end."""
    tasks = [Task("a"), Task("b"), Task("c1"), Task("c2", needs=("c1",)), Task("c3", needs=("c2",))]

    def order(**options):
        queue, keys = TaskQueue(tasks, {}, **options), []
        while (task := queue.next()) is not None:
            keys.append(queue.finish(TaskOutcome(task, None)).task.key)
        return keys

    assert order() == ["a", "b", "c1", "c2", "c3"]
    assert order(longest_first=True) == ["c1", "c2", "a", "b", "c3"]
