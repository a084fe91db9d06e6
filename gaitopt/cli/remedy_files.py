"""Files of the verified gaits that the tests of remedies for a failed solve have found."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from attrs import fields

from gaitopt.cli.failed_solve import SolveCommand
from gaitopt.cli.output import report_file

if TYPE_CHECKING:
    from gaitopt.motion.planar_gait import PlanarGait
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem

SCALARS = {"speed": "m/s", "step_length": "m", "slope": "rad", "friction": "", "sequence": ""}
"""Single values of a problem that remedies change, with their units."""


class RemedyFiles:
    """Writes the verified gaits of tested remedies when they are found.

    Parameters
    ----------
    command : SolveCommand

    Attributes
    ----------
    command : SolveCommand
    changes : dict of Path to str
        What differs from the stated problem, by file.
    """

    def __init__(self, command: SolveCommand) -> None:
        self.changes: dict[Path, str] = {}
        self.command = command

    def keep(self, problem: "PlanarProblem", changed: "PlanarProblem", gait: "PlanarGait") -> None:
        """Write the gait of a changed problem."""
        from gaitopt.motion.archive import save

        path = self.command.remedy(len(self.changes) + 1)
        save(gait, path)
        self.changes[path] = ", ".join(describe_changes(problem, changed))

    def report(self) -> None:
        """Print the files and the changes."""
        for path, change in self.changes.items():
            report_file(path, f"the verified gait with {change}")


def describe_changes(problem: "PlanarProblem", changed: "PlanarProblem") -> Iterator[str]:
    """Yield the values of a problem that differ from those of the stated one."""
    if changed.robot is not problem.robot:
        yield "other thresholds in `armed`"
    for name, unit in SCALARS.items():
        value = getattr(changed, name)
        if value != getattr(problem, name):
            yield f"{name} = {f'{value:.4g}' if isinstance(value, float) else value} {unit}".rstrip()
    for owner in ("limits", "margins"):
        former, present = getattr(problem, owner), getattr(changed, owner)
        for name in (each.name for each in fields(type(present))):
            value = getattr(present, name)
            if value != getattr(former, name):
                yield f"{type(present).__name__}.{name} = {f'{value:.4g}' if isinstance(value, float) else value}"
