"""The command that replays a saved gait."""

from pathlib import Path
from typing import Annotated

import typer

from gaitopt.cli.options import GaitFile, Json, Quiet, RobotScript, Verbose
from gaitopt.cli.output import out, print_json, print_reason, report_file
from gaitopt.cli.walk_script import refuse_walk_script
from gaitopt.errors import InputError


def verify(
    file: GaitFile,
    problem: RobotScript = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE.h5", help="File of the gait with the result of the replay."),
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Replay a saved gait's torques in the event-driven simulator and compare the replay with the plan.

    Exit status 0 if the gait passes, 1 otherwise.  The file is not changed; with -o, the gait and the result of its
    replay are written to another one, also if the gait does not pass.

    Example: gaitopt verify compass_slip.h5

    Example: gaitopt verify compass_slip.h5 -o compass_verified.h5
    """
    from gaitopt.cli.failed_solve import state_failure
    from gaitopt.cli.gait_output import print_gait
    from gaitopt.cli.multistep_output import is_multistep_file, verify_multistep
    from gaitopt.cli.script import load_any_gait
    from gaitopt.motion.archive import save
    from gaitopt.motion.summary import summarise
    from gaitopt.simulation.verification import verify as verify_gait

    refuse_walk_script(file)
    if is_multistep_file(file):
        if problem is not None:
            raise InputError(f"--problem is not accepted for a gait of several steps, got {problem}.")
        status = verify_multistep(file, output, json=json)
        raise typer.Exit(0 if status.ok else 1)
    gait = verify_gait(load_any_gait(file, problem))
    if output is not None:
        save(gait, output)
    if json:
        print_json(summarise(gait) | {"file": str(output or file)})
    else:
        print_gait(gait)
        report_replay(output)
    passed = gait.verification is not None and gait.verification.passed
    if not (passed and gait.status.ok):
        print_reason(state_failure(gait))
    raise typer.Exit(0 if passed and gait.status.ok else 1)


def report_replay(output: Path | None) -> None:
    """Print the file of a replayed gait, or that none was written."""
    if output is None:
        out.print("The gait was replayed in the event-driven simulator; the file was not changed.")
    else:
        report_file(output, "the gait with the result of its replay")
