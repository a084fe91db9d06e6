"""Commands on feedback: tune, push."""

import dataclasses
import time
from typing import Annotated, Any

import typer
from rich import box
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from gaitopt.cli.law import OPEN_LOOP, GainValues, LawName, TorqueLimit, law_for, limit_for
from gaitopt.cli.options import GaitFile, Json, Quiet
from gaitopt.cli.output import err, out, print_json
from gaitopt.model.catalogue import robot_named
from gaitopt.motion.summary import plain
from gaitopt.progress import Iteration

Starts = Annotated[int, typer.Option(min=1, max=100000, help="Seeded starts of the walks that verify.")]


def tune(
    file: GaitFile,
    law: LawName = "lqr",
    torque_limit: TorqueLimit = None,
    sensitivity: Annotated[
        bool, typer.Option("--sensitivity", help="Make the gait sensitivity norm small, not the spectral radius.")
    ] = False,
    friction: Annotated[
        list[float] | None, typer.Option("--friction", help="Another friction that counts too: the worst decides.")
    ] = None,
    starts: Starts = 200,
    seed: Annotated[int, typer.Option(help="Of the search and of the starts.")] = 0,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Tune the gains of a feedback law for a gait and verify the law by walks from pushed starts.

    Exit status 0 if the gait is held, 1 if not: then the best radius found is printed.

    Example: gaitopt tune compass_slip.h5 --law lqr --json
    """
    from gaitopt.motion.archive import load
    from gaitopt.stability.recovery import PushTest
    from gaitopt.tuning.design import design_named
    from gaitopt.tuning.objective import SensitivityNorm, SpectralRadius
    from gaitopt.tuning.tune import Search, tune_feedback

    gait = load(file).require()
    robot = robot_named(gait.robot)
    design = design_named(law, robot, gait.motion, torque_limit=limit_for(gait, torque_limit))
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=err, transient=True, disable=json or quiet) as progress:
        task = progress.add_task("tuning")

        def observe(step: Iteration) -> None:
            progress.update(task, description=f"evaluation {step.number:3d}   best {step.infeasibility:.4f}")

        tuned = tune_feedback(
            gait,
            design,
            objective=SensitivityNorm() if sensitivity else SpectralRadius(),
            frictions=tuple(friction or ()),
            search=Search(seed=seed),
            test=PushTest(starts=starts, seed=seed),
            observer=observe,
        )
    verified = tuned.verified
    facts = plain(
        {
            "law": tuned.design,
            "gains": tuned.gains,
            "radius_before": tuned.radius_before,
            "radius_after": tuned.radius_after,
            "stable": tuned.stable,
            "multipliers": [[value.real, value.imag] for value in tuned.cycle.multipliers],
            "fixed_point_shift": tuned.fixed_point_shift,
            "verified": {
                "starts": verified.starts,
                "returned": verified.returned,
                "push_radius": verified.radius,
                "steps": verified.steps,
                "tolerance": verified.tolerance,
            },
            "evaluations": tuned.evaluations,
            "seconds": tuned.seconds,
        }
    )
    if json:
        print_json(facts)
    elif not quiet:
        _print_facts(facts)
    raise typer.Exit(0 if tuned.stable else 1)


def push(
    file: GaitFile,
    law: LawName = OPEN_LOOP,
    gain: GainValues = None,
    torque_limit: TorqueLimit = None,
    steps: Annotated[int, typer.Option(min=6, max=100000, help="Steps to walk.")] = 50,
    starts: Starts = 50,
    json: Json = False,
) -> None:
    """Find the largest push, slope, friction patch and torque noise a gait survives under a law.

    Example: gaitopt push compass_slip.h5 --law lqr
    """
    from gaitopt.motion.archive import load
    from gaitopt.simulation.engines import default_engine
    from gaitopt.stability.assessment import assess_stability
    from gaitopt.stability.recovery import PushTest
    from gaitopt.study.disturbance import Walking, endurance

    began, gait = time.perf_counter(), load(file).require()
    robot = robot_named(gait.robot)
    chosen = law_for(gait, robot, law, gain, torque_limit)
    cycle = assess_stability(gait, chosen)
    found = endurance(robot, chosen, cycle, walking=Walking(steps=steps), test=PushTest(starts=starts))
    facts = plain(
        {
            "law": law,
            "engine": default_engine(chosen).name,
            "radius": cycle.radius,
            "steps": steps,
            "survived": [dataclasses.asdict(each) for each in found],
            "seconds": time.perf_counter() - began,
        }
    )
    if json:
        print_json(facts)
        return
    table = Table(
        box=box.SIMPLE, pad_edge=False, title=f"{law}: spectral radius {cycle.radius:.4f}", title_justify="left"
    )
    for column in ("disturbance", "survived", "failed", "unit"):
        table.add_column(column)
    for each in found:
        table.add_row(
            each.kind, f"{each.survived:.4g}", "-" if each.failed is None else f"{each.failed:.4g}", each.unit
        )
    out.print(table)


def _print_facts(facts: dict[str, Any]) -> None:
    table = Table(box=box.SIMPLE, show_header=False, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    verified = facts["verified"]
    table.add_row("law", facts["law"])
    table.add_row("gains", ", ".join(f"{name} {value:.4g}" for name, value in facts["gains"].items()))
    held = "[green]held[/]" if facts["stable"] else "[red]not held: the best radius found[/]"
    table.add_row("spectral radius", f"{facts['radius_before']:.4g} before, {facts['radius_after']:.4g} after, {held}")
    table.add_row("fixed point", f"{facts['fixed_point_shift']:.1e} from the plan")
    table.add_row(
        "verified",
        f"{verified['returned']} of {verified['starts']} starts within {verified['push_radius']:.4g} rad/s back on the "
        f"gait ({verified['tolerance']:g}) after {verified['steps']} steps",
    )
    table.add_row("search", f"{facts['evaluations']} evaluations, {facts['seconds']:.1f} s")
    out.print(table)
