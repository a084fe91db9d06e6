"""Search for gains: minimisation of an objective of the return map's derivative by the simplex method."""

from collections.abc import Mapping

import numpy as np
from attrs import field, frozen
from scipy.optimize import minimize

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.errors import InputError
from gaitopt.interrupts import InterruptRecord
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import AnyGait
from gaitopt.parameters import positive, whole_number
from gaitopt.progress import TuningObserver, TuningStep
from gaitopt.reductions import rank_of, worst
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine
from gaitopt.tuning.controller_family import ControllerFamily
from gaitopt.tuning.ground_map import GroundMap, make_ground_map
from gaitopt.tuning.record import Trial
from gaitopt.tuning.tuning_objective import TuningObjective

INFEASIBLE_PENALTY = 1e6
"""Objective of gains without a law or without a periodic gait near the planned one."""


@check_arguments
@frozen(kw_only=True)
class GainSearchOptions:
    """Options of the search for gains by the simplex method of Nelder and Mead from several starts.

    Attributes
    ----------
    samples : int
        Number of random sets of gains evaluated first, in addition to the start of the family.
    starts : int
        Number of the best of these that start the simplex method.
    evaluations : int
        Maximum number of evaluations of each start; `evaluations_in_total` is that of the whole search.
    seed : int
    tolerance : float
        Change of the objective below which the simplex method ends.

    Examples
    --------
    >>> GainSearchOptions(evaluations=40).starts
    2
    """

    samples: int = field(default=8, validator=whole_number(0))
    starts: int = field(default=2, validator=whole_number())
    evaluations: int = field(default=60, validator=whole_number())
    seed: int = field(default=0, validator=whole_number(0))
    tolerance: float = field(default=1e-3, validator=positive())

    @property
    def simplex_searches(self) -> int:
        """Number of searches by the simplex method: one from each start, at most one from each set of gains."""
        return min(self.starts, 1 + self.samples)

    @property
    def evaluations_in_total(self) -> int:
        """Maximum number of evaluations: the start of the family, the random gains, and those of the starts."""
        return 1 + self.samples + self.simplex_searches * self.evaluations


class _SearchStopped(Exception):
    """Ends the simplex method, also during an evaluation; not KeyboardInterrupt, which a second Ctrl-C raises."""


class GainSearch:
    """Minimises the objective of a gait under a law as a function of gains.

    Parameters
    ----------
    gait : Gait or PlanarGait
    robot : Robot or PlanarRobot
    family : ControllerFamily
    objective : TuningObjective
    frictions : tuple of float or mapping
        Friction coefficients, or values of several parameters by name, in addition to those of the gait.
    engine : Engine, PlanarEngine or None
    observer : callable

    Attributes
    ----------
    trials : list of Trial
        Evaluations in order.
    interrupted : bool
        Whether the search ended before its time because of Ctrl-C.
    """

    def __init__(
        self,
        gait: AnyGait,
        robot: Robot | PlanarRobot,
        family: ControllerFamily,
        objective: TuningObjective,
        frictions: tuple[float | Mapping[str, float], ...],
        engine: Engine | PlanarEngine | None,
        observer: TuningObserver,
    ) -> None:
        self.family, self.objective, self.trials = family, objective, list[Trial]()
        self.interrupted, self._interrupt = False, InterruptRecord()
        self._observer, self._limit, planned = observer, 0, gait.motion.parameters
        changes = [dict(each) if isinstance(each, Mapping) else {"friction": each} for each in frictions]
        grounds = [planned, *(robot.resolve({**planned, **change}) for change in changes)]
        self._grounds = [make_ground_map(gait, ground, engine) for ground in grounds]

    def search(self, search: GainSearchOptions, interrupt: InterruptRecord | None = None) -> Trial:
        """Minimise the objective and return the best trial; once a Ctrl-C is recorded, the best one so far."""
        self._limit, self._interrupt = search.evaluations_in_total, interrupt or self._interrupt
        try:
            self._minimise(search)
        except _SearchStopped:
            self.interrupted = True
        return min(self.trials, key=lambda trial: rank_of(trial.objective))

    def _minimise(self, search: GainSearchOptions) -> None:
        """Evaluate the start of the family and random gains, then search from the best of them."""
        gains, rng = self.family.gains, np.random.default_rng(search.seed)
        begin = [np.array([gain.share for gain in gains]), *rng.uniform(size=(search.samples, len(gains)))]
        ranked = sorted(begin, key=lambda share: self(share))
        options = {"maxfev": search.evaluations, "fatol": search.tolerance, "xatol": 1e-3}
        for share in ranked[: search.starts]:
            simplex = {"initial_simplex": _simplex(share)}
            minimize(self, share, method="Nelder-Mead", bounds=[(0, 1)] * len(gains), options=options | simplex)

    def __call__(self, share: Array) -> float:
        """Return the objective of gains given as fractions of the way between bounds, and record it as a trial."""
        gains = {gain.name: gain.at(at) for gain, at in zip(self.family.gains, share.tolist(), strict=True)}
        value = self._value(gains)
        self.trials.append(Trial(gains, value))
        best = min(rank_of(trial.objective) for trial in self.trials)
        self._observer(TuningStep(len(self.trials), value, best, self._limit))
        if self._interrupt.received and len(self.trials) < self._limit:
            raise _SearchStopped
        return value

    def _check(self) -> None:
        """End the search during an evaluation after a Ctrl-C; the first evaluation is completed."""
        if self._interrupt.received and self.trials:
            raise _SearchStopped

    def _value(self, gains: Mapping[str, float]) -> float:
        try:
            law = self.family.law(gains)
        except InputError:
            return INFEASIBLE_PENALTY  # no law exists, for example if a Riccati equation has no solution
        return worst(*(self._on_ground(law, ground) for ground in self._grounds))

    def _on_ground(self, law: Law | PlanarLaw, ground: GroundMap) -> float:
        """Return the objective of a law on one ground."""
        matrices = ground.derivatives(law, self._check)
        if not matrices or not all(np.all(np.isfinite(matrix)) for matrix in matrices):
            return INFEASIBLE_PENALTY
        return worst(*(self.objective(matrix, np.broadcast_to(ground.scale, len(matrix))) for matrix in matrices))


def _simplex(share: Array) -> Array:
    """Return the initial simplex of a start: steps of 0.15, away from the nearer bound."""
    steps = np.where(share > 0.5, -0.15, 0.15)
    return np.vstack([share, share + np.diag(steps)])
