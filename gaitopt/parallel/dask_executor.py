"""Dask clusters: workers on many machines, led by a scheduler."""

import logging
import pickle
import threading
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from typing import Any

from gaitopt import __version__
from gaitopt.errors import GaitoptError, InputError

CONNECT, HIRE = 5.0, 60.0
"""How long a scheduler may take to answer, and a cluster may be without any worker [s]."""

_LOOK = 2.0
"""How often the workers are counted [s]."""

_GO_ON = "A study with an output file has kept what was finished: run the same again to go on."

_ALONE = threading.Lock()


class DaskCluster(Executor):
    """The workers of a Dask scheduler, to be given to a study as its `executor`.

    Needs ``pip install 'gaitopt[cluster]'`` here and where the workers run.  A worker takes one task at a time and
    starts as a process of one thread: ``dask worker ADDRESS --nworkers 8 --nthreads 1``.  Tasks of a worker that dies
    are done by others; workers may come and go.

    Parameters
    ----------
    address : str
        Of the scheduler, such as ``tcp://host:8786``.
    hire : float
        How long there may be no worker at all [s].

    Raises
    ------
    InputError
        If no scheduler answers at the address within seconds, or its workers run several threads or another gaitopt.
    GaitoptError
        If no worker comes.

    Examples
    --------
    >>> with DaskCluster("here") as cluster:
    ...     pass
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: 'here' is no address of a Dask scheduler; one looks like tcp://host:8786.
    """

    def __init__(self, address: str, *, hire: float = HIRE) -> None:
        self.address = address
        self._hire = hire
        self._client = _connected(address)
        self._workers, self._counted, self._seen = 0, -_LOOK, time.monotonic()
        try:
            while not self.workers():
                time.sleep(0.1)
            _check_workers(self._client)
        except BaseException:
            self.shutdown()
            raise

    def workers(self) -> int:
        """Return the number of workers, as counted a moment ago.

        Raises
        ------
        GaitoptError
            If the scheduler is lost, or there has been no worker for long.
        """
        now = time.monotonic()
        if not self._connected:
            raise self._lost()
        if now - self._counted >= _LOOK:
            try:
                self._workers = len(self._client.nthreads())
            except (OSError, TimeoutError, RuntimeError) as error:
                raise self._lost() from error
            self._counted = now
            if self._workers:
                self._seen = now
        if not self._workers and now - self._seen > self._hire:
            raise GaitoptError(
                f"The scheduler at {self.address} has had no workers for {self._hire:.0f} s; start some: "
                f"dask worker {self.address} --nworkers 4 --nthreads 1. {_GO_ON}"
            )
        return self._workers

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **options: Any) -> Future:
        """Hand over a call; what it is given and returns is pickled here and there, and opaque to Dask.

        The future raises BrokenExecutor if worker after worker died of it, GaitoptError if the scheduler is lost.
        """
        outer: Future = Future()
        self._send(pickle.dumps((function, arguments, options)), outer)
        return outer

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the cluster, which goes on without us; what is under way is forgotten."""
        log = logging.getLogger("distributed.client")
        former, log.disabled = log.disabled, True  # of attempts to reach a lost scheduler, given up here
        try:
            self._client.close(timeout=2)
        finally:
            log.disabled = former

    def _send(self, call: bytes, outer: Future) -> None:
        inner = self._client.submit(_perform, call, pure=False)
        outer.add_done_callback(lambda done: inner.cancel() if done.cancelled() else None)
        inner.add_done_callback(lambda done: self._hand_on(done, call, outer))

    def _hand_on(self, inner: Any, call: bytes, outer: Future) -> None:
        """Give the outcome of a call to its future; a result that died with its worker before we had it is redone."""
        from distributed import KilledWorker
        from distributed.comm import CommClosedError

        if outer.cancelled():
            return
        try:
            answer = pickle.loads(inner.result())
        except CancelledError:
            if self._connected:
                self._send(call, outer)
            else:
                _settle(outer, error=self._lost())
        except KilledWorker as error:
            _settle(outer, error=BrokenExecutor(str(error)))
        except CommClosedError:  # the client may not know yet that it is no longer connected
            _settle(outer, error=self._lost())
        except BaseException as error:  # the task's own, or what came of a lost connection
            _settle(outer, error=error if self._connected else self._lost())
        else:
            _settle(outer, answer)

    @property
    def _connected(self) -> bool:
        return bool(self._client.status == "running")

    def _lost(self) -> GaitoptError:
        return GaitoptError(
            f"The Dask scheduler at {self.address} was lost. {_GO_ON} Start it and its workers anew before, or leave "
            "the scheduler out to use this machine."
        )


def _connected(address: str) -> Any:
    """Return a Dask client, or raise InputError that says why there is none."""
    try:
        from distributed import Client
    except ImportError:
        raise InputError("Dask is not installed: pip install 'gaitopt[cluster]'.") from None
    if not address.rpartition(":")[2].isdigit():
        raise InputError(f"{address!r} is no address of a Dask scheduler; one looks like tcp://host:8786.")
    try:
        return Client(address, timeout=CONNECT, set_as_default=False, name="gaitopt")
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(
            f"No Dask scheduler answers at {address} ({error}). Start one with 'dask scheduler', which tells its "
            "address, and look whether a firewall is in between."
        ) from error


def _check_workers(client: Any) -> None:
    """Raise InputError unless all workers are processes of one thread that run this gaitopt."""
    threads = client.nthreads()
    if any(count > 1 for count in threads.values()):
        raise InputError(
            "The workers of this scheduler do several tasks at once in threads, which the optimiser cannot: start them "
            "with --nthreads 1, and as many of them as there are cores with --nworkers."
        )
    for worker, answer in client.run(_version, on_error="return").items():
        if isinstance(answer, ImportError):
            raise InputError(f"The worker {worker} has no gaitopt ({answer}); install gaitopt {__version__} there.")
        if isinstance(answer, str) and answer != __version__:
            raise InputError(f"The worker {worker} runs gaitopt {answer}, this is {__version__}; install the same.")


def _settle(future: Future, result: Any = None, error: BaseException | None = None) -> None:
    if future.set_running_or_notify_cancel():
        if error is None:
            future.set_result(result)
        else:
            future.set_exception(error)


def _version() -> str:
    return __version__


def _perform(call: bytes) -> bytes:
    """Do a call in a worker, one at a time however many threads it has."""
    with _ALONE:
        function, arguments, options = pickle.loads(call)
        return pickle.dumps(function(*arguments, **options))
