"""Optimal gaits of a branch as gaits, and their replay in the event-driven simulator."""

import functools
import math

import numpy as np
from numpy.typing import NDArray

from gaitopt.continuation.optimal.kkt_point import KktLinearisation
from gaitopt.continuation.optimal.parametric_nlp import ParametricNlp
from gaitopt.control.law import Law, feedforward_samples
from gaitopt.dataclass import dataclass
from gaitopt.lazy import Deferred
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.coordinate_entries import full_coordinates
from gaitopt.motion.gait import Gait, SolverReport
from gaitopt.motion.motion import Array
from gaitopt.motion.versions import versions
from gaitopt.ocp.initial.solution_transfer import solution_of
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.nlp.nlp_solver import CONVERGED, NlpResult
from gaitopt.ocp.solution.certification import defer_certificate
from gaitopt.ocp.solution.grid_solve import GridSolution
from gaitopt.ocp.solution.trajectory import read_parameters
from gaitopt.reductions import worst
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.simulation.replay_tolerances import Tolerances
from gaitopt.stability.cycle import slips_throughout
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section
from gaitopt.status import Status

TOLERANCES = Tolerances()
"""Largest deviations of a replay from the plan, as in :func:`gaitopt.verify`."""


@dataclass(frozen=True, eq=False)
class OptimumReplay:
    """Result of the replay of an optimal gait.

    Attributes
    ----------
    passed : bool
        Whether the replay agrees with the plan within the tolerances of :func:`gaitopt.verify`.
    state_error : float
        Largest difference of the state after the step from the planned one.
    multipliers : (n,) complex array
        Multipliers of the gait with its torques in open loop, largest modulus first; empty if the replay has
        no next step.
    """

    passed: bool
    state_error: float
    multipliers: NDArray[np.complex128]


@functools.lru_cache(maxsize=2)
def solve_result(optimum: KktLinearisation) -> GridSolution:
    """Return an optimum of a branch in the form of a solve on its grid."""
    nlp, point = optimum.nlp, optimum.point
    typical = nlp.transcription.nlp.typical
    multipliers = optimum.bound_multipliers * typical, point.multipliers * typical
    outcome = NlpResult(Status.SOLVED, CONVERGED, point.x, optimum.values.g, optimum.cost, 0, multipliers)
    limits = nlp.bounds_at(point.value)
    return GridSolution(optimum.problem, nlp.method, nlp.transcription, limits, optimum.data, outcome)


def make_optimal_gait(optimum: KktLinearisation) -> Gait:
    """Return an optimum of a branch as a gait, which can be saved and warm-starts :func:`gaitopt.solve`."""
    solution = solve_result(optimum)
    method = {"transcription": solution.method.name, "intervals": list(solution.transcription.structure.counts)}
    return Gait(
        robot=solution.problem.robot,
        sequence=solution.problem.sequence,
        status=Status.SOLVED,
        motion=Deferred(lambda: solution.motion),
        problem=Deferred(lambda: solution.problem.describe() | method),
        solver=SolverReport(
            iterations=0,
            objective=optimum.cost,
            constraint_violation=0.0,
            error_between_nodes=Deferred(lambda: solution.drift),
            build_seconds=0.0,
            solve_seconds=0.0,
            message=CONVERGED,
            warnings=Deferred(solution.warnings),
        ),
        versions=versions(),
        solution=solution_of(solution.transcription, solution.outcome),
        certificate=defer_certificate(solution),
    )


class Replayer:
    """Replay of the optima of one branch in the event-driven simulator.

    Parameters
    ----------
    nlp : ParametricNlp
    engine : Engine or None
        By default the fastest installed one.
    """

    def __init__(self, nlp: ParametricNlp, engine: Engine | None) -> None:
        self.nlp, self.engine = nlp, engine
        self.sequence, self.robot = nlp.problem.sequence, nlp.problem.robot
        drifts = slips_throughout(self.sequence.phases, self.sequence.impact)
        self._sliding = self.sequence.impact is not Mode.STICK and not drifts

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates of the state after touchdown."""
        return Section(self.robot, self.nlp.problem.robot.vector(self.nlp.problem.values), self._sliding).names

    def read_state(self, optimum: KktLinearisation) -> Array:
        """Return the state (q, v) after touchdown, shape (2 n_q,)."""
        layout, x = self.nlp.transcription.variables, optimum.point.x
        first = self.nlp.transcription.phases[0]
        speed = x[layout[Unknown.SLIDE, first.number][1, 0]] if first.mode.slips else 0.0
        angles, rates = (x[layout[table][:, 0]] for table in (Unknown.ANGLES, Unknown.RATES))
        return np.concatenate([full_coordinates(angles), full_coordinates(rates, speed)])

    def project(self, optimum: KktLinearisation) -> Array:
        """Return the coordinates of the state after touchdown, shape (n,)."""
        return Section(self.robot, optimum.data, self._sliding).project(self.read_state(optimum))

    def replay(self, optimum: KktLinearisation) -> OptimumReplay:
        """Replay the torques of an optimum from its first state, and return the multipliers of the gait."""
        state = self.read_state(optimum)
        values = self._read_parameters(optimum)
        law, period = self._law(optimum)
        walker = make_walker(self.robot, law, values, period=period, engine=self.engine)
        foot_speed = float(state[self.robot.state_entries.slip_velocity])
        section = Section(self.robot, walker.p, self._sliding, foot_speed)
        return_map, z = ReturnMap(walker, section), section.project(state)
        passage = return_map(z)
        walk_step = passage.walk_steps[0]
        if passage.end is None or walk_step.following is None or walk_step.impact is None:
            return OptimumReplay(False, math.inf, np.empty(0, dtype=complex))
        entries = [*self.robot.state_entries.angles, *self.robot.state_entries.rates]
        entries += [self.robot.state_entries.slip_velocity] if self._sliding else []
        error = worst(np.abs(walk_step.following - state)[entries])
        same = walk_step.modes == self.sequence.phases and walk_step.impact.mode is self.sequence.impact
        near = error <= TOLERANCES.state and abs(walk_step.duration - period) <= TOLERANCES.period
        matrix = return_map.derivative(z, passage)
        finite = np.linalg.eigvals(matrix) if np.all(np.isfinite(matrix)) else np.full(z.size, np.nan)
        multipliers = finite.astype(complex)
        return OptimumReplay(same and near, error, multipliers[np.argsort(-np.abs(multipliers))])

    def _read_parameters(self, optimum: KktLinearisation) -> dict[str, float]:
        """Return the parameters of robot and ground of an optimum by name."""
        transcription, stated, x = self.nlp.transcription, self.nlp.problem, optimum.point.x
        name = self.nlp.number.name
        if name in stated.values:
            # The problem at this value, all of whose fields are checked again, has no other parameters.
            return read_parameters(transcription, stated, x) | {name: optimum.point.value}
        return read_parameters(transcription, optimum.problem, x)

    def _law(self, optimum: KktLinearisation) -> tuple[Law, float]:
        """Return the torques of an optimum as a law, and its period."""
        layout, x = self.nlp.transcription.variables, optimum.point.x
        durations, begin = x[layout[Unknown.DURATION][0]], 0.0
        times, nodes = list[Array](), list[int]()
        for phase, duration in zip(self.nlp.transcription.phases, durations, strict=True):
            times.append(begin + duration * phase.fractions)
            nodes += list(phase.nodes)
            begin += duration
        torque = x[layout[Unknown.TORQUE][:, nodes]]
        return feedforward_samples(self.robot, np.concatenate(times), torque), float(begin)
