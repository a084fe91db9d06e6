"""Studies on a Dask cluster: a scheduler and two workers, processes of this machine."""

import http.server
import signal
import socket
import sys
import threading
import time
from concurrent.futures import Future

import numpy as np
import pytest

from gaitopt import (
    DaskExecutor,
    Execution,
    GaitoptError,
    InputError,
    SettlingCriterion,
    __version__,
    basin,
    rimless_wheel,
)
from gaitopt.parallel import dask_executor as module
from gaitopt.parallel.runner import collect_tasks, run_tasks
from gaitopt.parallel.task_graph import Task
from gaitopt.simulation.scipy_engine import ScipyEngine
from tests import dask
from tests.parallel import works
from tests.parallel.test_runner import chain, results


@pytest.mark.slow
def test_a_lost_scheduler_ends_a_study_with_all_that_was_finished_kept(tmp_path):
    with dask.scheduler(tmp_path) as (address, process):
        with pytest.raises(GaitoptError, match="has had no workers for 0 s; start workers: dask worker tcp"):
            DaskExecutor(address, worker_timeout=0)
        with dask.workers(address, 1), DaskExecutor(address) as cluster:
            tasks, kept = [Task(str(i), i) for i in range(500)], {}

            def kill(done, total):
                if done == 3:
                    process.kill()

            with pytest.raises(GaitoptError, match=r"was lost\..* run the same study again to resume"):
                collect_tasks(
                    run_tasks(works.slow_add, tasks, 0, execution=Execution(executor=cluster)), kept, tasks, kill
                )
            assert 3 <= len(kept) < 500
            with pytest.raises(GaitoptError, match="was lost"):
                results(works.add, [Task("a", 1)], 0, execution=Execution(executor=cluster))


def test_a_wrong_address_is_said_within_seconds(monkeypatch):
    monkeypatch.setattr(module, "ANSWER", 0.2)
    began = time.monotonic()
    with pytest.raises(InputError, match=r"No Dask scheduler answers at tcp://127\.0\.0\.1:1"):
        DaskExecutor("tcp://127.0.0.1:1")
    assert time.monotonic() - began < 10
    with pytest.raises(InputError, match="not an address of a Dask scheduler"):
        DaskExecutor("tcp://127.0.0.1")


@pytest.fixture(params=["silent", "http"])
def other_port(request):
    """Return the address of a port that accepts connections and is not a Dask scheduler's."""
    if request.param == "silent":
        server = socket.create_server(("127.0.0.1", 0))
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"
        server.close()
    else:
        handler = type("Handler", (http.server.BaseHTTPRequestHandler,), {"log_message": lambda *message: None})
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            yield f"tcp://127.0.0.1:{server.server_port}"
            server.shutdown()


@pytest.mark.slow
def test_a_port_of_something_else_ends_in_a_sentence_in_time(other_port, monkeypatch):
    monkeypatch.setattr(module, "ANSWER", 1.0)
    began = time.monotonic()
    with pytest.raises(InputError, match=rf"No Dask scheduler answers at {other_port} \(no answer within 1 s\)"):
        DaskExecutor(other_port)
    assert time.monotonic() - began < 30


@pytest.mark.parametrize("kind", ["ucx", "tls", "nonsense"])
def test_a_transport_that_is_not_configured_ends_in_a_sentence(kind):
    with pytest.raises(InputError, match=rf"No Dask scheduler answers at {kind}://127\.0\.0\.1:1 \(.*\)"):
        DaskExecutor(f"{kind}://127.0.0.1:1")


def test_an_address_must_be_a_text():
    with pytest.raises(InputError, match="None is not an address of a Dask scheduler"):
        DaskExecutor(None)


@pytest.mark.slow
def test_a_scheduler_that_freezes_is_lost_within_seconds(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "_COUNT_INTERVAL", 0.0)
    monkeypatch.setattr(module, "ANSWER", 2.0)
    with dask.scheduler(tmp_path) as (address, process), dask.workers(address, 1), DaskExecutor(address) as executor:
        process.send_signal(signal.SIGSTOP)
        began = time.monotonic()
        try:
            with pytest.raises(GaitoptError, match="was lost"):
                executor.count_workers()
        finally:
            process.send_signal(signal.SIGCONT)
        assert time.monotonic() - began < 10


def test_without_dask_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install 'gaitopt\[cluster\]'"):
        DaskExecutor("tcp://127.0.0.1:8786")


class Client:
    """Stands for a client of a scheduler with one worker."""

    def __init__(self, threads, answer):
        self.threads, self.answer = threads, answer

    def nthreads(self):
        return {"tcp://far:1": self.threads}

    def run(self, function, on_error):
        return {"tcp://far:1": self.answer}


@pytest.mark.parametrize(
    ("threads", "answer", "message"),
    [
        (4, __version__, "start them with --nthreads 1"),
        (
            1,
            ModuleNotFoundError("No module named 'gaitopt'"),
            f"tcp://far:1 cannot import gaitopt .*install gaitopt {__version__}",
        ),
        (1, "0.0.1", "has gaitopt 0.0.1"),
    ],
)
def test_workers_that_cannot_do_the_work_are_refused(threads, answer, message):
    with pytest.raises(InputError, match=message):
        module._check_workers(Client(threads, answer))


@pytest.fixture(scope="module")
def cluster(scheduler):
    """Tests of the cluster are the last ones of this file: its processes work even while they wait."""
    with DaskExecutor(scheduler) as connected:
        deadline = time.monotonic() + 60
        while connected.count_workers() < 2:
            assert time.monotonic() < deadline
            time.sleep(0.1)
        yield connected


@pytest.mark.slow
def test_results_do_not_depend_on_the_executor(cluster):
    assert results(works.slow_add, chain(10), 100, execution=Execution(executor=cluster)) == results(
        works.slow_add, chain(10), 100
    )


def test_a_basin_is_the_same_byte_for_byte(cluster, monkeypatch):
    import gaitopt.study.basins.basin as basin_module

    monkeypatch.setattr(basin_module, "CHUNK", 4)
    grid = {"theta_rate": np.linspace(0.1, 3.2, 14)}
    settings = {"engine": ScipyEngine(relative=1e-8), "criterion": SettlingCriterion(steps=3, tolerance=1e-2)}
    here = basin(rimless_wheel(), {"slope": 0.23}, grid, **settings)
    there = basin(rimless_wheel(), {"slope": 0.23}, grid, **settings, execution=Execution(executor=cluster))
    assert there.identical(here)
    for name in ("ending", "steps", "final"):
        assert there[name].values.tobytes() == here[name].values.tobytes()


def test_an_error_in_a_task_comes_through(cluster):
    with pytest.raises(ValueError, match="shared 1"):
        results(works.fail, [Task("a", 1)], "shared", execution=Execution(executor=cluster))


def test_workers_that_die_cost_only_the_task_that_kills_them(cluster, tmp_path):
    names = ["one", "unlucky", "two", "guilty", "three"]
    tasks = [*map(Task, names, names), Task("after", "after", ("guilty", "unlucky"))]
    ended = {
        done.task.key: done
        for done in run_tasks(works.die, tasks, str(tmp_path), execution=Execution(executor=cluster))
    }
    assert {key for key, done in ended.items() if done.failure} == {"guilty"}
    assert "the task repeatedly terminated its worker process" in ended["guilty"].failure
    assert all(done.result == key for key, done in ended.items() if key != "guilty")


def test_a_connection_that_closes_under_a_result_is_a_lost_scheduler(cluster):
    """As it does when the scheduler dies while a result is on its way, before the client notices."""
    from distributed.comm import CommClosedError

    class Inner:
        def result(self):
            raise CommClosedError("Stream is closed")

    outer = Future()
    cluster._receive(Inner(), b"", outer)
    with pytest.raises(GaitoptError, match=r"was lost\..* run the same study again to resume"):
        outer.result(timeout=0)


def test_the_address_of_a_worker_is_refused(cluster):
    (worker, *_) = cluster._client.nthreads()
    with pytest.raises(InputError, match=f"{worker} is the address of a Dask worker; use the address of its scheduler"):
        DaskExecutor(worker)
