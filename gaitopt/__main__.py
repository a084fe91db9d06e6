"""``python -m gaitopt`` and ``gaitopt`` run the command line."""

import atexit
import contextlib
import gc
import os
import signal
import sys
import threading
from types import FrameType


def run() -> None:
    """Run the command line and end the process without freeing its objects, which takes longer than printing them."""
    status: list[int] = []
    atexit.register(_leave, status)  # called last, as it is registered first
    try:
        main()
    except SystemExit as end:
        if isinstance(end.code, int):
            status.append(end.code)
        raise


def _leave(status: list[int]) -> None:
    """End the process if its command has ended with a status and all of its output is written."""
    if status:
        with contextlib.suppress(OSError, ValueError):  # a closed stream, which the interpreter reports
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status[0])


def main() -> None:
    """Import and run the command that the command line names."""
    os.environ["MPLBACKEND"] = "agg"  # no command opens a window, and an unknown backend would be an error
    _use_one_thread()
    former = signal.getsignal(signal.SIGINT)
    if former is signal.default_int_handler:
        signal.signal(signal.SIGINT, _exit_immediately)
    from gaitopt.cli.collection import collect_rarely, exclude_imported_modules

    with collect_rarely():
        from gaitopt.address_space import check_imports
        from gaitopt.cli import app

        app.import_commands(sys.argv[1:])
        check_imports()
        exclude_imported_modules()
        threading.excepthook = app.report_thread_error
        try:
            app.main(handler=former if callable(former) else None)
        except SystemExit as end:
            if end.code == app.INTERRUPTED:
                signal.signal(signal.SIGINT, signal.SIG_IGN)  # further interrupts change nothing
                _exit_by_interrupt()
            signal.signal(signal.SIGINT, former)
            # A Ctrl-C during the clean-up of the interpreter would replace the status of the command that has ended.
            atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)
            raise


def _use_one_thread() -> None:
    """Set linear algebra to one thread unless the user has set a number: on small matrices the others only wait."""
    if not any(name in os.environ for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")):
        os.environ["OPENBLAS_NUM_THREADS"] = "1"


def _exit_by_interrupt() -> None:
    """End the process without the interpreter's clean-up, which may take long or end it with another status."""
    if "loky" in sys.modules:
        gc.collect()  # pools of workers that only an exception of repeated interrupts refers to free their semaphores
    with contextlib.suppress(OSError, ValueError):  # a closed stream
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(128 + signal.SIGINT)


def _exit_immediately(number: int, frame: FrameType | None) -> None:
    """End the process while the commands are imported, where an exception could be taken for a missing package."""
    os.write(2, b"Interrupted; no result was written.\n")
    os._exit(128 + number)


if __name__ == "__main__":
    run()
