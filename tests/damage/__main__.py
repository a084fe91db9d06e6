"""Read damaged files by ``python -m tests.damage [COUNT]`` and report what happened.

A child process reads the files; if it ends or does not return within TIME_LIMIT, another one continues after the file.
"""

import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from queue import Empty, Queue
from threading import Thread

import numpy as np

from gaitopt import basin, load, load_diagram, rimless_wheel, save
from gaitopt.continuation.diagram_file import save_diagram
from tests.damage.damaged_files import damage, read_damaged

TIME_LIMIT = 60.0

ROOT = Path(__file__).parents[2]


def write_sources(folder):
    """Write one file of each kind."""
    save(load(ROOT / "docs/examples/compass_slip.h5"), folder / "gait-walker.h5")
    save(load(ROOT / "tests/problems/bounding_quadruped.h5"), folder / "gait-quadruped.h5")
    save_diagram(load_diagram(ROOT / "docs/examples/compass_slope.nc"), folder / "diagram-slope.nc")
    basin(rimless_wheel(), {"slope": 0.23}, {"theta_rate": [0.1, 1.0, 2.0]}, path=folder / "basin-wheel.nc")


def work(folder, first, count):
    """Print the result of each damaged file."""
    sources = sorted(folder.glob("*-*.*"))
    contents = {source: source.read_bytes() for source in sources}
    for number in range(first, count):
        rng = np.random.default_rng([20260801, number])
        source = sources[number % len(sources)]
        original = contents[source]
        path = folder / f"damaged{source.suffix}"
        try:
            result = read_damaged(source.name.partition("-")[0], damage(original, rng), original, path)
        except Exception as error:
            result = f"traceback {type(error).__name__}"
        print(number, result, flush=True)


def run(count):
    """Return the number of files by what happened."""
    results = Counter()
    with tempfile.TemporaryDirectory() as name:
        folder, number = Path(name), 0
        write_sources(folder)
        while number < count:
            command = [sys.executable, "-m", "tests.damage", "--work", name, str(number), str(count)]
            with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as child:
                lines = Queue()
                Thread(target=_forward, args=(child.stdout, lines), daemon=True).start()
                number = _collect(lines, results, number, count)
                child.kill()
    return results


def _forward(stream, lines):
    for line in stream:
        lines.put(line)
    lines.put(None)


def _collect(lines, results, number, count):
    """Count results until the child ends; return the number of the next file."""
    while number < count:
        try:
            line = lines.get(timeout=TIME_LIMIT)
        except Empty:
            results["hang"] += 1
            return number + 1
        if line is None:
            results["crash"] += 1
            return number + 1
        results[line.split(maxsplit=1)[1].strip()] += 1
        number += 1
    return number


if __name__ == "__main__":
    if sys.argv[1:2] == ["--work"]:
        work(Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]))
    else:
        found = run(int(sys.argv[1]) if len(sys.argv) > 1 else 3000)
        print(", ".join(f"{count} {result}" for result, count in found.most_common()))
        sys.exit(0 if set(found) <= {"refused", "unchanged"} else 1)
