"""Basins along a branch: endings of walks from a ball around each gait, and the distance to the basin's edge."""

import json
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.continuation.branch_diagram import BranchDiagram
from gaitopt.continuation.gait_lookup import gaits_at
from gaitopt.continuation.gait_source import AnyCycle
from gaitopt.control.law import passive
from gaitopt.errors import InputError
from gaitopt.motion.motion import Array
from gaitopt.motion.versions import versions
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.recovery import PushTest, draw_pushes
from gaitopt.stability.section import Section
from gaitopt.stability.walk_problem import WalkProblem
from gaitopt.study.basins.attractor import WalkEnding, classify_walk
from gaitopt.study.basins.fatal_push import FatalPush, PushSearch, find_fatal_push, find_push_limits

if TYPE_CHECKING:
    import xarray as xr

KIND, VERSION, SIDES = "set of basins along a branch", 1, ("backward", "forward")
VARIABLES = {"share", "stable", "push", "change", "edge", "push_ending", "ending", "coordinate", "side"}

SAME = 1e-3
"""Largest difference of the last point of a walk from a gait to which it converged."""


class _BasinPoint(NamedTuple):
    """Result at one value of the parameter."""

    value: float
    cycle: Cycle
    endings: Counter[str]
    push: FatalPush | None
    edges: Array


@check_arguments
def trace_basin(
    problem: WalkProblem,
    diagram: BranchDiagram,
    values: Sequence[float] | Array,
    *,
    branch: int = 0,
    balls: PushTest | None = None,
    radius: float = 0.3,
    search: PushSearch | None = None,
    engine: Engine | None = None,
) -> "xr.Dataset":
    """Return the endings of walks from a ball around the gaits of a branch, and their smallest fatal pushes.

    Parameters
    ----------
    problem : WalkProblem
        The problem whose diagram it is.
    diagram : BranchDiagram
    values : sequence of float
        Values of the parameter; those at which the branch has no gait are skipped.
    branch : int
        Number of the branch, of gaits of one step.
    balls : PushTest, optional
        Number of starts and seed.
    radius : float [rad/s]
        Radius of the ball, as that of :class:`gaitopt.stability.Recovery`.
    search : PushSearch, optional
        Search for the smallest fatal push; the direction of each gait is the first guess of the next one.
    engine : Engine, optional

    Returns
    -------
    xarray.Dataset
        Over the parameter: ``share`` of the starts with each ``ending``, a gait of the diagram being called
        ``branch 0 (stick | stick)``; ``stable``; ``push``, the size of the smallest fatal push [rad/s], nan if the
        gait is unstable; ``change``, the change of each ``coordinate`` by it, and ``push_ending``; ``edge``, the sizes
        of the smallest fatal pushes along each coordinate, backward and forward.

    Raises
    ------
    InputError
        If the branch does not exist, has gaits of several steps, or has no gait at any of the values, or if the radius
        is invalid.

    Examples
    --------
    >>> import math
    >>> from gaitopt import WalkProblem, rimless_wheel, trace
    >>> wheel = WalkProblem(robot=rimless_wheel(), parameters={"slope": math.radians(13)})
    >>> diagram = trace(wheel, {"friction": (1.0, 0.95)})
    >>> table = trace_basin(wheel, diagram, [1.0], balls=PushTest(starts=4),
    ...                            search=PushSearch(directions=1, refinements=1))
    >>> table.ending.values.tolist(), table.share.values.tolist()
    (['branch 0 (stick | stick)'], [[1.0]])
    """
    if not 0 <= branch < len(diagram.branches) or diagram.branches[branch].steps > 1:
        raise InputError(f"The diagram must have a branch {branch} of gaits of one step.")
    if not 0 < radius < math.inf:
        raise InputError(f"The radius of the ball must be positive and finite, got {radius!r} rad/s.")
    measure = _measure_with(problem, diagram, branch, balls or PushTest(), radius, search or PushSearch(), engine)
    points, previous = list[_BasinPoint](), None
    for value in values:
        point = measure(float(value), previous)
        if point is None:
            continue
        points.append(point)
        previous = previous if point.push is None else point
    if not points:
        raise InputError(f"Branch {branch} has no gait at any of the {len(values)} values of {diagram.parameter}.")
    return _make_dataset(diagram, points)


def _measure_with(
    problem: WalkProblem,
    diagram: BranchDiagram,
    branch: int,
    balls: PushTest,
    radius: float,
    search: PushSearch,
    engine: Engine | None,
) -> Callable[[float, _BasinPoint | None], _BasinPoint | None]:
    """Return the function that computes the result at one value, from that for the stable gait before it."""
    robot, law = problem.robot, problem.law or passive(problem.robot)
    engine = engine or default_engine(law, robot)

    def measure(value: float, previous: _BasinPoint | None) -> _BasinPoint | None:
        gaits = {
            number: gaits_at(problem, diagram, value, branch=number, engine=engine)
            for number in range(len(diagram.branches))
        }
        cycle = next((gait for gait in gaits[branch] if isinstance(gait, Cycle)), None)
        if cycle is None:
            return None
        walker = Walker(robot, law, robot.vector(robot.resolve(cycle.parameters)), engine)
        section = Section(robot, walker.p, sliding=True)
        endings = Counter[str]()
        for push in draw_pushes(walker.robot, walker.p, cycle.section, balls):
            z = section.project(cycle.section.embed(cycle.z + radius * push))
            endings[_name_ending(classify_walk(walker, z), gaits, section)] += 1
        if not cycle.stable:
            return _BasinPoint(value, cycle, endings, None, np.full((cycle.z.size, 2), np.nan))
        edges = find_push_limits(walker, cycle, search, near=None if previous is None else previous.edges)
        change = {} if previous is None or previous.push is None else previous.push.change
        guesses = [np.array([*change.values()])] if len(change) == cycle.z.size else []
        return _BasinPoint(value, cycle, endings, find_fatal_push(walker, cycle, search, guesses=guesses), edges)

    return measure


def _name_ending(ending: WalkEnding, gaits: Mapping[int, tuple[AnyCycle, ...]], section: Section) -> str:
    """Return the branch of the gait to which a walk converged, or the label of its ending."""
    for number, cycles in gaits.items():
        for cycle in cycles:
            if not isinstance(cycle, Cycle):
                continue
            count = len(cycle.section.names)
            if any(np.max(np.abs(ending.z[:count] - point[:count])) < SAME for point in cycle.points):
                return f"branch {number} ({cycle.sequence})"
    return ending.label


def check_branch_basin(table: "xr.Dataset") -> None:
    """Raise InputError unless a dataset has the variables of basins along a branch."""
    if VARIABLES - set(table.variables) or table.attrs.get("format") != f"gaitopt {KIND}":
        raise InputError("The dataset must be that of basins along a branch, as trace_basin returns it.")


def _make_dataset(diagram: BranchDiagram, points: list[_BasinPoint]) -> "xr.Dataset":
    import xarray as xr

    endings = list(dict.fromkeys(name for point in points for name in sorted(point.endings)))
    share = np.array([[point.endings[name] / point.endings.total() for name in endings] for point in points])
    names = list(dict.fromkeys(name for point in points for name in point.cycle.section.names))
    change = [
        [np.nan if point.push is None else point.push.change.get(name, np.nan) for name in names] for point in points
    ]
    edges = np.full((len(points), len(names), len(SIDES)), np.nan)
    for row, point in zip(edges, points, strict=True):
        row[[names.index(name) for name in point.cycle.section.names]] = point.edges
    over = diagram.parameter
    return xr.Dataset(
        {
            "share": ((over, "ending"), share),
            "stable": (over, np.array([point.cycle.stable for point in points], dtype=np.int8)),
            "push": (over, [np.nan if point.push is None else point.push.size for point in points], {"units": "rad/s"}),
            "change": ((over, "coordinate"), np.array(change)),
            "edge": ((over, "coordinate", "side"), edges, {"units": "rad/s"}),
            "push_ending": (over, ["" if point.push is None else point.push.ending for point in points]),
        },
        {
            over: (over, [point.value for point in points], {"units": diagram.unit}),
            "ending": endings,
            "coordinate": names,
            "side": list(SIDES),
        },
        {
            "title": f"{diagram.robot}: basins along a branch over {over}",
            "format": f"gaitopt {KIND}",
            "format_version": VERSION,
            "versions": json.dumps(versions()),
        },
    )
