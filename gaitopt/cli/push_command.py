"""The command that tests the robustness of a gait under a law."""

import contextlib
import math
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.cli.engine_advice import EngineAdvice, engine_for_walks
from gaitopt.cli.law_option import OPEN_LOOP, law_of_gait, law_title
from gaitopt.cli.options import (
    Disturbances,
    DisturbedSteps,
    EngineName,
    GainValues,
    Json,
    LawName,
    PushOutput,
    PushRadius,
    PushStarts,
    Quiet,
    RobotScript,
    Scheduler,
    Source,
    StanceAngle,
    TorqueLimit,
    Verbose,
    Workers,
)
from gaitopt.cli.output import INTERRUPTED, err, print_json, report_file
from gaitopt.cli.progress_display import show_progress
from gaitopt.cli.push_output import RECOVERY, endurance_facts, format_limits, print_endurance, resume_text
from gaitopt.cli.workers import WorkerOptions, worker_options
from gaitopt.dataclass import dataclass
from gaitopt.errors import ArchiveError, InputError, suggest
from gaitopt.interrupts import defer_interrupt

if TYPE_CHECKING:
    from gaitopt.control.law import Law
    from gaitopt.control.planar_laws.planar_law import PlanarLaw
    from gaitopt.motion.planar_gait import AnyGait
    from gaitopt.simulation.engine import Engine
    from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine
    from gaitopt.stability.cycle import Cycle
    from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
    from gaitopt.stability.recovery import PushTest, Recovery
    from gaitopt.study.robustness.margin_log import UnfinishedMargin
    from gaitopt.study.robustness.robustness_margins import RobustnessMargins
    from gaitopt.study.robustness.robustness_record import RobustnessRecord

WORDS = {
    "law": "the law",
    "radius": "the spectral radius",
    "steps": "--steps",
    "starts": "--starts",
    "ball": "--ball",
    "friction": "the friction",
    "torque_limits": "torque limits",
}
"""Settings of a push test in messages."""

SAME_RADIUS = 1e-6
"""Relative difference of the spectral radii of the same gait and law, computed twice."""


def push(
    file: Source,
    problem: RobotScript = None,
    law: LawName = OPEN_LOOP,
    gain: GainValues = None,
    torque_limit: TorqueLimit = None,
    stance_angle: StanceAngle = False,
    steps: DisturbedSteps = 50,
    starts: PushStarts = 50,
    ball: PushRadius = 0.1,
    kind: Disturbances = None,
    engine: EngineName = "auto",
    workers: Workers = None,
    scheduler: Scheduler = None,
    output: PushOutput = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Find the largest push, change of slope, loss of friction, noise and delay that a gait survives under a law.

    After a touchdown, a push changes the state in a random direction; a size is survived if the walker returns to the
    gait after all random pushes of at most this size.  The change of slope lasts for all steps.  The loss of friction,
    called friction patch in the results, lasts for the first five steps of the walk; --patch of 'gaitopt simulate'
    states the friction itself instead.  The noise is the standard deviation of a random torque on each actuator, and
    the delay is the age of the state that the law receives from the sensors.

    For a robot with several contacts, a push changes coordinates and rates right after a landing and moves no foot off
    the ground; the noise acts on the actuators with a planned torque.  The problem script is accepted in place of the
    gait file, and is solved first.

    The fraction of pushes in a ball after which the walker returns to the gait, and the number of steps that this
    takes, are reported in open loop (torques replayed) and under the law.

    After Ctrl-C, the same command with the same output file tests the kinds of disturbances that are missing.

    Example: gaitopt push compass_slip.h5 --law lqr
    """
    from gaitopt.cli.script import load_feedback_gait
    from gaitopt.stability.assessment import assess_stability
    from gaitopt.stability.recovery import PushTest
    from gaitopt.study.robustness.robustness_record import RobustnessRecord

    began = time.perf_counter()
    gait = load_feedback_gait(file, problem)
    chosen, title = law_of_gait(gait, law, gain, torque_limit, stance_angle), law_title(law, stance_angle)
    used, test = engine_for_walks(gait, chosen, engine, hidden=json or quiet), PushTest(starts=starts)
    advice = EngineAdvice(hidden=json or quiet)
    cycle = assess_stability(gait, chosen, engine=used)
    advice.give(_choose_engine(chosen, gait, used))
    tested = _ControlledGait(gait=gait, law=chosen, cycle=cycle, test=test, engine=used)
    settings: dict[str, Any] = {"law": title, "radius": cycle.radius, "steps": steps, "starts": starts, "ball": ball}
    settings |= {"friction": cycle.parameters["friction"], "torque_limits": _name_limits(gait, chosen)}
    results = _resume(output, settings, _read_kinds(tested, kind), _read_kinds(tested, None))
    with results.keep_results():
        with worker_options(workers, scheduler) as team:
            tested.find_margins(results, steps, team, hidden=json)
        tested.measure_recoveries(results, title, ball, hidden=json)
    record = RobustnessRecord(**settings, **results.parts)
    facts = {"law": title, "engine": _choose_engine(chosen, gait, used).name, "radius": cycle.radius, "steps": steps}
    facts |= {**endurance_facts(record), "seconds": time.perf_counter() - began}
    facts |= {"unfinished": [found._asdict() for found in results.unfinished]} if record.missing else {}
    with defer_interrupt():  # a repeated one must not lose the finished kinds
        for unfinished in results.unfinished:
            err.print(f"Incomplete: {unfinished}.", soft_wrap=True)
        _report(record, facts, output, json=json)
    if record.missing:
        sys.exit(INTERRUPTED)  # not typer.Exit, which would report that nothing was written


def _report(record: "RobustnessRecord", facts: dict[str, Any], output: Path | None, *, json: bool) -> None:
    """Write and print the results, and how the kinds are tested that an interrupt left without result."""
    from gaitopt.study.robustness.robustness_record import save_robustness

    written = None if output is None else save_robustness(record, output)
    if json:
        print_json(facts)
    else:
        print_endurance(facts, dict(record.recoveries))
        if written is not None:
            report_file(written)
    if record.missing:
        err.print(f"Interrupted. {resume_text(record.missing, output)}", soft_wrap=True)


@dataclass(kw_only=True)
class _Results:
    """The results of a push test as they are found.

    Attributes
    ----------
    kinds : tuple of str
        Kinds of disturbances, and ``"recovery"`` for the recoveries from a ball of pushes, in the order of the table.
    margins : dict of str to RobustnessMargins
        By their kinds.
    recoveries : dict of str to (Recovery or None)
        By the names of the laws; empty until all are measured.
    unfinished : list of UnfinishedMargin
        Intervals in which the searches were that an interrupt ended.
    """

    kinds: tuple[str, ...]
    margins: "dict[str, RobustnessMargins]" = field(default_factory=dict)
    recoveries: "dict[str, Recovery | None]" = field(default_factory=dict)
    unfinished: "list[UnfinishedMargin]" = field(default_factory=list)

    @property
    def missing(self) -> tuple[str, ...]:
        """Kinds without a result."""
        measured = {*self.margins, *([RECOVERY] if self.recoveries else [])}
        return tuple(kind for kind in self.kinds if kind not in measured)

    @property
    def parts(self) -> dict[str, Any]:
        """The results as attributes of a record."""
        margins = tuple(self.margins[kind] for kind in self.kinds if kind in self.margins)
        return {"margins": margins, "recoveries": self.recoveries, "missing": self.missing}

    @contextlib.contextmanager
    def keep_results(self) -> Iterator[None]:
        """End a block at Ctrl-C; without any result, the interrupt is raised."""
        try:
            yield
        except KeyboardInterrupt:
            if not (self.margins or self.recoveries or self.unfinished):
                raise


@dataclass(frozen=True, kw_only=True, eq=False)
class _ControlledGait:
    """A gait under a law, its periodic motion, its test by pushes, and the stated engine."""

    gait: "AnyGait"
    law: "Law | PlanarLaw"
    cycle: "Cycle | PlanarCycle"
    test: "PushTest"
    engine: "Engine | PlanarEngine | None"

    def find_margins(self, results: _Results, steps: int, team: WorkerOptions, *, hidden: bool) -> None:
        """Add the largest disturbance survived of each kind to the results."""
        from gaitopt.study.robustness.disturbed_gait import disturb_gait
        from gaitopt.study.robustness.margin_log import read_margin_log
        from gaitopt.study.robustness.robustness_margins import WalkTest, iterate_margins

        kinds = [kind for kind in results.missing if kind != RECOVERY]
        if not kinds:
            return
        with (
            tempfile.TemporaryDirectory() as folder,
            show_progress("push test", hidden=hidden, counted="kinds of disturbances") as display,
        ):
            log = Path(folder)
            display.detail = lambda kind: "" if (found := read_margin_log(log, kind)) is None else found.progress
            margins = iterate_margins(
                disturb_gait(self.gait.robot, self.law, self.cycle, self.engine),
                walking=WalkTest(steps=steps),
                test=self.test,
                execution=team.execution(display.count, active_observer=display.show_active),
                kinds=kinds,
                log=log,
            )
            try:
                with contextlib.closing(margins):  # an interrupt also ends the workers
                    for margin in margins:
                        results.margins[margin.kind] = margin
            except KeyboardInterrupt:
                logs = [read_margin_log(log, kind) for kind in results.missing]
                results.unfinished += [found for found in logs if found is not None]
                raise

    def measure_recoveries(self, results: _Results, title: str, ball: float, *, hidden: bool) -> None:
        """Add the recovery from a ball of pushes under the law and in open loop; None without a periodic gait."""
        from gaitopt.stability.gait_recovery import measure_gait_recovery

        if RECOVERY not in results.missing:
            return
        recoveries = {}
        with show_progress("pushes", hidden=hidden) as display:
            for name, law in {title: self.law, "open loop": law_of_gait(self.gait, OPEN_LOOP)}.items():
                display.describe(f"pushes up to {ball:g} rad/s, {name}")
                recoveries[name] = measure_gait_recovery(self.gait, law, ball, self.test, self.engine)
        results.recoveries.update(recoveries)


def _resume(output: Path | None, settings: dict[str, Any], kinds: tuple[str, ...], known: tuple[str, ...]) -> _Results:
    """Return the results of the interrupted test in the output file, or none; InputError if it is another one."""
    from gaitopt.study.robustness.robustness_record import load_robustness

    record = None
    if output is not None and output.is_file():
        with contextlib.suppress(ArchiveError):  # another file, which is replaced
            record = load_robustness(output)
    if record is None or not record.missing:
        return _Results(kinds=kinds)
    if not record.starts or math.isnan(record.ball):
        raise InputError(
            f"{output} contains an interrupted push test of an earlier version of gaitopt. It cannot be completed, "
            "since its --starts and --ball are not known: delete the file, or state another output file with -o."
        )
    for name, value in settings.items():
        if _is_known(stored := getattr(record, name)) and not _agree(stored, value):
            raise InputError(
                f"{output} contains an interrupted push test with {WORDS.get(name, name)} {_show(stored)}, not "
                f"{_show(value)}. Complete it with its own options, or state another output file."
            )
    margins = {margin.kind: margin for margin in record.margins}
    requested = {*margins, *([RECOVERY] if record.recoveries else []), *record.missing, *kinds}
    complete = tuple(kind for kind in known if kind in requested)
    return _Results(kinds=complete, margins=margins, recoveries=dict(record.recoveries))


def _agree(stored: object, value: object) -> bool:
    """Return whether a setting of a file is that of the command; infinite numbers are not stored as such."""
    if not isinstance(value, float) or not isinstance(stored, float):
        return stored == value
    return math.isclose(stored, value, rel_tol=SAME_RADIUS) or not (math.isfinite(stored) or math.isfinite(value))


def _is_known(setting: object) -> bool:
    """Return whether a file contains a setting; files of earlier versions lack friction and torque limits."""
    return setting is not None and not (isinstance(setting, float) and math.isnan(setting))


def _show(value: object) -> str:
    """Return a setting as text."""
    if isinstance(value, Mapping):
        return format_limits(value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _name_limits(gait: "AnyGait", law: "Law | PlanarLaw") -> dict[str, float]:
    """Return the torque limits of a law by actuator; units other than N m follow the names."""
    from gaitopt.control.torque_saturation import name_limits
    from gaitopt.motion.view_motion import view_motion

    units = {actuator.name: actuator.unit for actuator in view_motion(gait.motion).actuators}
    limits = name_limits(law, gait.robot.actuators)
    return {name if units[name] == "N m" else f"{name} [{units[name]}]": limit for name, limit in limits.items()}


def _read_kinds(tested: _ControlledGait, stated: Sequence[str] | None) -> tuple[str, ...]:
    """Return the kinds of disturbances of the options of the command; InputError if one does not apply."""
    from gaitopt.study.robustness.robustness_margins import list_disturbances

    known = (*list_disturbances(tested.gait.robot, tested.law, tested.cycle), RECOVERY)
    names = {name.replace("-", " ").replace("_", " ").strip() for name in stated or known}
    if unknown := sorted(names.difference(known)):
        raise InputError(f"--kind {unknown[0]!r} does not apply to this gait and law. {suggest(unknown[0], known)}")
    return tuple(kind for kind in known if kind in names)


def _choose_engine(
    law: "Law | PlanarLaw", gait: "AnyGait", stated: "Engine | PlanarEngine | None"
) -> "Engine | PlanarEngine":
    """Return the engine that simulates the walks of a gait."""
    from gaitopt.control.law import Law
    from gaitopt.motion.gait import Gait
    from gaitopt.simulation.engine_choice import choose_engine, choose_planar_engine

    if isinstance(gait, Gait) and isinstance(law, Law):
        return choose_engine(stated, law, gait.robot)
    return choose_planar_engine(stated)
