"""Problems of several steps as mathematics."""

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from gaitopt.model.formulation import Formula, Formulation, assign, bound, collect
from gaitopt.motion.printable import format_count
from gaitopt.ocp.statement.member_formulation import OBJECTIVE, formulate_members, state_in_words

if TYPE_CHECKING:
    from gaitopt.model.terrain import Terrain
    from gaitopt.ocp.multistep.multistep_problem import MultiStepProblem


def formulate_steps(stated: "MultiStepProblem") -> Formulation:
    """Return the sum of the objectives, the first step, what differs in the others, and how the walk begins and ends.

    Examples
    --------
    >>> from gaitopt import GaitProblem, compass_biped
    >>> from gaitopt.ocp import MultiStepProblem
    >>> step = GaitProblem(robot=compass_biped(), sequence="stick | stick", friction=0.3)
    >>> problem = MultiStepProblem(steps=(step, step), start={"th1_rate": 0.0}, end={}, footholds={1: (0.4, 0.5)})
    >>> print(Formulation("Ends", formulate_steps(problem).formulas[-4:]))
    Ends
      next step  a step begins with its touchdown, whose impact is that of its sequence
      start      after touchdown: th1_rate = 0 rad/s
      end        free
      footholds  0.4 ≤ x(step 2) ≤ 0.5 m
    """
    numbers = range(1, len(stated.steps) + 1)
    costs = " + ".join(f"J{number}" for number in numbers), " + ".join(f"J_{{{number}}}" for number in numbers)
    lines = [Formula(OBJECTIVE, *costs), *formulate_members(stated.steps, "step", omit=("next step",))]
    order = "a step begins with its touchdown, whose impact is that of its sequence"
    again = "; step 1 follows the last step" if stated.periodic else ""
    lines.append(state_in_words("next step", f"{order}{again}"))
    ends = ("start", stated.start), ("end", stated.end)
    lines += [_formulate_state(label, state) for label, state in ends if state is not None]
    lines += collect("footholds", (_bound_foothold(*place) for place in stated.footholds.items()))
    ground = [] if stated.terrain is None else _list_ground(stated.terrain)
    lines += [state_in_words("" if place else "terrain", text) for place, text in enumerate(ground)]
    title = f"Gait of {format_count(len(stated.steps), 'step')} of {stated.robot.name}"
    return Formulation(title, tuple(lines))


def _bound_foothold(number: int, ends: tuple[float, float]) -> tuple[str, str] | None:
    """Return the bounds of the position of a foot; steps are counted from 1, as in the lines of the steps."""
    return bound(f"x(step {number + 1})", *ends, "m", rf"x_{{\text{{step {number + 1}}}}}")


def _formulate_state(label: str, state: Mapping[str, float]) -> Formula:
    """Return the known coordinates of the state after the first or the last touchdown."""
    if not state:
        return state_in_words(label, "free")
    known = [assign(name, value, _unit(name)) for name, value in state.items()]
    texts, symbols = zip(*known, strict=True)
    return Formula(label, f"after touchdown: {', '.join(texts)}", r"\text{after touchdown: }" + r",\ ".join(symbols))


def _unit(name: str) -> str:
    """Return the unit of a coordinate of a state after touchdown."""
    return "m/s" if name == "foot_speed" else "rad/s" if name.endswith("_rate") else "rad"


def _list_ground(terrain: "Terrain") -> Iterable[str]:
    """Yield the steps, ramps and patches of a terrain in words."""
    for place, rise in terrain.steps:
        yield f"step of {rise:g} m at {place:g} m"
    for begin, end, rise in terrain.ramps:
        grade = math.degrees(math.atan2(rise, end - begin))
        yield f"ramp of {rise:g} m from {begin:g} m to {end:g} m ({grade:.3g} deg)"
    for begin, end, friction in terrain.patches:
        yield f"friction {friction:g} from {begin:g} m to {end:g} m"
