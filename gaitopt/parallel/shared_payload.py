"""The object that all tasks share: pickled once here, unpickled once in each worker."""

import hashlib
import os
import pickle
import shutil
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.address_space import check_imports
from gaitopt.dataclass import dataclass
from gaitopt.errors import GaitoptError, InputError

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

Work = Callable[..., Any]
"""Called as ``work(shared, argument, *results needed)``."""

Prepare = Callable[[], object]
"""Called in a worker to import what the shared object needs."""


@dataclass(frozen=True)
class SharedPayload:
    """An object that every task receives, pickled with what prepares a worker for it.

    Attributes
    ----------
    digest : str
    content : bytes
    """

    digest: str
    content: bytes

    @classmethod
    def pack(cls, shared: Any, prepare: Prepare | None = None) -> "SharedPayload":
        """Pickle an object; functions and classes of notebooks and of other functions are pickled by value.

        Raises
        ------
        InputError
            If it is not picklable.
        """
        import cloudpickle

        try:
            content = cloudpickle.dumps((prepare, cloudpickle.dumps(shared)))
        except Exception as error:  # whatever custom classes raise when they are pickled
            raise InputError(
                f"The problem is not picklable for worker processes ({_describe(error)}): it must not contain "
                "threads, locks, open files or other resources of this process. Remove them, or use workers=1."
            ) from error
        return cls(hashlib.sha256(content).hexdigest(), content)


_unpickled: dict[str, Any] = {}
"""In a worker: the shared object by the digest of its payload; an exception if it could not be prepared."""

_unpickling = threading.Lock()


def init_worker(digest: str, file: Path, parent: "Connection") -> None:
    """Initialise a worker process: exit with the parent, import dependencies, unpickle the shared object."""
    threading.Thread(target=_exit_with_parent, args=(parent, file.parent), daemon=True).start()
    check_imports()
    try:
        prepare, content = pickle.loads(file.read_bytes())
        if prepare is not None:
            prepare()
        _unpickled[digest] = pickle.loads(content)
    except GaitoptError as error:
        _unpickled[digest] = error
    except Exception as error:  # raised by the first task, because a worker that dies here cannot report it
        _unpickled[digest] = _start_error(error)


def call_in_worker(work: Work, digest: str, argument: Any, needed: list[Any]) -> Any:
    """Execute a task in a worker that :func:`init_worker` has prepared."""
    return work(_shared_object(digest), argument, *needed)


def call_with_payload(work: Work, payload: SharedPayload, argument: Any, needed: list[Any]) -> Any:
    """Execute a task in a worker of an external executor: the payload is sent with each task and unpickled once.

    What the problem needs is imported only if it is missing: a problem script may not exist on that machine.
    """
    with _unpickling:
        if payload.digest not in _unpickled:
            _unpickled.clear()
            prepare, content = pickle.loads(payload.content)
            try:
                _unpickled[payload.digest] = _unpickle(content, prepare)
            except GaitoptError:
                raise
            except Exception as error:
                raise _start_error(error) from error
        shared = _shared_object(payload.digest)
    return work(shared, argument, *needed)


def _unpickle(content: bytes, prepare: Prepare | None) -> Any:
    try:
        return pickle.loads(content)
    except (ImportError, AttributeError):
        if prepare is None:
            raise
    prepare()
    return pickle.loads(content)


def _shared_object(digest: str) -> Any:
    shared = _unpickled[digest]
    if isinstance(shared, GaitoptError):
        raise shared
    return shared


def _start_error(error: Exception) -> GaitoptError:
    return GaitoptError(f"A worker process cannot load the problem: {_describe(error)}.")


def _describe(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"


def _exit_with_parent(parent: "Connection", folder: Path) -> None:
    """End this process and remove the folder of the payload when the parent has ended, by whatever cause."""
    try:
        parent.recv_bytes()  # nothing is ever sent: the pipe closes with the parent
    except (EOFError, OSError):
        shutil.rmtree(folder, ignore_errors=True)
        os._exit(1)
