"""``python -m gaitopt`` and ``gaitopt`` run the command line."""

import os
import signal
import sys
from types import FrameType

from gaitopt.cli.collection import collect_rarely


def main() -> None:
    """Import and run the command that the command line names."""
    with collect_rarely():
        former = signal.getsignal(signal.SIGINT)
        if former is signal.default_int_handler:
            signal.signal(signal.SIGINT, _exit_at_once)
        from gaitopt.cli import app

        app.import_commands(sys.argv[1:])
        signal.signal(signal.SIGINT, former)
        app.main()


def _exit_at_once(number: int, frame: FrameType | None) -> None:
    """End the process while the commands are imported, where an exception could be taken for a missing package."""
    os.write(2, b"Interrupted; nothing was written.\n")
    os._exit(128 + number)


if __name__ == "__main__":
    main()
