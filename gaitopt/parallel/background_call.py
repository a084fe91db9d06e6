"""A call in another thread, for numerical work of a library that releases Python's lock."""

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class BackgroundCall(Generic[T]):
    """A call of a function without arguments that begins in another thread, or immediately if none can be started.

    The function must not build CasADi expressions: the caller may hold the lock of expressions while it waits.

    Parameters
    ----------
    function : callable

    Examples
    --------
    >>> call = BackgroundCall(lambda: 1 + 3)
    >>> call.result()
    4
    """

    def __init__(self, function: Callable[[], T]) -> None:
        self._function, self._values = function, list[T]()
        self._failure: BaseException | None = None
        self._thread: threading.Thread | None = threading.Thread(target=self._run)
        try:
            self._thread.start()
        except RuntimeError:  # no memory for a thread
            self._thread = None
            self._run()

    def _run(self) -> None:
        try:
            self._values.append(self._function())
        except BaseException as failure:  # raised where the result is used
            self._failure = failure

    def result(self) -> T:
        """Return the value of the function, or raise its error, when the call has ended."""
        if self._thread is not None:
            self._thread.join()
        if self._failure is not None:
            raise self._failure
        return self._values[0]
