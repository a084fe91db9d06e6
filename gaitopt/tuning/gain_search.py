"""The search for gains: an objective of the return map's derivative, made small by the simplex method."""

from collections.abc import Mapping

import numpy as np
from attrs import field, frozen
from scipy.optimize import minimize

from gaitopt.control.law import Law
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array
from gaitopt.parameters import counted, positive
from gaitopt.progress import Iteration, Observer
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.fixed_point import find_fixed_point
from gaitopt.stability.one_sided import one_sided_derivatives
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section
from gaitopt.tuning.controller_family import ControllerFamily
from gaitopt.tuning.objective import TuningObjective
from gaitopt.tuning.record import Trial

LARGE_VIOLATION = 1e6
"""Objective of gains under which there is no periodic gait near the planned one."""
NEAR = 1e-5
"""A point this near to its image is taken for the fixed point while searching."""


@frozen(kw_only=True)
class GainSearchOptions:
    """How gains are looked for: the simplex method of Nelder and Mead, which needs no derivatives, from several starts.

    Attributes
    ----------
    samples : int
        Random gains tried first, besides the design's start.
    starts : int
        From how many of the best of these the simplex method starts.
    evaluations : int
        Most evaluations of each start.
    seed : int
    tolerance : float
        Change of the objective below which a start ends.

    Examples
    --------
    >>> GainSearchOptions(evaluations=40).starts
    2
    """

    samples: int = field(default=8, validator=counted(0))
    starts: int = field(default=2, validator=counted())
    evaluations: int = field(default=60, validator=counted())
    seed: int = field(default=0, validator=counted(0))
    tolerance: float = field(default=1e-3, validator=positive())


class GainSearch:
    """A gait, a law and an objective as a function of gains, to be made small.

    Parameters
    ----------
    gait : Gait
    robot : Robot
    design : Design
    objective : TuningObjective
    frictions : tuple of float
        Of the ground, besides the gait's own.
    engine : Engine or None
    observer : callable

    Attributes
    ----------
    trials : list of Trial
        In order.
    """

    def __init__(
        self,
        gait: Gait,
        robot: Robot,
        design: ControllerFamily,
        objective: TuningObjective,
        frictions: tuple[float, ...],
        engine: Engine | None,
        observer: Observer,
    ) -> None:
        self.design, self.objective, self.trials = design, objective, list[Trial]()
        self._robot, self._engine, self._observer = robot, engine, observer
        self._patience = 3 * gait.period
        own = gait.motion.parameters
        self._grounds = [robot.vector(own)]
        self._grounds += [robot.vector(robot.resolve({**own, "friction": mu})) for mu in frictions]
        first = gait.motion.segments[0]
        self._sections = [Section(robot, p, sliding=True) for p in self._grounds]
        start = np.concatenate([first.q[:, 0], first.v[:, 0]])
        self._points = [section.project(start) for section in self._sections]
        n_a = len(robot.angles)
        self._scale = np.array([0.1] * (n_a - 1) + [0.5] * n_a + [0.5])

    def search(self, search: GainSearchOptions) -> Trial:
        """Return the best trial."""
        gains, rng = self.design.gains, np.random.default_rng(search.seed)
        begin = [np.array([gain.share for gain in gains]), *rng.uniform(size=(search.samples, len(gains)))]
        ranked = sorted(begin, key=lambda share: self(share))
        options = {"maxfev": search.evaluations, "fatol": search.tolerance, "xatol": 1e-3}
        for share in ranked[: search.starts]:
            simplex = {"initial_simplex": _simplex(share)}
            minimize(self, share, method="Nelder-Mead", bounds=[(0, 1)] * len(gains), options=options | simplex)
        return min(self.trials, key=lambda trial: trial.objective)

    def __call__(self, share: Array) -> float:
        """Return the objective of gains given by their shares of the way between bounds, and keep it as a trial."""
        gains = {gain.name: gain.at(at) for gain, at in zip(self.design.gains, share.tolist(), strict=True)}
        value = self._value(gains)
        self.trials.append(Trial(gains, value))
        best = min(trial.objective for trial in self.trials)
        self._observer(Iteration(len(self.trials), value, best))
        return value

    def _value(self, gains: Mapping[str, float]) -> float:
        try:
            law = self.design.law(gains)
        except InputError:
            return LARGE_VIOLATION  # no such law: a Riccati equation without solution
        return max(self._on_ground(law, k) for k in range(len(self._grounds)))

    def _on_ground(self, law: Law, k: int) -> float:
        """Return the objective of a law on one ground; the fixed point is looked for from the last one found there."""
        p, section, engine = self._grounds[k], self._sections[k], self._engine or default_engine(law)
        returning = ReturnMap(Walker(self._robot, law, p, engine, step_time_limit=self._patience), section)
        z = self._points[k]
        passage = returning(z)
        if passage.end is None or np.max(np.abs(passage.end - z)) > NEAR:
            point = find_fixed_point(returning, z)
            if point is None:
                return LARGE_VIOLATION
            z, passage = point.z, point.passage
            self._points[k] = z
        sides = one_sided_derivatives(returning.walker, passage.states[0], passage.strides[0])
        matrices = sides or (returning.derivative(z, passage),)
        return max(self.objective(matrix, self._scale) for matrix in matrices)


def _simplex(share: Array) -> Array:
    """Return the first simplex of a start: steps of 0.15, away from the nearer bound."""
    steps = np.where(share > 0.5, -0.15, 0.15)
    return np.vstack([share, share + np.diag(steps)])
