"""Commands on walks: stability, simulate."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import numpy as np
import typer

from gaitopt.cli.law_option import OPEN_LOOP, describe_law, find_feedback, law_title
from gaitopt.cli.options import (
    CyclePeriod,
    CycleStarts,
    EngineName,
    FigureWidth,
    FontSize,
    GainValues,
    Json,
    LawName,
    Patch,
    Quiet,
    Rise,
    RobotScript,
    Setting,
    Source,
    StanceAngle,
    State,
    TorqueLimit,
    Verbose,
    WalkSetting,
)
from gaitopt.cli.output import INTERRUPTED, err, print_json, print_reason, report_file
from gaitopt.cli.progress_display import estimate_remaining_time, show_progress
from gaitopt.cli.settings import read_numbers, read_terrain
from gaitopt.errors import InputError

if TYPE_CHECKING:
    from gaitopt.cli.inputs import Request
    from gaitopt.cli.planar_law_option import PlanarLawOption
    from gaitopt.cli.progress_display import Display
    from gaitopt.cli.walk_file import WalkFile
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.model.terrain import Terrain
    from gaitopt.simulation.planar_simulation.planar_simulator import PlanarRollout
    from gaitopt.simulation.simulator import Rollout

    PlanarWalk = tuple[PlanarRollout, tuple[str, ...], PlanarRobot]

PLANE = (
    "--rise and --patch apply to robots with several contacts (assemble_planar), such as compass_with_two_feet. The "
    "ground of a robot with one foot on the ground at a time is a plane with one friction coefficient: --set "
    "friction=VALUE changes it for the whole walk, and 'gaitopt push' decreases it for the first five steps."
)
NO_GAIT = "no periodic gait found; try more --starts or another slope or friction"


def stability(
    source: Source,
    setting: Setting = None,
    problem: RobotScript = None,
    starts: CycleStarts = 32,
    steps: CyclePeriod = 1,
    engine: EngineName = "auto",
    law: LawName = OPEN_LOOP,
    gain: GainValues = None,
    torque_limit: TorqueLimit = None,
    stance_angle: StanceAngle = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Find the periodic gaits of a walker, or take a saved gait, and compute their exact Floquet multipliers.

    A saved gait, or the optimal gait of a script that returns a PlanarProblem, is assessed in open loop, with its
    torques replayed, or under the given feedback law.

    Exit status 0 if a gait was found (stable or not), 1 otherwise.

    Example: gaitopt stability problems/compass_passive.py --set friction=0.14 --steps 2
    """
    from gaitopt.cli.inputs import Request, read_input
    from gaitopt.cli.planar_law_option import PlanarLawOption
    from gaitopt.cli.planar_walks import explain_no_gait, find_planar_gaits, report_planar_cycles
    from gaitopt.cli.verification_warning import warn_about_verification
    from gaitopt.cli.walk_output import print_cycles
    from gaitopt.stability.cycle_summary import summarise_cycle

    feedback = find_feedback(law, gain, torque_limit, stance_angle)
    request = Request(source=source, settings=setting or [], script=problem, engine=engine, feedback=feedback)
    with show_progress("searching for periodic gaits", hidden=json):
        option = PlanarLawOption(law, gain or [], torque_limit, stance_angle)
        cycles = find_planar_gaits(request, starts, steps=steps, law=option)
        subject = read_input(request, starts, steps=steps) if cycles is None else None
    verified = None if request.is_script else warn_about_verification(request.gait, source, hidden=json)
    if subject is None:
        report_planar_cycles(cycles or (), engine, describe_law(law, stance_angle), verified, json=json)
        _remark_on_sequence(request, [cycle.sequence for cycle in cycles or ()])
        if not cycles:
            print_reason(NO_GAIT)
            err.print(explain_no_gait(request, engine), soft_wrap=True)
        raise typer.Exit(0 if cycles else 1)
    if json:
        gaits = [summarise_cycle(cycle) for cycle in subject.gaits]
        print_json({"engine": subject.engine.name, "gaits": gaits, "gait_verified": verified})
    else:
        print_cycles(subject.gaits, subject.engine, describe_law(law, stance_angle, subject.law.gain_values))
    _remark_on_sequence(request, [cycle.sequence for cycle in subject.gaits])
    if not subject.gaits:
        print_reason(NO_GAIT)
    raise typer.Exit(0 if subject.gaits else 1)


def _remark_on_sequence(request: "Request", found: Sequence[str]) -> None:
    """Remark if the periodic gait of a saved gait has another contact sequence than the plan."""
    if request.is_script or not found or found[0] == (planned := str(request.gait.sequence)):
        return
    err.print(
        f"The periodic gait has the contact sequence {found[0]!r}, the plan {planned!r}: small deviations change the "
        "modes of contacts, as where a force or an impulse of the plan is close to the boundary of its friction cone.",
        soft_wrap=True,
    )


def simulate(
    source: Source,
    setting: WalkSetting = None,
    problem: RobotScript = None,
    state: State = None,
    steps: Annotated[int, typer.Option(min=1, max=100000, help="Number of steps.")] = 10,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="CSV/PNG/GIF", help="File of the trajectories, or of a figure or an animation."
        ),
    ] = None,
    width: FigureWidth = 7.2,
    font_size: FontSize = 8.5,
    engine: EngineName = "auto",
    law: LawName = OPEN_LOOP,
    gain: GainValues = None,
    torque_limit: TorqueLimit = None,
    stance_angle: StanceAngle = False,
    rise: Rise = None,
    patch: Patch = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Simulate steps from a periodic gait, or from a state nearby, and log every contact event.

    A saved gait, or the optimal gait of a script that returns a PlanarProblem, is simulated in open loop, with its
    torques replayed, or under the given feedback law.  For a saved gait, --set changes parameters of robot and ground,
    such as friction=0.2, in the simulation only: torques and law remain those for the parameters in the file, and the
    walk starts in the state of the gait.

    A step of a robot with several contacts is a period of its gait.  The suffix of the output determines its format:
    a table (.csv), a figure (.png, .pdf, .svg) or an animation (.gif, .mp4).  --rise and --patch change the ground
    under such a robot; positions are measured along the ground in the coordinates of the robot.

    Exit status 0 if all steps were completed, 1 if the walk ended earlier. Ctrl-C ends the walk of a robot with several
    contacts, which is reported until its last event, with exit status 130.

    Example: gaitopt simulate problems/compass_passive.py --state th1_rate=0.8 --steps 20 -o walk.csv
    """
    from gaitopt.cli.inputs import Request
    from gaitopt.cli.planar_law_option import PlanarLawOption
    from gaitopt.cli.walk_file import WalkFile

    feedback = find_feedback(law, gain, torque_limit, stance_angle)
    file = WalkFile(output, width, font_size)
    saved = source.suffix != ".py"
    settings, changes = ([], read_numbers(setting, "--set")) if saved else (setting or [], {})
    request = Request(source=source, settings=settings, script=problem, engine=engine, feedback=feedback)
    with show_progress("simulating", hidden=json, counted="steps") as display:
        option = PlanarLawOption(law, gain or [], torque_limit, stance_angle)
        planar = _planar_walk(request, option, state, (steps, display), read_terrain(rise, patch), changes)
    title = _title_walk(request, law_title(law, stance_angle))
    if planar is not None:
        _end_planar_walk(planar, title, file, engine=engine, json=json)
    if rise or patch:
        raise InputError(PLANE)
    with show_progress("simulating", hidden=json):
        walk = _walk(request, state, steps, changes)
    _end_walk(walk, title, file, json=json)


def _title_walk(request: "Request", law: str) -> str:
    """Return the title of a simulated walk: that of a saved gait with law and planned speed, otherwise the script."""
    if request.is_script:
        return request.source.stem.replace("_", " ")
    gait = request.gait
    name = gait.problem.get("name", "gait")
    name = gait.robot_name.replace("_", " ") if name == "gait" else name
    return f"{name}\n{law}, planned speed {gait.speed:.3g} m/s"


def _end_walk(walk: "Rollout", name: str, file: "WalkFile", *, json: bool) -> NoReturn:
    """Write and print a walk, and end the command."""
    from gaitopt.cli.walk_output import print_walk, walk_facts

    written = file.write(walk.motion, name)
    if json:
        print_json(walk_facts(walk) | {"file": None if written is None else str(written)})
    else:
        print_walk(walk)
        if written is not None:
            report_file(written)
    if walk.stop.key != "steps_done":
        print_reason(f"{walk.stop.key}: {walk.stop.hint}")
    raise typer.Exit(0 if walk.stop.key == "steps_done" else 1)


def _end_planar_walk(planar: "PlanarWalk", name: str, file: "WalkFile", *, engine: str, json: bool) -> NoReturn:
    """Write and print a walk of a robot with several contacts, and end the command."""
    from gaitopt.cli.planar_walk_output import report_planar_walk
    from gaitopt.simulation.engine_choice import planar_engine_named
    from gaitopt.status import Stop

    walk, section, robot = planar
    written = file.write(walk.motion, name, section, robot)
    report_planar_walk(walk, section, written, engine=planar_engine_named(engine).name, json=json)
    if walk.stop is Stop.INTERRUPTED:
        err.print("Interrupted; the walk until its last event is reported.", soft_wrap=True)
        sys.exit(INTERRUPTED)  # not typer.Exit, which would report that nothing was written
    if walk.stop is not Stop.STEPS_DONE:
        print_reason(f"{walk.stop.key}: {walk.stop.hint}")
    raise typer.Exit(0 if walk.stop is Stop.STEPS_DONE else 1)


def _planar_walk(
    request: "Request",
    law: "PlanarLawOption",
    state: list[str] | None,
    extent: tuple[int, "Display"],
    terrain: "Terrain | None",
    parameters: Mapping[str, float],
) -> "PlanarWalk | None":
    """Return the walk of a robot with several contacts, the events that end its steps, and the robot, or None.

    The walk has a number of steps, which are counted in a display.
    """
    from gaitopt.cli.planar_gait_walk import find_planar_gait, is_planar_gait, simulate_planar_gait
    from gaitopt.cli.planar_walk_output import simulate_planar_walk
    from gaitopt.simulation.engine_choice import planar_engine_named
    from gaitopt.simulation.planar_simulation.planar_simulator import list_section_events
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem

    stated = request.stated if request.is_script else request.gait
    changes, (steps, display) = read_numbers(state, "--state"), extent
    if is_planar_gait(stated):
        engine, gait = planar_engine_named(request.engine), find_planar_gait(stated)
        torque = law.make(gait)
        values = gait.robot.resolve({**gait.motion.parameters, **parameters})
        options: dict[str, Any] = {"terrain": terrain, "engine": engine, "observer": estimate_remaining_time(display)}
        walk = simulate_planar_gait(gait, torque, changes, values, steps=steps, **options)
        return walk, list_section_events(gait.robot, torque.section), gait.robot
    if isinstance(stated, PlanarWalkProblem) and isinstance(request.problem, PlanarWalkProblem):
        problem = request.problem
        options = {"terrain": terrain, "engine": request.engine, "observer": estimate_remaining_time(display)}
        walk = simulate_planar_walk(problem, changes, steps=steps, **options)
        return walk, list_section_events(problem.robot, problem.section), problem.robot
    return None


def _walk(request: "Request", state: list[str] | None, steps: int, parameters: Mapping[str, float]) -> "Rollout":
    """Return the walk from the first periodic gait with some coordinates and parameters changed."""
    from gaitopt.cli.inputs import read_input
    from gaitopt.simulation.hybrid_automaton import Walker
    from gaitopt.simulation.simulator import record_walk
    from gaitopt.stability.cycle_search import STARTS
    from gaitopt.stability.section import Section
    from gaitopt.stability.start import choose_start

    subject = read_input(request, STARTS, first=True)
    p = subject.robot.vector(subject.robot.resolve({**subject.parameters, **parameters}))
    start = choose_start(subject.robot, p, read_numbers(state, "--state"), subject.cycle)
    walker = Walker(subject.robot, subject.law, p, subject.engine)
    return record_walk(walker, Section(subject.robot, p, sliding=True).embed(np.array([*start.values()])), steps)
