"""tune_feedback: gains that hold a gait, found on its return map and verified in the nonlinear simulator."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import minimize

from gaitopt.control.law import Law
from gaitopt.errors import InputError
from gaitopt.model.catalogue import robot_named
from gaitopt.model.robot import Robot
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array
from gaitopt.progress import Iteration, Observer, silent
from gaitopt.simulation.arc import Engine
from gaitopt.simulation.engines import default_engine
from gaitopt.simulation.walker import Walker
from gaitopt.stability.assessment import assess_stability
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.newton import find_fixed_point
from gaitopt.stability.one_sided import one_sided_derivatives
from gaitopt.stability.recovery import PushTest, Recovery, largest_recovery
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section
from gaitopt.tuning.design import Design
from gaitopt.tuning.objective import SpectralRadius, TuningObjective

HOPELESS = 1e6
"""Objective of gains under which there is no periodic gait near the planned one."""
NEAR = 1e-5
"""A point this near to its image is taken for the fixed point while searching."""


@dataclass(frozen=True)
class Trial:
    """One evaluation of a search.

    Attributes
    ----------
    gains : dict of str to float
    objective : float
        At the worst friction.

    Examples
    --------
    >>> Trial({"hip_stiffness": 20.0}, 0.4).objective
    0.4
    """

    gains: dict[str, float]
    objective: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Tuning:
    """A tuned law and how it was found.

    Attributes
    ----------
    law : Law
    design : str
    gains : dict of str to float
    objective : str
    radius_before : float
        Spectral radius in open loop; inf where the open loop has no periodic gait near the plan.
    radius_after : float
        Spectral radius with the tuned law, the best found even if it is not below 1.
    cycle : Cycle
        The periodic gait of the walker under the tuned law.
    fixed_point_shift : float
        Largest difference of its state after touchdown from the planned one.
    verified : Recovery
        From which starts walks return in the nonlinear simulator.
    trials : tuple of Trial
        The search, in order.
    evaluations : int
    seconds : float
        Of the search.

    Examples
    --------
    Made by :func:`gaitopt.tune_feedback`:

    >>> "radius_after" in Tuning.__dataclass_fields__
    True
    """

    law: Law
    design: str
    gains: dict[str, float]
    objective: str
    radius_before: float
    radius_after: float
    cycle: Cycle
    fixed_point_shift: float
    verified: Recovery
    trials: tuple[Trial, ...] = field(repr=False)
    evaluations: int
    seconds: float

    @property
    def stable(self) -> bool:
        """Whether the gait is held; if not, the best that was found is reported."""
        return self.radius_after < 1


@dataclass(frozen=True, kw_only=True)
class Search:
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
    >>> Search(evaluations=40).starts
    2
    """

    samples: int = 8
    starts: int = 2
    evaluations: int = 60
    seed: int = 0
    tolerance: float = 1e-3


def tune_feedback(
    gait: Gait,
    design: Design,
    *,
    objective: TuningObjective | None = None,
    frictions: Sequence[float] = (),
    search: Search | None = None,
    test: PushTest | None = None,
    robot: Robot | None = None,
    engine: Engine | None = None,
    observer: Observer = silent,
) -> Tuning:
    """Tune the gains of a law until it holds a gait best, and verify the tuned law by walks in the simulator.

    Parameters
    ----------
    gait : Gait
    design : Design
    objective : TuningObjective, optional
        The spectral radius by default.
    frictions : sequence of float
        Frictions of the ground among which the worst counts, besides the gait's own; the law does not know them.
    search : Search, optional
    test : PushTest, optional
        Of the verification: walks from seeded starts.
    robot : Robot, optional
        Needed for a robot that is not in gaitopt's catalogue.
    engine : Engine, optional
    observer : callable, optional
        Receives an :class:`gaitopt.Iteration` per evaluation: its objective, and that of the best so far.

    Returns
    -------
    Tuning
        Look at `stable` first: a gait that cannot be held with this law is reported with the best radius found.

    Raises
    ------
    InputError
        If the gait is not a solution, or there is no periodic gait near it under any gains tried.

    Examples
    --------
    >>> from gaitopt import PushTest, Search, compass_biped, design_named, load, tune_feedback
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> design = design_named("computed-torque", compass_biped(), gait.motion, torque_limit=8)
    >>> tuned = tune_feedback(gait, design, search=Search(samples=2, starts=1, evaluations=8), test=PushTest(starts=1))
    >>> tuned.radius_after < 0.2 < tuned.radius_before
    True
    """
    gait.require()
    robot, search = robot or robot_named(gait.robot), search or Search()
    began = time.perf_counter()
    task = _Task(gait, robot, design, objective or SpectralRadius(), tuple(frictions), engine, observer)
    best = task.search(search)
    if best.objective >= HOPELESS:
        raise InputError(f"Under no gains tried the law {design.name!r} has a periodic gait near the planned one.")
    seconds = time.perf_counter() - began
    law = design.law(best.gains)
    cycle = assess_stability(gait, law, robot=robot, engine=engine)
    walker = Walker(
        robot, law, robot.vector(cycle.parameters), engine or default_engine(law), step_time_limit=3 * gait.period
    )
    return Tuning(
        law=law,
        design=design.name,
        gains=best.gains,
        objective=task.objective.name,
        radius_before=_open_loop(gait, robot, engine),
        radius_after=cycle.radius,
        cycle=cycle,
        fixed_point_shift=fixed_point_shift(gait, cycle),
        verified=largest_recovery(walker, cycle, test),
        trials=tuple(task.trials),
        evaluations=len(task.trials),
        seconds=seconds,
    )


def fixed_point_shift(gait: Gait, cycle: Cycle) -> float:
    """Return the largest difference of a periodic gait's state after touchdown from a planned one's."""
    first = gait.motion.segments[0]
    return float(np.max(np.abs(cycle.section.embed(cycle.z) - np.concatenate([first.q[:, 0], first.v[:, 0]]))[2:]))


def _open_loop(gait: Gait, robot: Robot, engine: Engine | None) -> float:
    try:
        return assess_stability(gait, robot=robot, engine=engine).radius
    except InputError:
        return float("inf")


class _Task:
    """The search's view of a gait: an objective of gains."""

    def __init__(
        self,
        gait: Gait,
        robot: Robot,
        design: Design,
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

    def search(self, search: Search) -> Trial:
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
            return HOPELESS  # no such law: a Riccati equation without solution
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
                return HOPELESS
            z, passage = point.z, point.passage
            self._points[k] = z
        sides = one_sided_derivatives(returning.walker, passage.states[0], passage.strides[0])
        matrices = sides or (returning.derivative(z, passage),)
        return max(self.objective(matrix, self._scale) for matrix in matrices)


def _simplex(share: Array) -> Array:
    """Return the first simplex of a start: steps of 0.15, away from the nearer bound."""
    steps = np.where(share > 0.5, -0.15, 0.15)
    return np.vstack([share, share + np.diag(steps)])
