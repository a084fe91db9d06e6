"""Command that solves one impact: impact."""

import math
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitopt.cli.options import Json, Quiet, ScriptFile, Setting, State, Verbose
from gaitopt.cli.output import out, print_json, print_reason
from gaitopt.cli.settings import read_numbers
from gaitopt.errors import InputError, suggest

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from gaitopt.model.contacts.multicontact_impact import ImpactOutcome
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.motion.motion import Array

Standing = Annotated[
    list[str] | None,
    typer.Option(
        "--on",
        metavar="CONTACT",
        help="Stationary contact with the ground, which determines the coordinates and rates that neither --state nor "
        "the script states (repeatable).",
        show_default="that of the script, or the first foot",
    ),
]


def impact(
    source: ScriptFile,
    setting: Setting = None,
    state: State = None,
    on: Standing = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Solve the impact of a robot in a state, with all contacts that are closed or closing.

    Coordinates and rates without --state are those of the script, if it states a start.

    Exit status 0 if exactly one outcome is consistent, 1 otherwise.

    Example: gaitopt impact problems/kneed_walker.py --state a=-0.1 --state b=0.3 --state flexion_b_rate=-4
    """
    from gaitopt.cli.script import call_script
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.simulation.planar_simulation.planar_impact import solve_planar_impact

    problem = call_script(source, setting or [])
    robot = getattr(problem, "robot", None)
    if not isinstance(robot, PlanarRobot):
        raise InputError(
            f"The impact of {source} is not available: its robot must be made by assemble_planar, got {robot!r}."
        )
    parameters = dict(getattr(problem, "values", None) or problem.parameters)
    q, v = _read_state(problem, read_numbers(state, "--state"), parameters, on)
    outcome = solve_planar_impact(robot, q, v, parameters)
    if json:
        print_json(_facts(outcome))
    else:
        _print_outcome(robot, outcome)
    if (number := len(outcome.candidates)) != 1:
        print_reason("The impact has no consistent outcome." if number == 0 else f"The impact has {number} outcomes.")
    raise typer.Exit(0 if number == 1 else 1)


def _read_state(
    problem: Any, values: "Mapping[str, float]", parameters: "Mapping[str, float]", on: "Sequence[str] | None"
) -> "tuple[Array, Array]":
    """Return the state with the named coordinates and rates; contacts at rest determine those that remain."""
    from gaitopt.simulation.planar_simulation.placement import place_planar

    robot = problem.robot
    unknown = [name for name in values if name not in robot.state_names]
    if unknown:
        raise InputError(
            f"Robot {robot.name!r} has no state coordinate {unknown[0]!r}. {suggest(unknown[0], robot.state_names)}"
        )
    infinite = [name for name, value in values.items() if not math.isfinite(value)]
    if infinite:
        raise InputError(f"--state {infinite[0]} must be a finite number, got {values[infinite[0]]:g}.")
    coordinates, rates = (dict(getattr(problem, name, {})) for name in ("coordinates", "rates"))
    if not values and not rates:
        names = ", ".join(f"{name}_rate" for name in robot.coordinates)
        raise InputError(
            "The script states no motion, and a robot at rest has no impact: state rates with --state NAME=VALUE "
            f"({names})."
        )
    coordinates |= {name: values[name] for name in robot.coordinates if name in values}
    rates |= {name: values[f"{name}_rate"] for name in robot.coordinates if f"{name}_rate" in values}
    complete = len(values) == len(robot.state_names)
    feet = [contact.name for contact in robot.contacts if contact.kind != "stop" and not contact.falls]
    standing = on or ([] if complete else getattr(problem, "on", feet[:1]))
    return place_planar(robot, coordinates, rates, parameters, on=standing)


def _facts(outcome: "ImpactOutcome") -> dict[str, Any]:
    """Return the outcome as plain data; of several outcomes, all."""
    candidates = [
        {
            "outcome": {name: mode.value for name, mode in candidate.modes.items()},
            "impulse": {name: list(impulse) for name, impulse in candidate.impulse.items()},
            "energy_lost": candidate.energy_lost,
            "velocity_after": candidate.velocity_plus.tolist(),
        }
        for candidate in outcome.candidates
    ]
    if len(candidates) == 1:
        return {"status": outcome.status.value, **candidates[0]}
    return {"status": outcome.status.value, "candidates": candidates}


def _print_outcome(robot: "PlanarRobot", outcome: "ImpactOutcome") -> None:
    """Print the outcome as tables."""
    from rich import box
    from rich.table import Table

    count = len(outcome.candidates)
    out.print(f"ambiguous: {count} outcomes" if count > 1 else "unique outcome" if count else "no consistent outcome")
    units = {contact.name: "N m s" if contact.unit == "rad" else "N s" for contact in robot.contacts}
    for candidate in outcome.candidates:
        table = Table("contact", "mode", "tangential [N s]", "normal", "", box=box.SIMPLE)
        for name, (tangential, normal) in candidate.impulse.items():
            table.add_row(name, candidate.modes[name].value, f"{tangential:.9g}", f"{normal:.9g}", units[name])
        out.print(table)
        rates = zip(robot.coordinates, candidate.velocity_plus, robot.units, strict=True)
        out.print(f"energy lost {candidate.energy_lost:.9g} J")
        text = "  ".join(f"{name} {rate:.9g} {unit}/s" for name, rate, unit in rates)
        out.print(f"velocity after  {text}", soft_wrap=True)
