"""Constraints on the places of the feet in a gait of several steps, and on the rise between them on a terrain."""

import math
from collections.abc import Sequence

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.section_coordinate import guard_after_swap
from gaitopt.model.uneven_ground import INCLINE, NEXT_INCLINE, RISE
from gaitopt.motion.motion import Array
from gaitopt.ocp.multistep.foothold_ground import rise_between
from gaitopt.ocp.multistep.multistep_problem import MultiStepProblem
from gaitopt.ocp.nlp.block import Block
from gaitopt.ocp.nlp.keys import Key, Kind, Unknown
from gaitopt.ocp.nlp.layout import Index
from gaitopt.ocp.transcription.nlp_builder import is_slide
from gaitopt.ocp.transcription.transcription import StepParts


@dataclass(frozen=True, eq=False)
class PlaceCondition:
    """A function of some unknowns between two bounds.

    Attributes
    ----------
    name : str
    variables, value : SX
    columns : (n,) int array
        Indices of the variables.
    lower, upper : float
    """

    name: str
    variables: ca.SX
    value: ca.SX
    columns: Index
    lower: float
    upper: float

    def block(self, row: int) -> Block:
        """Return the block whose constraint has this row."""
        return Block(
            name=self.name,
            variables=self.variables,
            constraints=ca.SX(self.value),
            columns=self.columns[:, None],
            rows=np.array([[row]]),
        )


def ground_conditions(
    problem: MultiStepProblem, parts: Sequence[StepParts], offsets: Sequence[int], first: Index
) -> list[PlaceCondition]:
    """Return the conditions on the first pose, on the places of the feet and on the rises of the steps.

    Parameters
    ----------
    problem : MultiStepProblem
    parts : sequence of StepParts
    offsets : sequence of int
        First index of the unknowns of each step.
    first : int array
        Indices of the first state.
    """
    conditions = [] if problem.periodic else [_start(problem, parts[0], first)]
    places = [place_columns(parts[:number], offsets) for number in range(len(parts) + 1)]
    if problem.terrain is None:
        return conditions + [_between("foothold", places[number], pair) for number, pair in problem.footholds.items()]
    for number, foothold in enumerate(problem.ground):
        if number > 0 and np.any(np.isfinite(foothold.bounds)):
            conditions.append(_between("foothold", places[number], foothold.bounds))
        if number < len(parts):
            slipped = np.append(places[number], slide_indices(parts[number]) + offsets[number])
            weights = np.where(np.arange(slipped.size) < places[number].size, 1.0, math.cos(foothold.piece.incline))
            if slipped.size > places[number].size and np.any(np.isfinite(foothold.ground)):
                conditions.append(_between("slip", slipped, foothold.ground, weights))
            conditions += _rise(problem, number, parts[number], (slipped, weights), offsets[number])
    return conditions


def place_columns(before: Sequence[StepParts], offsets: Sequence[int]) -> Index:
    """Return the indices of the travels of some steps, whose sum is the place of the next foothold, shape (n,)."""
    travels = [step.builder.variables[Unknown.TRAVEL][0, 0] for step in before]
    return np.array([i + offset for i, offset in zip(travels, offsets, strict=False)], dtype=np.intp)


def slide_indices(step: StepParts) -> Index:
    """Return the indices of the slides of the stance foot among the unknowns of a step, one per slip, shape (n,)."""
    tables = step.builder.variables.tables
    return np.array([table[0, -1] for key, table in tables.items() if is_slide(key)], dtype=np.intp)


def _between(name: str, columns: Index, bounds: tuple[float, float], weights: Array | None = None) -> PlaceCondition:
    distances = ca.SX.sym("distances", columns.size)
    total = ca.sum1(distances if weights is None else distances * weights)
    return PlaceCondition(name, distances, total, columns, *bounds)


def _rise(
    problem: MultiStepProblem, number: int, step: StepParts, place: tuple[Index, Array], offset: int
) -> list[PlaceCondition]:
    """Return the equation of the rise of a step if it depends on the place of the foot at the end of the step."""
    if RISE not in step.structure.free:
        return []
    constant, grade = rise_between(problem.ground[number].piece, problem.ground[number + 1].piece)
    columns, weights = place
    distances, rise = ca.SX.sym("distances", columns.size), ca.SX.sym("rise")
    variables = step.builder.variables
    column = variables[Unknown.DESIGN][variables.rows[Unknown.DESIGN].index(Key(Kind.DESIGN, RISE)), 0] + offset
    value = rise - grade * ca.sum1(distances * weights)
    return [PlaceCondition("rise", ca.vertcat(distances, rise), value, np.append(columns, column), constant, constant)]


def _start(problem: MultiStepProblem, step: StepParts, state: Index) -> PlaceCondition:
    """Return the condition that the first state is a pose after touchdown, both feet on the same piece of ground."""
    robot = step.structure.robot
    angles = ca.SX.sym("angles", len(robot.angles))
    p = ca.SX(ca.DM(robot.vector(problem.resolved_steps[0].values)))
    if problem.terrain is not None:
        p[robot.index(RISE)], p[robot.index(NEXT_INCLINE)] = 0, p[robot.index(INCLINE)]
    return PlaceCondition("start", angles, guard_after_swap(robot, angles, p), state[: angles.numel()], 0.0, 0.0)
