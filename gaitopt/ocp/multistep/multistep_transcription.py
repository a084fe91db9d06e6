"""The NLP of several steps: the blocks of each step, joined by its touchdown to the next one.

The unknowns are those of the steps one after the other, then the state after the last touchdown unless the gait
repeats.
"""

from collections.abc import Collection, Mapping
from dataclasses import replace

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.terrain import Terrain
from gaitopt.motion.motion import Array
from gaitopt.ocp.bounds import bounds, data_vector, structure
from gaitopt.ocp.multistep.ground_constraints import PlaceCondition, ground_conditions, place_columns
from gaitopt.ocp.multistep.multistep_problem import FOOT_SPEED, MultiStepProblem
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.nlp.layout import Index
from gaitopt.ocp.nlp.nlp import Nlp, assemble_nlp
from gaitopt.ocp.transcription.impact_constraints import FollowingStep
from gaitopt.ocp.transcription.method import Method
from gaitopt.ocp.transcription.swing_terrain import SwingTerrain
from gaitopt.ocp.transcription.transcription import StepParts, Transcription, prepare_step


@dataclass(frozen=True, eq=False, kw_only=True)
class MultiStepTranscription:
    """The NLP of several steps with its numbers.

    Attributes
    ----------
    problem : MultiStepProblem
    nlp : Nlp
    steps : tuple of Transcription
        Layout of each step.
    offsets : tuple of int
        First index of the unknowns of each step, then of the state after the last touchdown.
    first, last : dict of str to int
        Indices of the coordinates of the first state, and of that after the last touchdown.
    data : (n_z,) array
    limits : Bounds
    """

    problem: MultiStepProblem
    nlp: Nlp
    steps: tuple[Transcription, ...]
    offsets: tuple[int, ...]
    first: dict[str, int]
    last: dict[str, int]
    data: Array
    limits: Bounds

    def step_unknowns(self, x: Array, number: int) -> Array:
        """Return the unknowns of one step."""
        return x[self.offsets[number] : self.offsets[number + 1]]


def transcribe_steps(
    problem: MultiStepProblem, methods: tuple[Method, ...], constrained: Collection[int] = ()
) -> MultiStepTranscription:
    """Transcribe a problem of several steps into an NLP, each step on the grid of its method.

    In the steps with the numbers `constrained`, the height of the swing foot over the terrain is constrained, in the
    others only at the touchdown.
    """
    parts = tuple(
        prepare_step(replace(structure(step, method), placed=False))
        for step, method in zip(problem.resolved_steps, methods, strict=True)
    )
    sizes = [step.builder.variables.size for step in parts]
    offsets = tuple(int(offset) for offset in np.cumsum([0, *sizes]))
    parts = tuple(
        _constrain_swing_foot(problem, parts, offsets, number) if number in constrained else step
        for number, step in enumerate(parts)
    )
    states = [_first_state(step) + offset for step, offset in zip(parts, offsets, strict=False)]
    n_variables, names = offsets[-1], problem.coordinates
    if not problem.periodic:
        count = len(names) - (not problem.resolved_steps[-1].sequence.impact.slips)
        states.append(np.arange(n_variables, n_variables + count))
        n_variables += count
    blocks, rows = [], 0
    for number, step in enumerate(parts):
        following = _following_step(problem, parts, states, number, offsets[number])
        for block in step.blocks(following):
            blocks.append(replace(block, columns=block.columns + offsets[number], rows=block.rows + rows))
        rows += step.builder.rows.layout.size
    conditions = ground_conditions(problem, parts, offsets, states[0])
    blocks += [condition.block(rows + number) for number, condition in enumerate(conditions)]
    rows += len(conditions)
    data = ca.vertcat(*(step.builder.data for step in parts))
    typical = sum(step.objective.typical for step in problem.resolved_steps)
    nlp = assemble_nlp(blocks, data, n_variables, rows, typical=typical)
    steps = tuple(step.transcription(nlp) for step in parts)
    first, last = ({name: int(i) for name, i in zip(names, state, strict=False)} for state in (states[0], states[-1]))
    return MultiStepTranscription(
        problem=problem,
        nlp=nlp,
        steps=steps,
        offsets=offsets,
        first=first,
        last=last,
        data=np.concatenate([data_vector(step) for step in problem.resolved_steps]),
        limits=_bounds(problem, steps, n_variables, (first, last), conditions),
    )


def _constrain_swing_foot(
    problem: MultiStepProblem, parts: tuple[StepParts, ...], offsets: tuple[int, ...], number: int
) -> StepParts:
    """Return the parts of a step with constraints on the height of the swing foot over the terrain."""
    columns = place_columns(parts[:number], offsets) - offsets[number]
    terrain = SwingTerrain(problem.terrain or Terrain(), columns, problem.ground[number].piece.line)
    return replace(parts[number], builder=replace(parts[number].builder, terrain=terrain))


def _first_state(step: StepParts) -> Index:
    """Return the indices of the first state of a step: angles, rates and, if the foot slides, its speed."""
    variables = step.builder.variables
    state = [variables[table][:, 0] for table in (Unknown.ANGLES, Unknown.RATES)]
    speed = step.builder.slide_columns(step.phases[0], [0])[1:, 0]
    return np.concatenate([*state, speed])


def _following_step(
    problem: MultiStepProblem, parts: tuple[StepParts, ...], states: list[Index], number: int, offset: int
) -> FollowingStep:
    """Return what follows a step, with indices counted from its own first unknown."""
    after = number + 1
    ends = after == len(parts) and not problem.periodic
    place = number if ends else after % len(parts)
    builder, count = parts[place].builder, len(problem.robot.angles)
    friction = builder.data[builder.names().index("friction")]
    if ends and problem.terrain is not None:
        friction = ca.SX(problem.last_friction)
    state = (states[after if ends else place] - offset)[:, None]
    impact: Mode = problem.resolved_steps[place].sequence.impact
    return FollowingStep(
        angles=state[:count],
        rates=state[count : 2 * count],
        speed=state[2 * count :] if impact.slips else np.empty((0, 1), dtype=np.intp),
        impact=impact,
        friction=friction,
        margin=builder.data[len(problem.robot.parameters) + 1],
    )


def _bounds(
    problem: MultiStepProblem,
    steps: tuple[Transcription, ...],
    n_variables: int,
    ends: tuple[Mapping[str, int], Mapping[str, int]],
    conditions: list[PlaceCondition],
) -> Bounds:
    """Return the bounds of all steps, with the stated coordinates of start and end fixed."""
    each = [bounds(transcription, step) for transcription, step in zip(steps, problem.resolved_steps, strict=True)]
    names = ("x_lower", "x_upper", "g_lower", "g_upper")
    whole = {name: np.concatenate([getattr(one, name) for one in each]) for name in names}
    first, last = ends
    for side in ("lower", "upper"):
        whole[f"g_{side}"] = np.append(whole[f"g_{side}"], [getattr(one, side) for one in conditions])
    if problem.periodic:
        return Bounds(**whole)
    free = np.full(n_variables - whole["x_lower"].size, np.inf)
    whole["x_lower"], whole["x_upper"] = np.append(whole["x_lower"], -free), np.append(whole["x_upper"], free)
    if FOOT_SPEED in last:
        sign = problem.resolved_steps[-1].sequence.impact.sign
        bound = whole["x_lower"] if sign > 0 else whole["x_upper"]
        bound[last[FOOT_SPEED]] = 0.0
    for state, entries in ((problem.start, first), (problem.end, last)):
        for name, value in problem.fixed_coordinates(state or {}).items():
            if name in entries:
                whole["x_lower"][entries[name]] = whole["x_upper"][entries[name]] = value
    return Bounds(**whole)
