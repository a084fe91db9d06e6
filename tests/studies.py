"""Small studies that are disturbed by ``tests.kills``, ``tests.interrupts`` and ``tests.full_disk``.

Each runs as a separate process in a separate folder, with a separate temporary folder.
"""

import itertools
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
COMPASS = ROOT / "problems" / "compass_stick.py"
COARSE = ("--set", "objective=torque_squared", "--set", "intervals=10", "--set", "torque_limit=10")

STUDIES = {
    "sweep": ("sweep", COMPASS, *COARSE, "--over", "friction=0.2:0.3:4", "--starts", "1", "--workers", "2", "-o",
              "out.nc"),
    "search": ("search", COMPASS, *COARSE, "--max-phases", "1", "--starts", "1", "--workers", "2", "-o", "out"),
    "basin": ("basin", ROOT / "problems/rimless_wheel.py", "--over", "theta_rate=0.1:2:40", "--over",
              "foot_speed=0:0.5:12", "--workers", "2", "-o", "out.nc"),
    "pareto": ("pareto", COMPASS, *COARSE, "--points", "3", "--workers", "2", "-o", "out.nc"),
    "audit": ("audit", "--count", "5", "--workers", "2", "-o", "out.json"),
}  # fmt: skip
"""Words of the commands by name; all write ``out...`` and continue there."""

COMMANDS = {
    **STUDIES,
    "solve": ("solve", ROOT / "problems/compass_slip.py", "-o", "out.h5"),
    "trace": ("trace", ROOT / "problems/compass_passive.py", "--over", "slope=1:1.5", "-o", "out.nc"),
    "stability": ("stability", ROOT / "problems/compass_passive.py", "--starts", "50"),
    "design": ("design", ROOT / "problems/compass_design.py", "-o", "out"),
    "tune": ("tune", ROOT / "docs/examples/compass_slip.h5", "--law", "lqr", "--starts", "10", "-o", "out.json"),
    "animate": ("animate", ROOT / "docs/examples/compass_slip.h5", "--steps", "1", "-o", "out.gif"),
}
"""All long commands."""

CHAIN = 4
"""Number of disturbances of a study before it is continued to its end."""

TIMES = {"seconds", "solve_seconds", "build_seconds", "versions", "date", "created", "duration"}
"""Names of entries that differ between equal studies."""


def start(words, folder, **options):
    """Start a command in a folder; its temporary files are in ``folder/tmp``."""
    (folder / "tmp").mkdir(exist_ok=True)
    environment = {**os.environ, "TMPDIR": str(folder / "tmp"), "PYTHONPATH": str(ROOT), "GAITOPT_TRIAL": str(folder)}
    return subprocess.Popen(
        [sys.executable, "-m", "gaitopt", *map(str, words)],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        **options,
    )


def list_processes(folder):
    """Return the numbers of the processes that a command has started in a folder, itself included."""
    mark, found = f"GAITOPT_TRIAL={folder}".encode(), []
    for path in Path("/proc").glob("[0-9]*/environ"):
        try:
            if mark in path.read_bytes().split(b"\0"):
                found.append(int(path.parent.name))
        except OSError:
            continue
    return found


def wait_for_orphans(folder, seconds=20.0):
    """Return the processes of a folder that are left after some seconds."""
    deadline = time.monotonic() + seconds
    while (left := list_processes(folder)) and time.monotonic() < deadline:
        time.sleep(0.1)
    return left


def stray_files(folder):
    """Return the names of files that a finished study must not leave, temporary ones included."""
    strays = [path for path in folder.iterdir() if path.name != "tmp" and not path.name.startswith("out")]
    strays += [path for path in folder.iterdir() if path.name.endswith((".lock", ".parts", ".checkpoint"))]
    strays += (folder / "tmp").glob("gaitopt-*")
    return sorted(path.name for path in {*strays, *folder.glob("out/.*"), *folder.glob("out/*.lock")})


def read_results(folder):
    """Return the results of a finished study as plain data, without times and versions; None without any."""
    if not any((folder / name).exists() for name in ("out.json", "out/ranking.json", "out.nc")):
        return None
    if (folder / "out.json").exists():
        return strip(json.loads((folder / "out.json").read_text()))
    if (folder / "out").is_dir():
        return strip(json.loads((folder / "out" / "ranking.json").read_text()))
    import xarray

    with xarray.open_dataset(folder / "out.nc", engine="h5netcdf") as table:
        return {name: np.asarray(table[name].values).tolist() for name in sorted(table.variables) if name not in TIMES}


def strip(data):
    """Return nested data without times and versions."""
    if isinstance(data, dict):
        return {key: strip(value) for key, value in data.items() if key not in TIMES}
    return [strip(item) for item in data] if isinstance(data, list) else data


def finish(words, folder):
    """Run a command to its end, and return the reasons why it failed; empty if it did not."""
    process = start(words, folder)
    _, errors = process.communicate(timeout=600)
    if process.returncode not in (0, 1) or "Traceback" in errors:
        return [f"status {process.returncode}: {errors[-300:]}"]
    return [f"stray files {strays}"] if (strays := stray_files(folder)) else []


def is_same(one, other):
    """Return whether results are equal, nan included."""
    return json.dumps(one, sort_keys=True) == json.dumps(other, sort_keys=True)


def disturb(name, count, draw, apply):
    """Run a command undisturbed, then with disturbances; a study is continued from one to the next.

    After the last of `CHAIN` disturbances a study is continued to its end and compared with the undisturbed one.

    Parameters
    ----------
    name : str
        Key of `COMMANDS`.
    count : int
        Number of disturbances before the end of the command.
    draw : callable
        (seconds of the undisturbed command) -> iterator of disturbances.
    apply : callable
        (words, folder, disturbance) -> whether it came before the end of the command, and list of faults.

    Returns
    -------
    int, list of str
        Number of disturbances before the end of the command, and the faults.
    """
    words, done, last = COMMANDS[name], 0, 2 * count
    with tempfile.TemporaryDirectory() as top:
        undisturbed = Path(top) / "undisturbed"
        undisturbed.mkdir()
        began, faults = time.monotonic(), finish(words, undisturbed)
        draws, expected = draw(time.monotonic() - began), read_results(undisturbed)
        chain = CHAIN
        for number, disturbance in enumerate(itertools.islice(draws, last), 1):
            if chain == CHAIN or name not in STUDIES:
                folder, chain = Path(top) / str(number), 0
                folder.mkdir()
            before_end, found = apply(words, folder, disturbance)
            done, chain = done + before_end, chain + 1 if before_end else CHAIN
            if name in STUDIES and (chain == CHAIN or done == count):
                found += finish(words, folder)
                if not is_same(read_results(folder), expected):
                    found.append("the results differ from those of an undisturbed study")
            print_faults(f"{name}: disturbance {number}, {done} before the end", found)
            faults += found
            if done == count:
                break
    return done, faults


def print_faults(summary, faults):
    """Print a summary and the faults, one a line."""
    print("\n  ".join([summary, *faults]), flush=True)


def run_series(series, names, count):
    """Run ``[COUNT] [NAME...]`` of the command line, by default all names; ``series(name, COUNT)`` returns faults."""
    words = sys.argv[1:]
    if words and words[0].isdecimal():
        count = int(words.pop(0))
    faults = [fault for name in words or names for fault in series(name, count)]
    sys.exit(1 if faults else 0)
