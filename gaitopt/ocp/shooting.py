"""Multiple shooting: from a word to a nonlinear programme.

Unknowns per node: angles, rates, torques (continuous and linear between nodes); per slip phase also the foot's slide
and slide rate; one duration per phase; the landing impulse; the travel of the step.  The last node of a phase *is*
the first node of the next.  Each half of an interval is one classical Runge-Kutta step (or several), so that its
middle is a point of the trajectory, at which the friction cone, the slip direction and the joint powers are held too.
"""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from gaitopt.errors import InputError
from gaitopt.model.modes import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.word import Word
from gaitopt.ocp.grid import Phase, divide
from gaitopt.ocp.layout import Layout, Rows
from gaitopt.ocp.nlp import Block, Nlp, assemble_nlp
from gaitopt.ocp.objective import Objective
from gaitopt.ocp.stance import Stance
from gaitopt.ocp.touchdown import touchdown_block
from gaitopt.parameters import Parameter

MARGINS = ("cone", "impact_cone")
"""Margins that enter the constraints as data, after the robot's parameters."""


@dataclass(frozen=True, kw_only=True)
class MultipleShooting:
    """Transcription by multiple shooting with fourth-order Runge-Kutta steps.

    Attributes
    ----------
    intervals : int or tuple of int
        Intervals of each phase.  A single number is meant for a sticking phase; slip phases beside one are short
        and get a quarter of it.
    substeps : int
        Runge-Kutta steps in each half of an interval.
    tolerance : float
        Largest error of the states between nodes, found by integrating the plan again with four times the steps, and
        largest relative closing error of its energy ledger.  Where it is exceeded, :func:`gaitopt.solve` doubles
        `substeps` and goes on from the solution.

    Examples
    --------
    >>> MultipleShooting(intervals=40).intervals_for(Word.parse("slip+ stick | slip+"))
    (10, 40)
    """

    intervals: int | tuple[int, ...] = 40
    substeps: int = 1
    tolerance: float = 1e-7
    name = "multiple shooting"

    def __post_init__(self) -> None:
        _check_count("substeps", self.substeps, 1, 64)
        Parameter("tolerance", 0.0, "1", "", lower=0.0, lower_open=True, infinite=True).check(self.tolerance)

    def intervals_for(self, word: Word) -> tuple[int, ...]:
        """Return the number of intervals of each phase.

        Raises
        ------
        InputError
            If a count is not a whole number of at least 2, or there is not one per phase.
        """
        if isinstance(self.intervals, tuple | list):
            counts = tuple(self.intervals)
        else:
            _check_count("intervals", self.intervals, 2, 2000)
            short = max(5, int(self.intervals) // 4) if Mode.STICK in word.phases else self.intervals
            counts = tuple(short if mode.slips else self.intervals for mode in word.phases)
        if len(counts) != len(word.phases):
            raise InputError(
                f"intervals has {len(counts)} entries, but the word '{word}' has {len(word.phases)} phases."
            )
        for count in counts:
            _check_count("intervals", count, 2, 2000)
        return tuple(int(count) for count in counts)


def _check_count(name: str, count: object, lower: int, upper: int) -> None:
    if isinstance(count, bool):
        raise InputError(f"{name} must be a whole number, got {count!r}.")
    Parameter(name, lower, "1", "", lower=lower, upper=upper, whole=True).check(count)


@dataclass(frozen=True, eq=False, kw_only=True)
class Transcription:
    """A compiled gait problem for one robot, word, objective and grid; serves every parameter value.

    Attributes
    ----------
    robot : Robot
    word : Word
    objective : Objective
    substeps : int
    phases : tuple of Phase
    variables, constraints : Layout
        Names and places of the decision vector and of the constraint rows.
    row_bounds : (2, n_constraints) array
        Lower and upper bounds of the rows; those of `speed` come from the problem.
    nlp : Nlp
    stances : tuple of Stance
        The continuous physics of each phase.
    """

    robot: Robot
    word: Word
    objective: Objective
    substeps: int
    phases: tuple[Phase, ...]
    variables: Layout
    constraints: Layout
    row_bounds: np.ndarray
    nlp: Nlp
    stances: tuple[Stance, ...]

    @functools.cached_property
    def n_nodes(self) -> int:
        """Number of nodes of the step."""
        return self.phases[-1].first + self.phases[-1].count + 1


@functools.lru_cache(maxsize=32)
def transcribe(
    robot: Robot, word: Word, objective: Objective, counts: tuple[int, ...], substeps: int = 1
) -> Transcription:
    """Transcribe a word into a nonlinear programme; equal arguments return the programme built before.

    Parameters
    ----------
    robot : Robot
    word : Word
    objective : Objective
    counts : tuple of int
        Intervals of each phase.
    substeps : int
        Runge-Kutta steps in each half of an interval.
    """
    phases = divide(word, counts)
    data = ca.SX.sym("z", len(robot.parameters) + len(MARGINS))
    rows = Rows()
    variables = _variables(robot, phases, objective)
    stances = tuple(Stance(robot, phase.mode) for phase in phases)
    blocks = []
    for phase, stance in zip(phases, stances, strict=True):
        blocks.append(_interval_block(phase, stance, objective, substeps, variables, rows, data))
        blocks.append(_end_block(phase, stance, variables, rows, data))
        if phase.breaks_away:
            blocks.append(_start_block(phase, stance, variables, rows, data))
    if objective.uses_power:
        blocks.append(_last_power_block(phases[-1], stances[-1], variables, rows, data))
    blocks.append(touchdown_block(robot, word, phases, variables, rows, data))
    if objective.per_weight_and_travel:
        blocks.append(_quotient_block(stances[0], variables, rows, data))
    return Transcription(
        robot=robot,
        word=word,
        objective=objective,
        substeps=substeps,
        phases=phases,
        variables=variables,
        constraints=rows.layout,
        row_bounds=rows.bounds(),
        nlp=assemble_nlp(blocks, data, variables.size, rows.layout.size),
        stances=stances,
    )


def _variables(robot: Robot, phases: tuple[Phase, ...], objective: Objective) -> Layout:
    layout, n_nodes = Layout(), phases[-1].nodes[-1] + 1
    owner = {node: phase for phase in reversed(phases) for node in phase.nodes}
    nodes = [f"{owner[k].label}, node {k - owner[k].first}" for k in range(n_nodes)]
    layout.add("angles", robot.angles, nodes)
    layout.add("rates", [f"{angle} rate" for angle in robot.angles], nodes)
    layout.add("torque", [f"{actuator} torque" for actuator in robot.actuators], nodes)
    layout.add("duration", ["duration"], [phase.label for phase in phases])
    for phase in phases:
        places = [f"{phase.label}, node {k - phase.first}" for k in phase.nodes]
        middles = [f"{phase.label}, between nodes {k} and {k + 1}" for k in range(phase.count)]
        if phase.mode.slips:
            layout.add(f"slide {phase.number}", ["foot slide", "foot speed"], places)
        if objective.uses_power:
            layout.add(f"mid power {phase.number}", _power_names(robot), middles)
    if objective.uses_power:
        layout.add("power", _power_names(robot), nodes)
    layout.add("impulse", ["tangential impulse", "normal impulse"], ["touchdown"])
    layout.add("travel", ["step length"], ["step"])
    if objective.per_weight_and_travel:
        layout.add("integral", ["integral of the objective"], ["step"])
    return layout


def _power_names(robot: Robot) -> list[str]:
    return [f"{sign} power of {name}" for sign in ("positive", "negative") for name in robot.actuators]


def _interval_block(
    phase: Phase, stance: Stance, objective: Objective, substeps: int, variables: Layout, rows: Rows, data: ca.SX
) -> Block:
    """Return the block of a phase's intervals: defects, path constraints at start and middle, powers, objective."""
    robot, n_u, left = stance.robot, stance.robot.n_u, list(phase.nodes)[:-1]
    right = [k + 1 for k in left]
    state, after = ca.SX.sym("state", stance.n_x), ca.SX.sym("after", stance.n_x)
    torque, torque_after = ca.SX.sym("torque", n_u), ca.SX.sym("torque_after", n_u)
    duration = ca.SX.sym("duration")
    p, cone = data[: len(robot.parameters)], data[len(robot.parameters)]
    step = duration / phase.count
    middle_torque = (torque + torque_after) / 2
    middle, end = stance.interval(state, torque, torque_after, step, p, substeps=substeps)

    local = [state, torque, after, torque_after, duration]
    columns = [
        *_state_columns(phase, variables, left),
        *variables["torque"][:, left],
        *_state_columns(phase, variables, right),
        *variables["torque"][:, right],
        np.repeat(variables["duration"][:, phase.number], phase.count),
    ]
    places = [f"{phase.label}, node {i}" for i in range(phase.count)]
    names, values = stance.path(state, torque, p, cone)
    mid_names, mid_values = stance.path(middle, middle_torque, p, cone)
    table = [(f"dynamics of {name}", 0.0, 0.0) for name in stance.state_names]
    table += [(name, 0.0, math.inf) for name in names]
    table += [(f"{name}, mid-interval", 0.0, math.inf) for name in mid_names]
    constraints = [after - end, values, mid_values]
    if phase.mode.slips:
        table.append(("foot speed, mid-interval", 0.0, math.inf))
        constraints.append(phase.mode.sign * middle[-1])

    powers = (
        [ca.SX.sym(name, 2 * n_u) for name in ("power", "mid_power", "power_after")] if objective.uses_power else []
    )
    if powers:
        local += powers
        columns += [
            *variables["power"][:, left],
            *variables[f"mid power {phase.number}"],
            *variables["power"][:, right],
        ]
        for label, x, u, split in (
            ("", state, torque, powers[0]),
            (", mid-interval", middle, middle_torque, powers[1]),
        ):
            table += [(f"power split of {name}{label}", 0.0, 0.0) for name in robot.actuators]
            constraints.append(split[:n_u] - split[n_u:] - stance.power(x, u, p))

    def integrand(u: ca.SX, position: int) -> ca.SX:
        split = powers[position] if powers else ca.SX(2 * n_u, 1)
        return objective.integrand(u, split[:n_u], split[n_u:])

    sample = [integrand(u, i) for i, u in enumerate((torque, middle_torque, torque_after))]
    share = step * sum(weight * value for weight, value in zip(objective.quadrature, sample, strict=True))
    index = rows.add(f"interval {phase.number}", table, places)
    cost: ca.SX | None = share
    if objective.per_weight_and_travel:
        cost = None
        constraints.append(share)
        index = np.vstack([index, np.full(phase.count, _integral_row(rows))])
    return Block(
        name=f"interval_{phase.number}",
        variables=ca.vertcat(*local),
        cost=cost,
        constraints=ca.vertcat(*constraints),
        columns=np.vstack(columns),
        rows=index,
    )


def _integral_row(rows: Rows) -> int:
    if "integral" not in rows.layout:
        rows.add("integral", [("integral of the objective", 0.0, 0.0)], ["step"])
    return int(rows.layout["integral"][0, 0])


def _end_block(phase: Phase, stance: Stance, variables: Layout, rows: Rows, data: ca.SX) -> Block:
    """Return the block of a phase's last node: its path constraints, or the onset of the slip that begins there."""
    robot, node = stance.robot, phase.nodes[-1]
    state, torque = ca.SX.sym("state", stance.n_x), ca.SX.sym("torque", robot.n_u)
    p, cone = data[: len(robot.parameters)], data[len(robot.parameters)]
    if phase.onset is not None:
        table, values = stance.onset(state, torque, p, phase.onset)
    else:
        names, values = stance.path(state, torque, p, cone)
        table = [(name, 0.0, math.inf) for name in names]
    columns = np.vstack([*_state_columns(phase, variables, [node]), *variables["torque"][:, [node]]])
    index = rows.add(f"end {phase.number}", table, [f"{phase.label}, node {phase.count}"])
    return Block(
        name=f"end_{phase.number}",
        variables=ca.vertcat(state, torque),
        constraints=values,
        columns=columns,
        rows=index,
    )


def _last_power_block(phase: Phase, stance: Stance, variables: Layout, rows: Rows, data: ca.SX) -> Block:
    """Return the power split at the last node of the step."""
    robot, node, n_u = stance.robot, phase.nodes[-1], stance.robot.n_u
    state, torque, split = (ca.SX.sym(s, n) for s, n in (("x", stance.n_x), ("u", n_u), ("split", 2 * n_u)))
    power = stance.power(state, torque, data[: len(robot.parameters)])
    table = [(f"power split of {name}", 0.0, 0.0) for name in robot.actuators]
    return Block(
        name="last_power",
        variables=ca.vertcat(state, torque, split),
        constraints=split[:n_u] - split[n_u:] - power,
        columns=np.vstack(
            [
                *_state_columns(phase, variables, [node]),
                *variables["torque"][:, [node]],
                *variables["power"][:, [node]],
            ]
        ),
        rows=rows.add("last power", table, [f"{phase.label}, node {phase.count}"]),
    )


def _quotient_block(stance: Stance, variables: Layout, rows: Rows, data: ca.SX) -> Block:
    """Return the objective, an integral over weight and travel, and close the row that defines the integral."""
    integral, travel = ca.SX.sym("integral"), ca.SX.sym("travel")
    return Block(
        name="quotient",
        variables=ca.vertcat(integral, travel),
        cost=integral / (stance.weight(data[: len(stance.robot.parameters)]) * travel),
        constraints=-integral,
        columns=np.vstack([variables["integral"], variables["travel"]]),
        rows=np.array([[_integral_row(rows)]]),
    )


def _start_block(phase: Phase, stance: Stance, variables: Layout, rows: Rows, data: ca.SX) -> Block:
    """Return the condition under which a foot at rest slides at once: its slip acceleration has the slip's sign."""
    robot, node = stance.robot, phase.first
    state, torque = ca.SX.sym("state", stance.n_x), ca.SX.sym("torque", robot.n_u)
    rate = stance.flow(state, torque, data[: len(robot.parameters)])[0]
    return Block(
        name=f"start_{phase.number}",
        variables=ca.vertcat(state, torque),
        constraints=phase.mode.sign * rate[-1],
        columns=np.vstack([*_state_columns(phase, variables, [node]), *variables["torque"][:, [node]]]),
        rows=rows.add(f"start {phase.number}", [("breakaway acceleration", 0.0, math.inf)], [f"{phase.label}, node 0"]),
    )


def _state_columns(phase: Phase, variables: Layout, nodes: Sequence[int]) -> list[np.ndarray]:
    """Return the rows of decision-vector indices that make up the phase's state at some nodes."""
    nodes = list(nodes)
    columns = [*variables["angles"][:, nodes], *variables["rates"][:, nodes]]
    if phase.mode.slips:
        own = [k - phase.first for k in nodes]
        columns += [*variables[f"slide {phase.number}"][:, own]]
    return columns
