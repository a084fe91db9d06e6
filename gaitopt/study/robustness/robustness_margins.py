"""Robustness margins of a controlled gait: the largest disturbance of each kind that it survives, by bisection."""

import contextlib
import functools
import math
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import field as entry
from pathlib import Path
from typing import Any

import numpy as np
from attrs import field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.dataclass import dataclass
from gaitopt.errors import GaitoptError, InputError, suggest
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.parallel.execution import Execution
from gaitopt.parallel.runner import run_tasks
from gaitopt.parallel.task_graph import Task
from gaitopt.parameters import check_type, positive, whole_number
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
from gaitopt.stability.recovery import PushTest, find_largest_recovery
from gaitopt.study.robustness.disturbed_gait import (
    DisturbedGait,
    PlanarDisturbedGait,
    SingleDisturbedGait,
    StepWalker,
    disturb_gait,
    reads_state,
)
from gaitopt.study.robustness.margin_log import MarginLog

DOUBLINGS = 6
"""Number of doublings from the first disturbance to the largest; survival may not be monotonic in between."""

LEAST, LEAST_DELAY = 1e-6, 1e-3
"""Smallest disturbance that is tried, relative to the largest.  A shorter delay has no practical effect, and a walk
with it takes long, since its time is divided into parts of the delay."""


@dataclass(frozen=True)
class RobustnessMargins:
    """The largest disturbance of one kind that is survived.

    Attributes
    ----------
    kind : str
    survived : float
        Largest disturbance survived, like all smaller ones tried; 0 if none is.
    failed : float or None
        Smallest disturbance not survived; None if the largest tried is survived.
    unit : str
    failures, ends : dict of str to int
        If only negligible pushes are survived: number of the walks after pushes of at most `failed` that do not return,
        by reason, and of those that end, by the key of their stop; see :class:`gaitopt.stability.Recovery`.

    Examples
    --------
    >>> RobustnessMargins("friction patch", 0.05, 0.06, "1").survived
    0.05
    """

    kind: str
    survived: float
    failed: float | None
    unit: str
    failures: Mapping[str, int] = entry(default_factory=dict)
    ends: Mapping[str, int] = entry(default_factory=dict)


@check_arguments
@frozen(kw_only=True)
class WalkTest:
    """Test of a disturbed walk: its number of steps, and the resolution of the margins.

    Attributes
    ----------
    steps : int
        Number of steps that count as survival.
    patch : int
        Number of steps on a patch of other friction.
    seed : int
        Seed of the torque noise.
    resolution : float
        Relative width to which a margin is located.

    Examples
    --------
    >>> WalkTest().steps
    50
    """

    steps: int = field(default=50, validator=whole_number())
    patch: int = field(default=5, validator=whole_number())
    seed: int = field(default=0, validator=whole_number(0))
    resolution: float = field(default=0.05, validator=positive(upper=1.0))


@check_arguments
def assess_robustness(
    robot: Robot | PlanarRobot,
    law: Law | PlanarLaw,
    cycle: Cycle | PlanarCycle,
    *,
    walking: WalkTest | None = None,
    test: PushTest | None = None,
    engine: Engine | PlanarEngine | None = None,
    execution: Execution | None = None,
    kinds: Sequence[str] | None = None,
) -> tuple[RobustnessMargins, ...]:
    """Return the largest disturbances a controlled gait survives, one kind at a time.

    Push: a change of the state after touchdown, from which all seeded starts return to the gait (:class:`Recovery`).
    Slope: a change of slope for all steps, uphill and downhill.  Friction patch: the drop of friction over the first
    steps.  Torque noise: standard deviation of seeded noise on each actuator, constant over a tenth of the step
    and added before the torque limits.  Sensor delay: age of the state the law reads (:mod:`gaitopt.simulation.delay`),
    up to half the period, omitted for a law that does not read the state.  Except for the push, a disturbance is
    survived if all steps are completed, even in another gait.

    Parameters
    ----------
    robot : Robot or PlanarRobot
    law : Law or PlanarLaw
    cycle : Cycle or PlanarCycle
        Gait of one step under the law.
    walking : WalkTest, optional
    test : PushTest, optional
    engine : Engine or PlanarEngine, optional
        As in :func:`gaitopt.assess_stability`; walks of robots with several contacts with noise or delay use scipy.
    execution : Execution, optional
        Workers, each of which tries one kind at a time, and the observer of (kinds tried, kinds in all); this process
        alone by default.
    kinds : sequence of str, optional
        Kinds of disturbances, such as ``["push", "sensor delay"]``; all that apply to robot and law by default.

    Raises
    ------
    InputError
        If a kind of disturbance does not apply to robot and law.
    GaitoptError
        If worker processes repeatedly terminate while they try a kind.

    Examples
    --------
    >>> from gaitopt import PushTest, assess_stability, compass_biped, computed_torque, load
    >>> gait, robot = load("docs/examples/compass_slip.h5"), compass_biped()
    >>> law = computed_torque(robot, gait.motion, stiffness=25, damping=10, torque_limit=8)
    >>> quick = WalkTest(steps=3, resolution=0.5)
    >>> cycle, push = assess_stability(gait, law), PushTest(starts=1, resolution=0.5)
    >>> [each.kind for each in assess_robustness(robot, law, cycle, walking=quick, test=push)]
    ['push', 'downhill slope', 'uphill slope', 'friction patch', 'torque noise', 'sensor delay']
    """
    gait = disturb_gait(robot, law, cycle, engine)
    margins = iterate_margins(gait, walking=walking, test=test, execution=execution, kinds=kinds)
    found = {margin.kind: margin for margin in margins}
    return tuple(found[kind] for kind in list_disturbances(robot, law, cycle) if kind in found)


def list_disturbances(robot: Robot | PlanarRobot, law: Law | PlanarLaw, cycle: Cycle | PlanarCycle) -> tuple[str, ...]:
    """Return the kinds of disturbances that apply to a gait under a law.

    Examples
    --------
    >>> from gaitopt import assess_stability, feedforward, load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> list_disturbances(gait.robot, feedforward(gait.robot, gait.motion), assess_stability(gait))
    ('push', 'downhill slope', 'uphill slope', 'friction patch', 'torque noise')
    """
    kinds = ["push", "downhill slope", "uphill slope"]
    if math.isfinite(cycle.parameters["friction"]):
        kinds.append("friction patch")
    if robot.n_u:
        kinds.append("torque noise")
        if reads_state(law):
            kinds.append("sensor delay")
    return tuple(kinds)


def iterate_margins(
    gait: SingleDisturbedGait | PlanarDisturbedGait,
    *,
    walking: WalkTest | None = None,
    test: PushTest | None = None,
    execution: Execution | None = None,
    kinds: Sequence[str] | None = None,
    log: Path | None = None,
) -> Generator[RobustnessMargins, None, None]:
    """Yield the largest disturbance of each kind when it is found; other parameters as in :func:`assess_robustness`.

    The searches write what they have found after each walk to the folder `log`, from where
    :func:`gaitopt.study.robustness.margin_log.read_margin_log` reads it.

    Examples
    --------
    >>> from gaitopt import assess_stability, feedforward, load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> law, quick = feedforward(gait.robot, gait.motion), WalkTest(steps=1, patch=1, resolution=1.0)
    >>> disturbed = disturb_gait(gait.robot, law, assess_stability(gait))
    >>> margins = iterate_margins(disturbed, walking=quick, kinds=["uphill slope"])
    >>> [margin.kind for margin in margins]
    ['uphill slope']
    """
    for name, value, kind in (
        ("walking", walking, WalkTest),
        ("test", test, PushTest),
        ("execution", execution, Execution),
    ):
        if value is not None:
            check_type(name, value, kind, f"an object such as {kind.__name__}()")
    setting = _MarginSearch(gait, gait.cycle, walking or WalkTest(), test or PushTest(), log)
    known = list_disturbances(gait.robot, gait.law, gait.cycle)
    for stated in kinds or ():
        if stated not in known:
            raise InputError(
                f"The disturbance {stated!r} does not apply to this gait and law. {suggest(stated, known)}"
            )
    planned = [Task(kind, kind) for kind in known if kinds is None or kind in kinds]
    execution, count = execution or Execution(), 0
    with contextlib.closing(run_tasks(_find_margin, planned, setting, execution=execution)) as running:
        for done in running:
            if done.failure:
                raise GaitoptError(f"The margin of the {done.task.key} was not computed: {done.failure}.")
            count += 1
            if execution.observer is not None:
                execution.observer(count, len(planned))
            yield done.result


@dataclass(frozen=True, eq=False)
class _MarginSearch:
    """A controlled gait and the tests of its disturbed walks."""

    gait: DisturbedGait
    cycle: Cycle | PlanarCycle
    walking: WalkTest
    test: PushTest
    log: Path | None = None

    def largest(self, kind: str, survives: Callable[[float], bool], most: float, unit: str) -> RobustnessMargins:
        """Double a disturbance until one is not survived, up to `most`, and bisect the last interval."""
        least = most * (LEAST_DELAY if kind == "sensor delay" else LEAST)
        lower, upper = 0.0, most / 2**DOUBLINGS
        log = MarginLog(self.log, kind, unit, 1 + DOUBLINGS + math.ceil(-math.log2(self.walking.resolution)))
        while survives(upper):
            log.add_trial(upper, None)
            if upper == most:
                return RobustnessMargins(kind, most, None, unit)
            lower, upper = upper, min(2 * upper, most)
        log.add_trial(lower, upper)
        while upper - lower > self.walking.resolution * upper and upper > least:
            middle = (lower + upper) / 2
            lower, upper = (middle, upper) if survives(middle) else (lower, middle)
            log.add_trial(lower, upper)
        return RobustnessMargins(kind, lower, upper, unit)

    def push_margin(self) -> RobustnessMargins:
        log = MarginLog(self.log, "push", "rad/s", self.test.most_walks)
        recovery = find_largest_recovery(self.gait.walker({}), self.cycle, self.test, log.add_push)
        beyond = recovery.beyond if math.isfinite(recovery.beyond) else None
        return RobustnessMargins("push", recovery.radius, beyond, "rad/s", recovery.failures, recovery.ends)

    def on_slope(self, sign: int, change: float) -> bool:
        tilted = self.gait.walker({"slope": self.cycle.parameters["slope"] + sign * change})
        return _walks(tilted, self.gait.start, self.walking.steps) is not None

    def on_patch(self, drop: float) -> bool:
        """Walk on ground with less friction, then on the nominal ground."""
        slippery = self.gait.walker({"friction": self.cycle.parameters["friction"] - drop})
        state = _walks(slippery, self.gait.start, self.walking.patch)
        rest = self.walking.steps - self.walking.patch
        return state is not None and _walks(self.gait.walker({}), state, rest) is not None

    def with_noise(self, deviation: float) -> bool:
        rng, state = np.random.default_rng(self.walking.seed), self.gait.start
        for _ in range(self.walking.steps):
            state = self.gait.noisy_walker(deviation, rng).walk_step(state).following
            if state is None:
                return False
        return True

    def with_delay(self, delay: float) -> bool:
        return _walks(self.gait.delayed_walker(delay), self.gait.start, self.walking.steps) is not None


def _find_margin(setting: _MarginSearch, kind: str) -> RobustnessMargins:
    """Run a task: find the largest disturbance of a kind."""
    parameters, period = setting.cycle.parameters, setting.cycle.period
    trials: dict[str, tuple[Callable[[float], bool], float, str]] = {
        "downhill slope": (functools.partial(setting.on_slope, 1), 0.2, "rad"),
        "uphill slope": (functools.partial(setting.on_slope, -1), 0.2, "rad"),
        "friction patch": (setting.on_patch, parameters["friction"], "1"),
        "torque noise": (setting.with_noise, *setting.gait.noise_range),
        "sensor delay": (setting.with_delay, period / 2, "s"),
    }
    return setting.push_margin() if kind == "push" else setting.largest(kind, *trials[kind])


def _walks(walker: StepWalker, state: Any, steps: int) -> Any | None:
    """Return the state after some steps, or None if the walk ends earlier."""
    for _ in range(steps):
        state = walker.walk_step(state).following
        if state is None:
            return None
    return state
