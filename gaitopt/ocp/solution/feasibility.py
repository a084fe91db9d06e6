"""Elastic form of a gait problem on one grid."""

import math

import numpy as np

from gaitopt.interrupts import defer_interrupt
from gaitopt.motion.motion import Array, Motion
from gaitopt.ocp.bounds import bounds, data_vector, structure
from gaitopt.ocp.initial.deviation_start import solve_deviations
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.nlp.elastic import ElasticNlp, ElasticResult
from gaitopt.ocp.nlp.keys import Kind, Unknown
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.conflict_search import ElasticLimits, friction_of_cones
from gaitopt.ocp.solution.relaxable_limits import list_limits, relaxed_sides, typical_sizes
from gaitopt.ocp.solution.trajectory import read_parameters, reconstruct_motion
from gaitopt.ocp.statement.criteria import TorqueSquared
from gaitopt.ocp.statement.initial_guess import Guess
from gaitopt.ocp.transcription.method import Method
from gaitopt.ocp.transcription.relaxation import Relaxation
from gaitopt.ocp.transcription.transcription import transcribe
from gaitopt.progress import Observer

SHORTEST = 1e-2
"""Fraction of the shortest duration of a phase that remains as its bound."""


class ElasticProblem(ElasticLimits):
    """A gait problem whose limits are elastic, on one grid; the objective is replaced by the excess over the limits.

    Parameters
    ----------
    problem : GaitProblem
    method : Method
        Grid and scheme.
    solver : NlpSolver
    observer : Observer
    relaxation : Relaxation, optional
        Relaxation of the complementarity pairs of an open contact sequence.
    pair_parameter : float
        Its parameter t.
    """

    def __init__(
        self,
        problem: GaitProblem,
        method: Method,
        solver: NlpSolver,
        observer: Observer,
        relaxation: Relaxation | None = None,
        pair_parameter: float = 1.0,
    ) -> None:
        # The conditions on a motion do not depend on the objective: an objective without further unknowns is used.
        self.problem = problem.replace(objective=TorqueSquared())
        with defer_interrupt():
            self.transcription = transcribe(structure(self.problem, method, relaxation))
            limits = bounds(self.transcription, self.problem)
            relaxed = list_limits(self.transcription, self.problem)
            least = np.full(self.transcription.variables.size, -math.inf)
            least[self.transcription.variables[Unknown.DURATION]] = SHORTEST * problem.limits.shortest_phase
            sizes = typical_sizes(self.transcription, self.problem)
            sides = relaxed_sides(relaxed, limits)
            elastic = ElasticNlp(self.transcription.nlp, limits, sides, sizes, least)
        data = np.append(data_vector(self.problem), [] if relaxation is None else pair_parameter)
        super().__init__(elastic, relaxed, data, solver, observer)

    def minimise_excess(self, guess: Guess) -> ElasticResult:
        """Return the motion near a guess with the least excess over the limits."""
        return self.minimise_from(self.start_near(guess))

    @defer_interrupt()
    def start_near(self, guess: Guess) -> Array:
        """Return the initial point from a guess."""
        x = initial_point(self.transcription, self.problem, guess)
        return x if self.problem.stability is None else solve_deviations(self.transcription, x, self._data)

    def motion(self, result: ElasticResult) -> Motion:
        """Return the motion of a result."""
        with defer_interrupt():
            values = read_parameters(self.transcription, self.problem, result.x)
            return reconstruct_motion(self.transcription, values, result.x)

    @defer_interrupt()
    def find_sufficient_friction(self, x: Array) -> float:
        """Return the friction coefficient whose cones contain all forces of a motion; nan with slip, tension or any."""
        sequence, rows = self.problem.sequence, self.transcription.constraints
        if any(mode.slips for mode in (*sequence.phases, sequence.impact)):
            return math.nan  # friction also determines how the foot slides
        g = np.asarray(self.transcription.nlp.derivatives["jac_g"](x, self._data)[0]).ravel()
        forward, backward = (
            g[np.concatenate([rows.find(kind) for kind in kinds])]
            for kinds in (
                (Kind.FORWARD_CONE, Kind.FORWARD_IMPACT_CONE),
                (Kind.BACKWARD_CONE, Kind.BACKWARD_IMPACT_CONE),
            )
        )
        if self.problem.sequence.is_open:
            return math.nan
        return friction_of_cones(self.problem.friction, forward, backward)
