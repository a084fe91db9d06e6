"""Errors of scripts: what a script raises, with the line of the script."""

import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gaitopt.errors import GaitoptError, ScriptError


@contextmanager
def running_script(path: Path, *, changed: bool = False) -> Iterator[None]:
    """Let a script import its neighbours, as ``python SCRIPT`` would, and turn what it raises into a ScriptError.

    Errors of gaitopt remain what they are, with a note on the line of the script that led to them, unless the script
    runs with changed parameters, whose values are rather the cause.
    """
    former = list(sys.path)
    sys.path.insert(0, str(path.parent.resolve()))
    try:
        yield
    except GaitoptError as error:
        line = None if changed else _find_line(path, error)
        if line is not None and not getattr(error, "__notes__", ()):
            error.add_note(f"at {path}, line {line}")
        raise
    except (Exception, SystemExit) as error:
        raise _script_error(path, error) from error
    finally:
        sys.path[:] = former


def _script_error(path: Path, error: BaseException) -> ScriptError:
    """Return one sentence on an exception raised by a script, with the line of the script if there is one."""
    if isinstance(error, SyntaxError) and error.lineno is not None:
        end = "" if error.msg.endswith(("?", ".")) else "."
        return ScriptError(f"{path}, line {error.lineno}: {error.msg}{end}")
    line = _find_line(path, error)
    place = f"{path}, line {line}" if line is not None else str(path)
    return ScriptError(f"{place} raised {type(error).__name__}: {' '.join(str(error).split())}")


def _find_line(path: Path, error: BaseException) -> int | None:
    """Return the innermost line of a script in the traceback of an error, None if there is none."""
    resolved, frames = path.resolve(), traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if Path(frame.filename).resolve() == resolved]
    return lines[-1] if lines else None
