"""Hostile gait files through every command: ``python -m tests.hostile_files [NAME...]`` (all files by default).

Every file has a valid checksum, but its structure, numbers or texts are not those of a gait.  No command may end in a
traceback, hang, crash or print a terminal escape, and a report that is written runs no script of the file (Chromium).
"""

import contextlib
import io
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np

from gaitopt.cli.app import main
from tests.hdf5 import edit_hdf5
from tests.hostile import CELL, CLOSING, ESCAPE, LATEX, MARKUP, PATH, SCRIPT, C

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "docs/examples/compass_slip.h5"
SECONDS = 600.0
"""Time for all commands on a file, after which they count as hanging [s]."""

SEGMENT, JUMP = "motion/segments/0000", "motion/jumps/0000"

COMMANDS = (
    """
show FILE|show FILE --json|doctor FILE|doctor FILE --json|verify FILE|verify FILE --json|plot FILE -o figure.png
animate FILE -o film.gif --steps 1 --slow 0.2|report FILE -o page.html|compare FILE -o figure.svg
export FILE -o motion.csv|export FILE -o torques.json|export FILE -o code.c --law joint_pd|export FILE -o code.py
stability FILE --json|simulate FILE|push FILE --json --points 1|tune FILE --law joint_pd --starts 1 --json
basin FILE --over th1=0.1,0.2 --json|trace FILE --over slope=0.01:0.011|sweep FILE --over friction=0.2 -o out.nc
""".strip()
    .replace("\n", "|")
    .split("|")
)


def put(path, value):
    """Return an edit that replaces a dataset by values of any shape and type."""

    def edit(file):
        attributes = dict(file[path].attrs)
        del file[path]
        file[path] = value
        file[path].attrs.update({name: attributes[name] for name in ("unit", "rows") if name in attributes})

    return edit


def fill(path, number):
    """Return an edit that sets the first number of a dataset."""

    def edit(file):
        file[path][(0,) * file[path].ndim] = number

    return edit


def fail(edit):
    """Return an edit after which the gait is also one that was not solved."""

    def edit_failed(file):
        edit(file)
        file.attrs["status"] = "iteration_limit"
        file["verification"].attrs["passed"] = False

    return edit_failed


def name(path, attribute, value):
    """Return an edit that sets an attribute."""
    return lambda file: file[path].attrs.__setitem__(attribute, value)


def remove(path):
    """Return an edit that removes an object."""
    return lambda file: file.__delitem__(path)


def swap(path):
    """Return an edit that exchanges the dimensions of a dataset."""
    return lambda file: put(path, file[path][()].T)(file)


def change_problem(key, value):
    """Return an edit of an entry of the problem."""

    def edit(file):
        file.attrs["problem"] = json.dumps({**json.loads(file.attrs["problem"]), key: value})

    return edit


def name_robot(text):
    """Return an edit of the name of the robot."""

    def edit(file):
        file.attrs["robot"] = file["robot"].attrs["name"] = text

    return edit


def claim(path, shape):
    """Return an edit that declares a dataset without storing it."""

    def edit(file):
        del file[path]
        file.create_dataset(path, shape, float, chunks=tuple(min(size, 64) for size in shape))

    return edit


def link(path, target):
    """Return an edit that replaces an object by a link."""

    def edit(file):
        del file[path]
        file[path] = target

    return edit


NUMBERS = {
    "nan state": fill(f"{SEGMENT}/q", np.nan),
    "infinite force": fill(f"{SEGMENT}/force", np.inf),
    "huge torque": fill(f"{SEGMENT}/torque", 1e308),
    "huge torque of a failed gait": fail(fill(f"{SEGMENT}/torque", 1e308)),
    "nan time of a failed gait": fail(fill(f"{SEGMENT}/time", np.nan)),
    "nan time": fill(f"{SEGMENT}/time", np.nan),
    "time backwards": lambda file: put(f"{SEGMENT}/time", file[f"{SEGMENT}/time"][()][::-1])(file),
    "zero mass": name("motion", "total_mass", 0.0),
    "negative mass": name("motion/parameters", "leg_mass", -4.0),
    "zero leg": name("motion/parameters", "leg_length", 0.0),
    "zero gravity": name("motion/parameters", "gravity", 0.0),
    "nan friction": name("motion/parameters", "friction", np.nan),
    "text as friction": name("motion/parameters", "friction", "much"),
    "nan impulse": fill(f"{JUMP}/impulse", np.nan),
    "huge step": name(SEGMENT, "step", 2**62),
    "nan multipliers": fill("solution/constraints/touchdown/multipliers", np.nan),
    "model of other bytes": fill("robot/model", 0),
    "other values of the robot": fill("robot/values", 1e9),
}

STRUCTURES = {
    "swapped dimensions": swap(f"{SEGMENT}/q"),
    "no samples": put(f"{SEGMENT}/q", np.zeros((4, 0))),
    "one dimension": put(f"{SEGMENT}/q", np.zeros(21)),
    "strings as numbers": put(f"{SEGMENT}/time", np.array([b"x"] * 21)),
    "complex numbers": put(f"{SEGMENT}/v", np.zeros((4, 21), complex)),
    "a table as numbers": put(f"{SEGMENT}/v", np.zeros(4, [("a", float)])),
    "no jumps": remove("motion/jumps"),
    "no jump": remove(JUMP),
    "no segments": remove("motion/segments"),
    "no motion": remove("motion"),
    "no robot": remove("robot"),
    "no solver": remove("solver"),
    "a group as data": lambda file: (file.__delitem__(f"{SEGMENT}/q"), file.create_group(f"{SEGMENT}/q")),
    "data as a group": lambda file: (file.__delitem__("solver"), file.create_dataset("solver", data=1.0)),
    "gigantic data": claim(f"{SEGMENT}/q", (4, 2**40)),
    "a link to itself": link(SEGMENT, h5py.SoftLink(f"/{SEGMENT}")),
    "a link to another file": link(f"{SEGMENT}/q", h5py.ExternalLink("/etc/passwd", "/")),
    "a link to its root": lambda file: file.__setitem__("motion/segments/0002", file["/"]),
    "unknown mode": name(SEGMENT, "mode", "fly"),
    "impossible sequence": lambda file: file.attrs.__setitem__("sequence", "slip+ | free | | stick"),
    "future version": lambda file: file.attrs.__setitem__("format_version", 99),
    "a list as the problem": lambda file: file.attrs.__setitem__("problem", "[1]"),
    "deep problem": lambda file: file.attrs.__setitem__("problem", "[" * 100000),
}

TEXTS = {
    "script as problem": change_problem("name", SCRIPT + CLOSING),
    "script as objective": change_problem("objective", CLOSING),
    "escape as problem": change_problem("name", ESCAPE),
    "markup as note": change_problem("note", [MARKUP, LATEX]),
    "script as robot": name_robot(SCRIPT),
    "C as robot": name_robot(C),
    "path as robot": name_robot(PATH),
    "cell as actuator": name("motion", "actuators", json.dumps([CELL, "hip"])),
    "LaTeX as angle": name("motion", "angles", json.dumps([LATEX, "th2"])),
    "script as message": name("solver", "message", SCRIPT + CLOSING),
    "escapes as warnings": name("solver", "warnings", json.dumps([ESCAPE, MARKUP])),
    "script as unit": name(f"{SEGMENT}/q", "unit", SCRIPT),
    "script as version": name("versions", "gaitopt", SCRIPT + CLOSING),
}

FILES = {**NUMBERS, **STRUCTURES, **TEXTS}


def run_commands(file):
    """Run all commands on a file in the current folder; return the faults."""
    faults = []
    for command in COMMANDS:
        words, output = command.replace("FILE", file).split(), io.StringIO()
        print(command, file=sys.__stderr__, flush=True)  # the last one of a process that crashes or hangs
        try:
            with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
                main(words)
        except SystemExit as end:
            if end.code not in (0, 1, 2):
                faults.append(f"{command}: status {end.code}")
        except BaseException as error:
            faults.append(f"{command}: {type(error).__name__}: {str(error)[:200]}")
        if re.search(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202e]", output.getvalue()):
            faults.append(f"{command}: prints a control character")
    return faults


def watch(page, own, found):
    """Append what a page at the address `own` does that only a script of the file would do."""

    def note_request(request):
        if request.url != own and not request.url.startswith(("data:", "blob:")):
            found.append(f"request of {request.url}")

    def dismiss(dialog):
        found.append(f"dialog {dialog.message}")
        dialog.dismiss()

    page.on("dialog", dismiss)
    page.on("pageerror", lambda error: found.append(f"error {error}"))
    page.on("request", note_request)


def open_reports(pages):
    """Return the faults of reports in Chromium: scripts of the file that ran, and errors."""
    from playwright.sync_api import sync_playwright

    faults = {}
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        for label, path in pages.items():
            page, found = browser.new_page(), []
            watch(page, path.as_uri(), found)
            page.goto(path.as_uri())
            page.wait_for_timeout(300)
            if page.title() == "run":
                found.append("a script of the file ran")
            if found:
                faults[label] = found
            page.close()
        browser.close()
    return faults


def run_file(label, folder):
    """Write a hostile file, and run all commands on it in a separate process; return the faults."""
    shutil.copy(SOURCE, folder / "hostile.h5")
    with edit_hdf5(folder / "hostile.h5") as file:
        FILES[label](file)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "tests.hostile_files", "--work", "hostile.h5"],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            timeout=SECONDS,
        )
    except subprocess.TimeoutExpired as late:
        return [f"no end after {SECONDS:g} s: {(late.stderr or b'')[-60:]!r}"]
    if done.returncode:
        return [f"status {done.returncode}: {done.stderr[-300:]}"]
    return json.loads(done.stdout.splitlines()[-1])


def run(labels):
    """Run all commands on the files, print the faults, and return whether none occurred."""
    total, pages = 0, {}
    with tempfile.TemporaryDirectory() as top:
        for number, label in enumerate(labels):
            folder = Path(top) / str(number)
            folder.mkdir()
            faults = run_file(label, folder)
            if (folder / "page.html").exists():
                pages[label] = folder / "page.html"
            total += len(faults)
            print("\n  ".join([f"{label}: {len(faults)} faults", *faults]), flush=True)
        for label, faults in open_reports(pages).items():
            total += len(faults)
            print("\n  ".join([f"report of {label}", *faults]))
    print(f"{len(labels)} files through {len(COMMANDS)} commands, {len(pages)} reports in Chromium: {total} faults")
    return not total


if __name__ == "__main__":
    if sys.argv[1:2] == ["--work"]:
        print(json.dumps(run_commands(sys.argv[2])))
        sys.exit(0)
    sys.exit(0 if run(sys.argv[1:] or list(FILES)) else 1)
