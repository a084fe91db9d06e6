"""MultiStepGait: an optimised gait of several steps, and the motion of its steps one after the other."""

import itertools
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.model.coordinate_entries import CONTACT, GAP
from gaitopt.model.ground_frame import place_on_plane
from gaitopt.model.terrain import Terrain
from gaitopt.model.uneven_ground import INCLINE, NEXT_INCLINE, RISE
from gaitopt.motion.gait import Verification
from gaitopt.motion.motion import Array, Jump, Motion, Segment
from gaitopt.motion.summary import plain
from gaitopt.ocp.multistep.multistep_problem import MultiStepProblem
from gaitopt.status import Status


@check_arguments
@dataclass(frozen=True, eq=False, kw_only=True)
class MultiStepGait:
    """An optimised gait of several steps.

    Attributes
    ----------
    problem : MultiStepProblem
    status : Status
    plans : tuple of Motion
        Planned motion of each step, its stance foot at the origin when the step starts.
    objective : float
        Sum of the objectives of the steps.
    iterations : int
    constraint_violation : float
        Largest violation at the last iterate.
    error_between_nodes : float
        Largest difference of a state between the nodes from its integration with small steps (rad, rad/s, m, m/s).
    message : str
        Return status of the solver.
    verification : Verification or None
        Result of :func:`gaitopt.simulation.verify_steps`.

    Examples
    --------
    Created by :func:`gaitopt.ocp.solve_steps`:

    >>> "plans" in MultiStepGait.__dataclass_fields__
    True
    """

    problem: MultiStepProblem
    status: Status
    plans: tuple[Motion, ...]
    objective: float
    iterations: int
    constraint_violation: float
    error_between_nodes: float
    message: str
    verification: Verification | None = None

    @property
    def motion(self) -> Motion:
        """The planned motion of all steps, from the origin."""
        return join_steps(self.plans, terrain=self.problem.terrain)

    @property
    def sequences(self) -> tuple[str, ...]:
        """Contact sequences of the steps; the impact of each is the touchdown that begins it."""
        return tuple(str(step.sequence) for step in self.problem.steps)

    def summarise(self) -> dict[str, Any]:
        """Return the results as plain data for JSON (SI units)."""
        facts: dict[str, Any] = plain(
            {
                "name": self.problem.name,
                "status": self.status.key,
                "hint": self.status.hint,
                "message": self.message,
                "robot": self.problem.robot.name,
                "objective": self.objective,
                "iterations": self.iterations,
                "error_between_nodes": self.error_between_nodes,
                "periodic": self.problem.periodic,
                "steps": [
                    {
                        "sequence": str(step.sequence),
                        "friction": plan.parameters["friction"],
                        "slope": plan.parameters["slope"],
                        "step_length": plan.travel,
                        "duration": plan.period,
                        **rise,
                        "objective": step.objective.evaluate(plan),
                    }
                    for step, plan, rise in zip(self.problem.resolved_steps, self.plans, self._rises(), strict=True)
                ],
                "verification": self.verification and asdict(self.verification),
            }
        )
        return facts

    def _rises(self) -> list[dict[str, float]]:
        """Return the height gained by the feet in each step on a terrain [m]; empty on a plane."""
        if self.problem.terrain is None:
            return [{} for _ in self.plans]
        heights = [self.problem.terrain.height(0.0), *(float(jump.q_next[GAP]) for jump in self.motion.jumps)]
        return [{"rise": after - before} for before, after in itertools.pairwise(heights)]

    def replace_fields(self, **changes: Any) -> "MultiStepGait":
        """Return the gait with some fields changed."""
        return replace(self, **changes)


def join_steps(motions: Sequence[Motion], *, absolute: bool = False, terrain: Terrain | None = None) -> Motion:
    """Return motions of single steps as one motion, in order.

    The positions of the feet are given along and across the plane, so the parameters of the motion contain no
    inclination; their rates are given along and across the ground below the stance foot.

    Parameters
    ----------
    motions : sequence of Motion
    absolute : bool
        Whether the places of the motions are already those on the ground; otherwise each step begins at the origin
        and is moved to the place where the foot landed.
    terrain : Terrain, optional
    """
    segments: list[Segment] = []
    jumps: list[Jump] = []
    time, origin = 0.0, np.array([0.0, 0.0 if terrain is None else terrain.height(0.0)])
    place = origin
    for number, motion in enumerate(motions):
        start = float(motion.segments[0].time[0])
        offset = origin if absolute else place
        for segment in motion.segments:
            segments.append(_move_segment(segment, number, time - start, offset, motion.parameters))
        for jump in motion.jumps:
            jumps.append(_move_jump(jump, number, time - start, offset, motion.parameters))
            place = jumps[-1].q_next[CONTACT].copy()
            if RISE not in motion.parameters:
                place[GAP] = 0.0
        time = float(segments[-1].time[-1])
    parameters = motions[0].parameters
    if RISE in parameters:
        parameters = {**parameters, INCLINE: 0.0, NEXT_INCLINE: 0.0}
    return replace(motions[0], parameters=parameters, segments=tuple(segments), jumps=tuple(jumps), terrain=terrain)


def _move_segment(segment: Segment, step: int, delay: float, distance: Array, ground: dict[str, float]) -> Segment:
    q, points = segment.q.copy(), segment.points + distance[:, None, None]
    q[CONTACT] = place_on_plane(q[CONTACT], ground) + distance[:, None]
    rims = segment.rims
    if rims is not None:
        rims = rims.copy()
        rims[:2] += distance[:, None, None]
    return replace(segment, step=step, time=segment.time + delay, q=q, points=points, rims=rims)


def _move_jump(jump: Jump, step: int, delay: float, distance: Array, ground: dict[str, float]) -> Jump:
    q, q_next = jump.q.copy(), jump.q_next.copy()
    for state, incline in ((q, INCLINE), (q_next, NEXT_INCLINE)):
        state[CONTACT] = place_on_plane(state[CONTACT], ground, incline) + distance
    return replace(jump, step=step, time=jump.time + delay, q=q, q_next=q_next)
