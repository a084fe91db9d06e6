"""The matrix of the catalogue: what works for each robot, as a page of the documentation.

``python -m tests.matrix`` runs every problem script and writes docs/catalogue.md; ``python -m tests.matrix monopod
hopper`` prints the rows of some scripts only.  A column that fails contains the reason.
"""

import importlib
import inspect
import itertools
import pkgutil
import sys
import tempfile
import time
from pathlib import Path

import attrs
import numpy as np

from gaitopt import solve, verify, write_report
from gaitopt.cli.script import read_script
from gaitopt.control import feedforward, passive, planar_feedforward
from gaitopt.errors import GaitoptError
from gaitopt.model import check_planar, check_robot, robots
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.ocp import GaitProblem, PlanarProblem, solve_planar
from gaitopt.plot import animate
from gaitopt.simulation import verify_planar
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.stability import assess_planar, assess_stability
from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section
from gaitopt.stability.walk_problem import WalkProblem
from gaitopt.tuning import lqr, planar_lqr, planar_step_lqr
from tests.stability.difference_quotients import map_differences, planar_differences

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "catalogue.md"
COLUMNS = ("script", "robot", "check", "gait", "replay", "multipliers", "law that stabilises it", "report", "animation")
CLEARANCE, IMPULSE = 1e-2, 0.05
"""Clearance of the swing foot [m] and impulse of the trailing foot [N s] of a gait that feedback can stabilise."""

STEPS = (1e-6, 1e-7, 1e-8)
"""Steps of the differences, each a tenth of the one before."""

HEAD = """# Catalogue

Results of the checks of each problem script and its robot. `python -m tests.matrix` writes this page by running every
script in `problems`. The columns contain:

- *check*: `check_robot` or `check_planar` of the robot.
- *gait*: the optimal gait; for a passive robot, the periodic gait that is found first, or, with one foot on the ground
  at a time, the one of smallest spectral radius.
- *replay*: largest error of the state (SI units) after a step in the simulator under the planned torques (at most
  1e-6); for a passive gait, the change of the state over a period.
- *multipliers*: largest difference of the return map's exact derivative from central differences, relative to the
  largest entry (at most 1e-5), and the spectral radius; both in open loop, or under feedback if the open loop magnifies
  rounding errors too much for central differences. The smallest difference is given, over the steps 1e-6, 1e-7 and 1e-8
  of the central differences and over linear extrapolations from two of them to a step of zero: if the force of a foot
  vanishes at lift-off, second derivatives jump, and the error of a central difference is proportional to its step.
- *law that stabilises it*: the feedback, and the spectral radius with it.
- *report*, *animation*: whether `gaitopt report` and `gaitopt animate` write their files.

If a gait of a robot with several contacts grazes the ground, it is planned again with a foot clearance of {clearance:g}
m and impulses of at least {impulse:g} N s at the contacts that an impact leaves closed; the cell then contains "planned
with clearance and impulse".

{table}

The built-in robots without a script are checked only: {others}.
"""


def scripts():
    """Return the problem scripts by name."""
    return {path.stem: path for path in sorted((ROOT / "problems").glob("*.py"))}


def catalogue():
    """Return every robot of the catalogue by the name of its function."""
    found = {}
    for entry in pkgutil.iter_modules(robots.__path__):
        module = importlib.import_module(f"{robots.__name__}.{entry.name}")
        for name, value in vars(module).items():
            if callable(value) and value.__module__ == module.__name__:
                signature = inspect.signature(value)
                optional = all(each.default is not each.empty for each in signature.parameters.values())
                if optional and signature.return_annotation in (Robot, PlanarRobot):
                    found[name] = value()
    return found


def problem_of(path):
    """Return the problem of a script."""
    problem = read_script(path, None)()
    return getattr(problem, "problem", problem)  # of a RobustProblem


def attempt(function, *arguments):
    """Return the text of a cell, or the first sentence of the reason why it fails."""
    try:
        return function(*arguments)
    except (GaitoptError, AttributeError, TypeError, ValueError, NotImplementedError) as error:
        return f"no: {str(error).split('. ')[0].splitlines()[0][:70]}"


def check(robot):
    """Return the cell of the check of a robot."""
    report = check_planar(robot) if isinstance(robot, PlanarRobot) else check_robot(robot)
    return "passed" if report.passed else f"no: {report}"


LAWS = {"step-to-step LQR": planar_step_lqr, "LQR": planar_lqr}
"""Feedback of a robot with several contacts, in the order in which it is tried."""


def relative_error(found, exact):
    """Return the largest difference relative to the largest entry."""
    return float(np.max(np.abs(found - exact)) / max(1.0, np.max(np.abs(exact))))


def describe_multipliers(errors, radius):
    """Return the cell of the multipliers."""
    error = min(errors)
    verdict = "" if error <= 1e-5 else "no: "
    return f"{verdict}{error:.0e}; radius {radius:.3g}"


def planar_row(problem):
    """Return the cells of an optimal gait of a robot with several contacts."""
    gait = verify_planar(solve_planar(problem))
    yield f"{gait.status.key}, {gait.sequence}"
    yield replay_text(gait)
    yield attempt(first_of, planar_multipliers, problem, gait)
    yield attempt(first_of, planar_law, problem, gait)
    yield from pictures(gait)


def first_of(cell, problem, gait):
    """Return the cell of a gait, or that of the gait planned with more clearance and impulse."""
    text = attempt(cell, gait)
    if not text.startswith("no: "):
        return text
    again = attempt(cell, plan_clear(problem))
    return text if again.startswith("no: ") else f"{again} (planned with clearance and impulse)"


def planar_multipliers(gait, law=None):
    """Return the cell of the multipliers of a gait under a law, by default in open loop."""
    law = law or planar_feedforward(gait)
    cycle = assess_planar(gait, law)
    found = [planar_differences(gait.robot, cycle, law, step) for step in STEPS]
    found += [(10 * fine - coarse) / 9 for coarse, fine in itertools.pairwise(found)]
    return describe_multipliers([relative_error(each, cycle.derivative) for each in found], cycle.radius)


def planar_law(gait):
    """Return the cell of the feedback of a gait."""
    cells = []
    for name, design in LAWS.items():
        cell = attempt(lambda design=design: planar_multipliers(gait, design(gait)))
        if cell.startswith("no: "):
            cells.append(cell)
            continue
        radius = float(cell.rpartition(" ")[2])
        if radius < 1:
            return f"{name}, {radius:.3g}"
        cells.append(f"no: {cell}")
    return cells[-1]


def plan_clear(problem):
    """Return the gait with more clearance, and with an impulse of every foot that stays on the ground."""
    limits = attrs.evolve(
        problem.limits, clearance=max(problem.limits.clearance, CLEARANCE), impulse=max(problem.limits.impulse, IMPULSE)
    )
    return solve_planar(problem.replace(limits=limits))


def passive_row(problem):
    """Return the cells of a periodic gait of a robot with several contacts."""
    cycle = next(problem.search(4), None)
    if cycle is None:
        yield from ["no: no periodic gait found"] * 6
        return
    yield f"periodic, {cycle.sequence}"
    yield f"{cycle.residual:.0e}"
    robot = problem.robot
    errors = [relative_error(planar_differences(robot, cycle, problem.torque, s), cycle.derivative) for s in STEPS]
    yield describe_multipliers(errors, cycle.radius)
    yield "stable without feedback" if cycle.stable else f"no: radius {cycle.radius:.3g}"
    yield from pictures(cycle)


def single_row(problem):
    """Return the cells of an optimal gait in single support."""
    gait = verify(solve(problem))
    yield f"{gait.status.key}, {gait.sequence}"
    yield replay_text(gait)
    yield attempt(single_gait_multipliers, gait)
    yield attempt(lambda: f"LQR, {assess_stability(gait, lqr(gait.robot, gait.motion)).radius:.3g}")
    yield from pictures(gait)


def single_gait_multipliers(gait):
    """Return the cell of the multipliers of a gait: in open loop, or under feedback if open loop magnifies rounding."""
    robot = gait.robot
    cell = single_multipliers(assess_stability(gait), robot, feedforward(robot, gait.motion))
    if cell.startswith("no: "):
        law = lqr(robot, gait.motion)
        cell = f"{single_multipliers(assess_stability(gait, law), robot, law)} (under LQR)"
    return cell


def single_multipliers(cycle, robot, law):
    """Return the cell of the multipliers of a gait in single support."""
    walker = make_walker(robot, law, cycle.parameters, period=cycle.period)
    section = Section(robot, walker.p, sliding=True)
    if len(section.names) != len(cycle.z):
        section = Section(robot, walker.p, sliding=False)
    return_map = ReturnMap(walker, section)
    exact = return_map.derivative(cycle.z, return_map(cycle.z))
    errors = [relative_error(map_differences(return_map, cycle.z, step), exact) for step in STEPS]
    return describe_multipliers(errors, cycle.radius)


def walk_row(problem):
    """Return the cells of a periodic gait in single support."""
    from gaitopt import find_cycles

    cycles = find_cycles(problem.robot, problem.parameters, law=problem.law)
    if not cycles:
        yield from ["no: no periodic gait found"] * 6
        return
    cycle = min(cycles, key=lambda each: each.radius)
    yield f"periodic, {cycle.sequences[0]}"
    yield f"{cycle.residual:.0e}"
    yield attempt(lambda: single_multipliers(cycle, problem.robot, problem.law or passive(problem.robot)))
    yield "stable without feedback" if cycle.stable else f"no: radius {cycle.radius:.3g}"
    yield from pictures(cycle)


def replay_text(gait):
    """Return the cell of the replay of a gait."""
    result = gait.verification
    if result is None:
        return "no: not solved"
    return f"{result.state_error:.0e}" if result.passed else f"no: {result.reasons[0][:100]}"


def pictures(subject):
    """Return the cells of report and animation."""
    with tempfile.TemporaryDirectory() as folder:
        yield attempt(lambda: bool(write_report({"gait": subject}, Path(folder) / "a.html")) and "written")
        yield attempt(lambda: bool(animate(subject, Path(folder) / "a.gif", steps=1, fps=5)) and "written")


ROWS = {
    PlanarProblem: planar_row,
    PlanarWalkProblem: passive_row,
    GaitProblem: single_row,
    WalkProblem: walk_row,
}


def row(name, path):
    """Return the cells of a script."""
    problem = attempt(problem_of, path)
    if isinstance(problem, str):
        return [name, "", problem, *[""] * 6]
    make = next(function for kind, function in ROWS.items() if isinstance(problem, kind))
    cells = attempt(lambda: list(make(problem)))
    cells = [cells, *[""] * 5] if isinstance(cells, str) else cells
    return [name, problem.robot.name, attempt(check, problem.robot), *cells]


def main(names):
    """Write the page, or print the rows of some scripts."""
    chosen = {name: path for name, path in scripts().items() if not names or name in names}
    table = [COLUMNS, ["---"] * len(COLUMNS)]
    for name, path in chosen.items():
        started = time.process_time()
        table.append(row(name, path))
        print(" | ".join(table[-1]), f"({time.process_time() - started:.0f} s)", flush=True)
    shown = {cells[1] for cells in table[2:]}
    others = {name: robot for name, robot in catalogue().items() if robot.name not in shown}
    checked = ", ".join(f"`{name}` ({attempt(check, robot)})" for name, robot in others.items())
    if not names:
        text = "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |" for cells in table)
        PAGE.write_text(HEAD.format(table=text, others=checked, clearance=CLEARANCE, impulse=IMPULSE), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
