"""Memory and open files of one process over many different solves: ``python -m tests.long_life [COUNT]``.

Every solve has another structure; each tenth one is also simulated under a feedback law, and each fiftieth one is
drawn, reported and animated.  The command prints the resident memory and the number of open files, and fails if the
memory after the last solve exceeds that after the first 100 by more than half, or a file stays open.
"""

import os
import sys
import tempfile
import time
from pathlib import Path

from gaitopt import (
    Collocation,
    GaitProblem,
    Limits,
    MultipleShooting,
    compass_biped,
    joint_pd,
    plot_gait,
    save,
    simulate,
    solve,
    write_report,
)
from gaitopt.plot import animate

FIRST, LARGEST_RATIO = 100, 1.5
"""Number of solves after which the memory is compared, and the largest ratio."""

SEQUENCES = ("stick | stick", "slip+ stick | slip+", "slip+ stick | stick", "stick slip- | stick")
OBJECTIVES = ("torque_squared", "torque_rate", "cost_of_transport", "positive_work")


def draw_problem(number):
    """Return a problem whose NLP differs from those of all other numbers."""
    intervals = 6 + number // 64 % 16  # 4 sequences, 4 objectives, 4 methods, 16 grids
    points = number // 16 % 4
    grid = {"intervals": intervals, "tolerance": float("inf")}
    return GaitProblem(
        robot=compass_biped(),
        sequence=SEQUENCES[number % 4],
        objective=OBJECTIVES[number // 4 % 4],
        friction=0.14,
        speed=0.633,
        step_length=0.4713,
        limits=Limits(torque=10),
        transcription=Collocation(points=2 + points, **grid) if points else MultipleShooting(**grid),
    )


def use(number, folder):
    """Solve a problem, and use its gait."""
    gait = solve(draw_problem(number), starts=1)
    motion = gait.motion
    if number % 10 == 0 and gait.status.ok:
        law = joint_pd(gait.robot, motion, torque_limit=10 + number)
        first = motion.segments[0]
        simulate(gait.robot, first.q[:, 0], first.v[:, 0], motion.parameters, law=law)
        save(gait, folder / "gait.h5")
    if number % 50 == 0:
        import matplotlib.pyplot as plt

        figure = plot_gait(gait)
        figure.savefig(folder / "gait.png")
        plt.close(figure)
        write_report({"gait": gait}, folder / "gait.html")
        animate(gait, folder / "gait.gif", steps=1, slow=1)


def resident_memory():
    """Return the resident memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def open_files():
    """Return the number of open files of this process."""
    return sum(1 for _ in Path("/proc/self/fd").iterdir())


def live(count, report=print):
    """Return the memory after the first solves and after the last [MB], and the largest number of open files after."""
    first, files, most = resident_memory(), 0, 0
    with tempfile.TemporaryDirectory() as name:
        for number in range(count):
            use(number, Path(name))
            if number + 1 == min(FIRST, count):
                first, files = resident_memory(), open_files()
            if number >= FIRST:
                most = max(most, open_files())
            if (number + 1) % 50 == 0:
                report(f"{number + 1} solves: {resident_memory():.0f} MB, {open_files()} open files", flush=True)
    return first, resident_memory(), files, most


if __name__ == "__main__":
    began = time.process_time()
    first, last, files, most = live(int(sys.argv[1]) if sys.argv[1:] else 1000)
    print(f"{first:.0f} MB, then {last:.0f} MB ({last / first:.2f} times); {files} open files, then at most {most}")
    print(f"{time.process_time() - began:.0f} s of processor time")
    sys.exit(0 if last <= LARGEST_RATIO * first and most <= files + 2 else 1)
