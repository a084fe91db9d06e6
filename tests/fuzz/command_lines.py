"""Command lines with odd words, drawn from the commands and options of the program itself."""

import contextlib
import io
import shutil
import signal
import warnings

import numpy as np
from typer.main import get_command

from gaitopt.cli.app import app, main
from tests.fuzz.fuzzer import PATIENCE, Hang, _stop

TIME_LIMIT = 20.0
"""Longest processor time of a command [s]."""

ODD = (
    *("", " ", "nan", "inf", "-1", "0", "1e308", "99999999999999999999", "-", "--", "=", "a=b", "friction=", "=1"),
    *("friction=nan", "friction=high", "frction=0.3", "friction=0.1:0.2:3", "friction=0.2:0.1:3", "speed=free"),
    *("a:b:c", "friction=0.1,0.2,nan", "friction=0:1:999999999", "stick | stick", "slip+ |", "|", "any", "\x1b[31m"),
    *("a\0b", "\udcff", "nowhere.h5", "nowhere/x.h5", ".", "/", "/dev/null", "/dev/full", "x" * 300, "gait.h5"),
    *("problem.py", "broken.py", "text.txt", "out.png", "out.csv", "out.nc", "out.html", "tcp://127.0.0.1:1"),
    *("http://127.0.0.1:9", "lqr", "[bold]"),
)

SHORT = {
    "push": ["--starts", "1"],
    "tune": ["--gain", "nonsense=1"],
    "animate": ["--steps", "1", "--slow", "0.2"],
    "audit": ["--count", "1"],
}
"""Options without which a command takes minutes; not added to a command line that has one of them."""


def prepare(root, folder):
    """Write the files that command lines name."""
    shutil.copy(root / "docs/examples/compass_slip.h5", folder / "gait.h5")
    shutil.copy(root / "problems/compass_passive.py", folder / "problem.py")
    (folder / "broken.py").write_text("def problem(:\n")
    (folder / "text.txt").write_text("text\n")


def draw(number):
    """Return the words of a command line."""
    rng = np.random.default_rng([20261123, number])
    commands = get_command(app).commands
    name = list(commands)[number % len(commands)]
    words, options = [name], []

    def odd():
        return ODD[int(rng.integers(len(ODD)))]

    for parameter in commands[name].params:
        if parameter.param_type_name == "argument":
            good = "problem.py" if "py" in str(parameter.metavar).lower() else "gait.h5"
            words += [good if rng.random() < 0.7 else odd()] if parameter.required or rng.random() < 0.3 else []
        elif rng.random() < 0.25:
            flag = str(rng.choice(parameter.opts))
            options += [flag] if parameter.is_flag else [flag, odd()]
    short = SHORT.get(name, [])
    options += [] if {*short} & {*options} else short
    return words + options + ([odd()] if rng.random() < 0.15 else [])


def run(words, folder):
    """Return what a command line ended in: a status, or raw and the error, or hang."""
    former = {number: signal.signal(number, _stop) for number in (signal.SIGALRM, signal.SIGPROF)}
    signal.setitimer(signal.ITIMER_REAL, PATIENCE)
    signal.setitimer(signal.ITIMER_PROF, TIME_LIMIT)
    text = io.StringIO()
    try:
        with (
            contextlib.chdir(folder),
            contextlib.redirect_stdout(text),
            contextlib.redirect_stderr(text),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("ignore")
            main(words)
    except SystemExit as end:
        return f"status {end.code}"
    except Hang:
        return "hang"
    except BaseException as error:
        return f"raw {type(error).__name__}: {error!s:.100}"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.setitimer(signal.ITIMER_PROF, 0)
        for number, handler in former.items():
            signal.signal(number, handler)
    return "raw no end"
