"""What all tasks of a study share: packed once here, unpacked once in each worker, where the tasks are done."""

import hashlib
import os
import pickle
import threading
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import parent_process
from pathlib import Path
from typing import Any

from gaitopt.errors import InputError

Work = Callable[..., Any]
"""Called as ``work(shared, argument, *results needed)``; a function of a module, so that a worker can find it."""

Prepare = Callable[[], object]


@dataclass(frozen=True)
class SharedPayload:
    """What every task is given, packed once."""

    digest: str
    content: bytes

    @classmethod
    def of(cls, shared: Any) -> "SharedPayload":
        """Pack an object.

        Raises
        ------
        InputError
            If it cannot be sent to another process.
        """
        try:
            content = pickle.dumps(shared)
        except Exception as error:  # whatever a user's own classes do when pickled
            raise InputError(f"{_UNSENDABLE} ({type(error).__name__}: {error})") from error
        return cls(hashlib.sha256(content).hexdigest(), content)


_UNSENDABLE = (
    "The problem cannot be sent to worker processes: put your own classes and functions at the top level of a module "
    "or problem script, not in a notebook or another function, or use workers=1."
)


_UNPACKED: dict[str, Any] = {}
"""In a worker: the object every task is given, by its digest."""

_UNPACKING = threading.Lock()


def init_worker(prepare: Prepare | None, digest: str, file: Path) -> None:
    """Begin a worker's life: follow the parent into death, import what is needed, unpack what is shared."""
    threading.Thread(target=_follow_parent, daemon=True).start()
    try:
        if prepare is not None:
            prepare()
        _unpack(digest, file.read_bytes())
    except Exception as error:  # told when the first task is done, instead of dying without a word
        _UNPACKED[digest] = InputError(f"{_UNSENDABLE} ({type(error).__name__}: {error})")


def _follow_parent() -> None:
    """End this process when its parent has ended, however that ended: nobody else would."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _unpack(digest: str, content: bytes) -> None:
    _UNPACKED.clear()
    _UNPACKED[digest] = pickle.loads(content)


def call(work: Work, digest: str, argument: Any, needed: list[Any]) -> Any:
    """Do a task in a worker that has unpacked what is shared."""
    shared = _UNPACKED[digest]
    if isinstance(shared, InputError):
        raise shared
    return work(shared, argument, *needed)


def call_with_payload(
    work: Work, parcel: SharedPayload, prepare: Prepare | None, argument: Any, needed: list[Any]
) -> Any:
    """Do a task in a worker that we did not start: it gets what is shared with each task, and unpacks it once.

    What the problem needs is imported only where it is not found: a problem script may not be there on that machine.
    """
    with _UNPACKING:
        if parcel.digest not in _UNPACKED:
            try:
                _unpack(parcel.digest, parcel.content)
            except (ImportError, AttributeError) as error:
                if prepare is None:
                    raise InputError(f"{_UNSENDABLE} ({type(error).__name__}: {error})") from error
                prepare()
                _unpack(parcel.digest, parcel.content)
        shared = _UNPACKED[parcel.digest]
    return work(shared, argument, *needed)
