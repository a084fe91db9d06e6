"""Dask: the workers of a scheduler, on one machine or many, as an executor."""

import logging
import pickle
import threading
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from typing import Any

from gaitopt.arguments import check_arguments
from gaitopt.errors import GaitoptError, InputError

ANSWER, WORKER_TIMEOUT = 5.0, 60.0
"""Time in which a scheduler must answer, and in which one without workers must get some [s]."""

_COUNT_INTERVAL = 2.0
"""Time between two counts of the workers [s]."""

_RESUME = "Completed results are saved in the output file if one was given; run the same study again to resume."

_one_call = threading.Lock()


@check_arguments
class DaskExecutor(Executor):
    """The workers of a Dask scheduler, for ``Execution(executor=...)``.

    Needs ``pip install 'gaitopt[cluster]'`` here and where the workers run.  A worker takes one task at a time and is a
    process of one thread: ``dask worker ADDRESS --nworkers 8 --nthreads 1``.  The tasks of a worker that terminates are
    repeated by others; workers may be added and removed.

    Parameters
    ----------
    address : str
        Address of the scheduler, such as ``tcp://host:8786``.
    worker_timeout : float
        Longest time without any worker [s].

    Raises
    ------
    InputError
        If no scheduler answers at the address within seconds, or its workers run several threads or another version of
        gaitopt.
    GaitoptError
        If no worker connects in time.

    Examples
    --------
    >>> with DaskExecutor("somewhere") as executor:
    ...     pass
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: 'somewhere' is not an address of a Dask scheduler, such as tcp://host:8786.
    """

    def __init__(self, address: str, *, worker_timeout: float = WORKER_TIMEOUT) -> None:
        self.address = address
        self._worker_timeout = worker_timeout
        self._client = _connect(address)
        self._workers, self._counted, self._seen = 0, -_COUNT_INTERVAL, time.monotonic()
        try:
            while not self.count_workers():
                time.sleep(0.1)
            _check_workers(self._client)
        except BaseException:
            self.shutdown()
            raise

    def count_workers(self) -> int:
        """Return the number of workers, counted at most two seconds ago.

        Raises
        ------
        GaitoptError
            If the scheduler is lost, or it has had no worker for too long.
        """
        now = time.monotonic()
        if not self._connected:
            raise self._connection_error()
        if now - self._counted >= _COUNT_INTERVAL:
            try:
                threads = self._client.sync(self._client.scheduler.ncores, callback_timeout=ANSWER)
            except (OSError, TimeoutError, RuntimeError) as error:
                raise self._connection_error() from error
            self._workers, self._counted = len(threads), now
            if self._workers:
                self._seen = now
        if not self._workers and now - self._seen > self._worker_timeout:
            raise GaitoptError(
                f"The scheduler at {self.address} has had no workers for {self._worker_timeout:.0f} s; start workers: "
                f"dask worker {self.address} --nworkers 4 --nthreads 1. {_RESUME}"
            )
        return self._workers

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **options: Any) -> Future:
        """Submit a call in pickled form, so that the scheduler need not import the modules of its arguments.

        The future raises BrokenExecutor if one worker after another died of the call, GaitoptError if the scheduler is
        lost.
        """
        import cloudpickle

        future: Future = Future()
        self._send(cloudpickle.dumps((function, arguments, options)), future)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Disconnect; the scheduler and its workers continue to run, pending calls are dropped."""
        log = logging.getLogger("distributed.client")
        former, log.disabled = log.disabled, True  # it reports attempts to reach a lost scheduler
        try:
            self._client.close(timeout=2)
        finally:
            log.disabled = former

    def _send(self, call: bytes, future: Future) -> None:
        remote = self._client.submit(_perform, call, pure=False)
        future.add_done_callback(lambda done: remote.cancel() if done.cancelled() else None)
        remote.add_done_callback(lambda done: self._receive(done, call, future))

    def _receive(self, remote: Any, call: bytes, future: Future) -> None:
        """Resolve the future of a call; a call whose result was lost with its worker is sent again."""
        from distributed import KilledWorker
        from distributed.comm import CommClosedError

        if future.cancelled():
            return
        try:
            answer = pickle.loads(remote.result())
        except CancelledError:
            if self._connected:
                self._send(call, future)
            else:
                _resolve(future, error=self._connection_error())
        except KilledWorker as error:
            _resolve(future, error=BrokenExecutor(str(error)))
        except CommClosedError:  # the client may not know yet that it is disconnected
            _resolve(future, error=self._connection_error())
        except BaseException as error:  # raised by the task, or by a lost connection
            _resolve(future, error=error if self._connected else self._connection_error())
        else:
            _resolve(future, answer)

    @property
    def _connected(self) -> bool:
        return bool(self._client.status == "running")

    def _connection_error(self) -> GaitoptError:
        return GaitoptError(
            f"The connection to the Dask scheduler at {self.address} was lost. {_RESUME} Start the scheduler and its "
            "workers first, or use the processes of this machine instead."
        )


def _connect(address: str) -> Any:
    """Return a Dask client; InputError if no scheduler answers in time."""
    try:
        from distributed import Client
    except ImportError:
        raise InputError("Dask is not installed: pip install 'gaitopt[cluster]'.") from None
    if not (isinstance(address, str) and address.rpartition(":")[2].isdigit()):
        raise InputError(f"{address!r} is not an address of a Dask scheduler, such as tcp://host:8786.")
    import asyncio
    from concurrent.futures import ThreadPoolExecutor

    try:
        # A client waits for ever for a port that accepts connections and never answers; and in a notebook, this
        # thread already runs an event loop.
        with ThreadPoolExecutor(1) as thread:
            kind = thread.submit(asyncio.run, _ask_kind(address)).result()
        if kind != "Scheduler":
            raise InputError(f"{address} is the address of a Dask {kind.lower()}; use the address of its scheduler.")
        return Client(address, timeout=ANSWER, set_as_default=False, name="gaitopt")
    except InputError:
        raise
    except Exception as error:  # OSError, or whatever the transport named in the address raises
        reason = f"no answer within {ANSWER:g} s" if isinstance(error, TimeoutError) else error
        raise InputError(
            f"No Dask scheduler answers at {address} ({reason}). Start one with 'dask scheduler', which prints its "
            "address, and check the firewalls."
        ) from error


async def _ask_kind(address: str) -> str:
    """Return what answers at an address, ``"Scheduler"`` for example."""
    import asyncio

    from distributed.core import rpc

    async def ask() -> str:
        async with rpc(address, timeout=ANSWER) as remote:
            return str((await remote.identity())["type"])

    return await asyncio.wait_for(ask(), ANSWER)


def _check_workers(client: Any) -> None:
    """Raise InputError unless all workers are processes of one thread with this version of gaitopt."""
    if any(count > 1 for count in client.nthreads().values()):
        raise InputError(
            "The workers of this scheduler run several tasks in threads of one process, which the optimiser does not "
            "support: start them with --nthreads 1, and one per core with --nworkers."
        )
    expected = _installed_version()
    for worker, answer in client.run(_installed_version, on_error="return").items():
        if isinstance(answer, ImportError):
            raise InputError(f"The worker {worker} cannot import gaitopt ({answer}); install gaitopt {expected} there.")
        if isinstance(answer, str) and answer != expected:
            raise InputError(
                f"The worker {worker} has gaitopt {answer}, but this process has {expected}; install {expected} there."
            )


def _resolve(future: Future, result: Any = None, error: BaseException | None = None) -> None:
    if future.set_running_or_notify_cancel():
        if error is None:
            future.set_result(result)
        else:
            future.set_exception(error)


def _installed_version() -> str:
    from importlib import metadata

    return metadata.version("gaitopt")


def _perform(call: bytes) -> bytes:
    """Do a call in a worker, one at a time however many threads it has."""
    import cloudpickle

    with _one_call:
        function, arguments, options = pickle.loads(call)
        return bytes(cloudpickle.dumps(function(*arguments, **options)))
