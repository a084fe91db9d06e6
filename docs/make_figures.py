"""Draw the figures of the how-to guides and of the first page, from the scripts in problems and docs/examples.

``python docs/make_figures.py`` draws all of them, which takes some minutes; ``python docs/make_figures.py cascade
compass_design`` draws some of them.  The figures of studies are drawn by ``docs/make_reproduction.py``.
"""

import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from draw_frame import draw_frame
from make_gallery import reduce_colors
from PIL import Image
from scipy.interpolate import RectBivariateSpline

from gaitopt import (
    FigureStyle,
    basin,
    compare,
    find_cycles,
    load,
    plot_branches,
    plot_gait,
    save_figure,
    search,
    solve,
    sweep,
    trace,
    verify,
)
from gaitopt.cli.script import call_script
from gaitopt.continuation import OptimumOptions, TraceOptions, trace_optimum
from gaitopt.ocp import solve_steps
from gaitopt.plot import plot_basin, plot_comparison, plot_optima, plot_result
from gaitopt.plot.style import line_style
from gaitopt.study import load_robustness

DOCS = Path(__file__).resolve().parent
PROBLEMS = DOCS.parent / "problems"
LEVELS = (2.5, 2.75, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0)
LABELS = ((0.84, 2.58), (0.79, 2.5), (0.765, 2.25), (0.725, 2.0), (0.69, 1.75), (0.645, 1.6), (0.61, 1.45), (0.55, 1.3))
"""Levels of the squared torques [N^2 m^2 s], and places of their labels on the lines."""


def main(names):
    """Draw the figures of the given names, or all."""
    for name in names or FIGURES:
        path = DOCS / "images" / f"{name}.png"
        save_figure(FIGURES[name](), path)
        reduce_colors(Image.open(path), 192).save(path, optimize=True)
        print(path.name, flush=True)


def draw_gait(script):
    """Return the figure of the gait of a script."""
    return plot_gait(verify(solve(call_script(PROBLEMS / f"{script}.py", []))))


def draw_rough_floor():
    """Return the figure of steps over a rough floor, without title."""
    gait = solve_steps(call_script(PROBLEMS / "studies" / "compass_rough_floor.py", []))
    return plot_result(gait, style=FigureStyle(titled=False))


def draw_optima():
    """Return the costs of the optimal gaits of two contact sequences over friction."""
    problem = call_script(PROBLEMS / "compass_optima.py", [])
    options = OptimumOptions(points=100, sequences=("slip+ stick | slip+",))
    return plot_optima(trace_optimum(problem, {"friction": (0.1, 0.25)}, options=options))


def draw_cascade():
    """Return the branches of period doublings of the compass of Goswami et al. over the slope."""
    settings = ["leg_mass=5", "hip_mass=10", "leg_length=1", "leg_com=0.5", "gravity=9.81"]
    problem = call_script(PROBLEMS / "compass_passive.py", settings)
    ends = {"slope": (math.radians(3), math.radians(5.2))}
    return plot_branches(trace(problem, ends, options=TraceOptions(doublings=4)))


def draw_design():
    """Return the contour lines of the cost of gaits over two parameters, and the optimum over both."""
    problem = call_script(PROBLEMS / "compass_design.py", [])
    best = solve(problem).design
    fixed = problem.replace(free={})
    table = sweep(fixed, {"leg_com": np.linspace(0.5, 1.0, 11), "hip_mass": np.linspace(1.0, 3.0, 11)}, starts=1)
    com, mass, cost = table.leg_com.values, table.hip_mass.values, table.objective.squeeze("sequence").values
    across, upward = np.linspace(com[0], com[-1], 201), np.linspace(mass[0], mass[-1], 201)
    style = FigureStyle()
    with style.figure(3.0) as figure:
        axes = figure.add_subplot()
        smooth = RectBivariateSpline(com, mass, cost)(across, upward).T
        lines = axes.contour(across, upward, smooth, levels=LEVELS, colors="0.35", linewidths=1.0)
        axes.clabel(lines, fmt="%g", fontsize=style.font_size - 0.5, manual=LABELS)
        mark = {"linestyle": "none", "clip_on": False, "zorder": 5}
        optimum = line_style(1)["color"]
        axes.plot(best["leg_com"], best["hip_mass"], "*", markersize=12, color=optimum, label="optimum", **mark)
        defaults = {parameter.name: parameter.default for parameter in problem.robot.parameters}
        axes.plot(defaults["leg_com"], defaults["hip_mass"], "ko", markersize=5, label="default parameters", **mark)
        axes.plot([], [], color="0.35", linewidth=1.0, label="torque squared [N$^{2}$ m$^{2}$ s]")
        axes.set(xlabel="distance of the centre of mass of a leg from its foot [m]", ylabel="hip mass [kg]")
        figure.legend(loc="outside upper left", ncols=3)
    return figure


def draw_ranking():
    """Return the ranking of the contact sequences of at most two phases of the compass biped."""
    problem = call_script(PROBLEMS / "compass_slip.py", [])
    return plot_result(search(problem, max_phases=2, starts=1))


def draw_push_tests():
    """Return the largest disturbances that a gait survives under two laws with their default gains."""
    tests = {}
    with tempfile.TemporaryDirectory() as folder:
        for law in ("lqr", "computed_torque"):
            path = Path(folder) / f"{law}.json"
            command = [sys.executable, "-m", "gaitopt", "push", DOCS / "examples" / "compass_slip.h5", "--law", law]
            subprocess.run([*command, "-o", path, "--quiet"], check=True)
            tests[law] = load_robustness(path)
    return plot_result(tests)


def draw_basin():
    """Return the basin of the gait of the passive compass biped over the rates of both legs after touchdown."""
    walk = call_script(PROBLEMS / "compass_passive.py", ["friction=0.2"])
    gait = min(find_cycles(walk.robot, walk.parameters), key=lambda cycle: cycle.radius)
    rates = {"th1_rate": np.linspace(0.3, 1.0, 141), "th2_rate": np.linspace(-1.5, 2.0, 141)}
    return plot_basin(basin(walk.robot, {**walk.parameters, "th1": gait.state["th1"]}, rates))


def draw_objectives():
    """Return the comparison of the gaits of the compass biped that minimise two objectives."""
    problem = call_script(PROBLEMS / "compass_slip.py", [])
    objectives = {"cost of transport": "cost_of_transport", "squared torques": "torque_squared"}
    return plot_comparison(
        compare({label: solve(problem.replace(objective=name)) for label, name in objectives.items()})
    )


def draw_custom_branch():
    """Return the branch of the walker in the first script of the page on walks of custom robots."""
    page = (DOCS / "howto" / "custom_robot_walks.md").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "walker.py"
        script.write_text(re.search(r"```python\n(.*?)```", page, re.DOTALL)[1], encoding="utf-8")
        ends = {"slope": (math.radians(1), math.radians(6))}
        return plot_branches(trace(call_script(script, []), ends, options=TraceOptions(starts=4)))


FIGURES = {
    "compass_slip": lambda: draw_gait("compass_slip"),
    "five_link": lambda: draw_gait("five_link"),
    "compass_double_support": lambda: draw_gait("compass_double_support"),
    "round_feet": lambda: draw_gait("round_feet_slip"),
    "heel_toe": lambda: plot_gait(load(DOCS / "examples" / "heel_toe.h5")),
    "compass_rough_floor": draw_rough_floor,
    "optima_over_friction": draw_optima,
    "cascade": draw_cascade,
    "compass_design": draw_design,
    "ranking": draw_ranking,
    "push_tests": draw_push_tests,
    "frame": draw_frame,
    "compass_basin": draw_basin,
    "objectives": draw_objectives,
    "custom_branch": draw_custom_branch,
}
"""Functions that return the figures, by the names of their images."""


if __name__ == "__main__":
    main(sys.argv[1:])
