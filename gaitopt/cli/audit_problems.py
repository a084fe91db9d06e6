"""Random problems of an audit: installed problem scripts with random settings."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.cli.installed_scripts import find_scripts_folder
from gaitopt.dataclass import dataclass

Range = tuple[float, float]


@dataclass(frozen=True)
class ScriptDraw:
    """Settings of a script that are drawn, and its share of the problems.

    Attributes
    ----------
    share : float
    ranges : mapping of str to (float, float)
        Bounds of the numbers.
    choices : mapping of str to tuple of str
    """

    share: float
    ranges: Mapping[str, Range]
    choices: Mapping[str, tuple[str, ...]]


_WALKER = ("stick | stick", "slip+ stick | slip+", "slip+ stick | stick", "stick slip- | stick")
_OBJECTIVES = ("cost_of_transport", "torque_squared", "positive_work", "torque_rate")

DRAWS: Mapping[str, ScriptDraw] = {
    "compass_slip": ScriptDraw(
        0.5,
        {
            "leg_length": (1.3, 1.9),
            "leg_com": (0.5, 1.1),
            "leg_mass": (2, 6),
            "hip_mass": (0.5, 8),
            "slope": (-2, 2),
            "friction": (0.08, 0.3),
            "speed": (0.4, 0.85),
            "step_length": (0.35, 0.6),
            "torque_limit": (5, 20),
        },
        {"sequence": _WALKER, "objective": _OBJECTIVES},
    ),
    "round_feet_slip": ScriptDraw(
        0.22,
        {
            "foot_radius": (0.1, 0.4),
            "leg_com": (0.5, 0.7),
            "leg_inertia": (0, 0.1),
            "friction": (0.04, 0.2),
            "speed": (0.6, 1.1),
            "step_length": (0.4, 0.6),
        },
        {"sequence": _WALKER[:2], "objective": _OBJECTIVES[:3]},
    ),
    "compass_with_torso": ScriptDraw(
        0.12, {"friction": (0.5, 1), "speed": (0.5, 0.9), "step_length": (0.3, 0.5), "lean": (0.2, 0.6)}, {}
    ),
    "five_link": ScriptDraw(
        0.04,
        {"friction": (0.15, 0.6), "speed": (0.5, 0.8), "step_length": (0.3, 0.45), "torque_limit": (25, 50)},
        {"sequence": _WALKER[:2]},
    ),
    "compass_double_support": ScriptDraw(
        0.06, {"friction": (0.3, 0.6), "speed": (0.2, 0.35), "step_length": (0.4, 0.5)}, {}
    ),
    "monopod": ScriptDraw(
        0.04, {"friction": (0.6, 1.2), "speed": (1.2, 1.8), "step_length": (0.5, 0.7), "stiffness": (2500, 4000)}, {}
    ),
    "telescoping_biped": ScriptDraw(0.015, {"speed": (0.4, 0.6), "step_length": (0.35, 0.45)}, {}),
    "flat_foot": ScriptDraw(0.005, {"friction": (0.8, 1.2), "speed": (0.45, 0.55), "step_length": (0.38, 0.42)}, {}),
}
"""Scripts by name; the shares add up to one."""


DRAWS_WITH_IMPULSES: Mapping[str, ScriptDraw] = {
    "telescoping_biped": ScriptDraw(
        1.0,
        {
            "speed": (0.4, 0.6),
            "step_length": (0.35, 0.45),
            "impulse_limit": (0.05, 0.25),
            "foot_mass": (5e-4, 2e-3),
            "body_mass": (0.8, 1.2),
        },
        {},
    ),
}
"""Scripts whose gaits have impulses of actuators, drawn by another option, so that the numbers of `DRAWS` remain."""


def draw_settings(seed: int, number: int, draws: Mapping[str, ScriptDraw] = DRAWS) -> tuple[str, tuple[str, ...]]:
    """Return the script of a problem and its settings ``NAME=VALUE``, with which ``gaitopt solve`` repeats it.

    Parameters
    ----------
    seed, number : int
    draws : mapping of str to ScriptDraw

    Examples
    --------
    >>> script, settings = draw_settings(18, 0)
    >>> script in DRAWS, settings == draw_settings(18, 0)[1]
    (True, True)
    """
    rng = np.random.default_rng([seed, number])
    name = str(rng.choice(list(draws), p=[draw.share for draw in draws.values()]))
    draw = draws[name]
    settings = [f"{key}={rng.uniform(*bounds):.6g}" for key, bounds in draw.ranges.items()]
    settings += [f"{key}={rng.choice(values)}" for key, values in draw.choices.items()]
    return name, tuple(settings)


def audit_number(shared: tuple[int, int | None, bool], number: int) -> dict[str, Any]:
    """Return the result of a problem of an audit.

    Parameters
    ----------
    shared : (int, int or None, bool)
        Seed, number of starts of a further solve, and whether the problems have impulses of actuators.
    number : int
    """
    from gaitopt.cli.script import call_script
    from gaitopt.study.audit.audited_problem import audit_problem

    seed, starts, impulses = shared
    name, settings = draw_settings(seed, number, DRAWS_WITH_IMPULSES if impulses else DRAWS)
    problem = call_script(_script(name), list(settings))
    return {"script": name, "settings": list(settings)} | audit_problem(problem, starts=starts)


def _script(name: str) -> Path:
    return find_scripts_folder() / f"{name}.py"
