"""Output of the command on branches of gaits."""

from rich import box
from rich.table import Table
from rich.text import Text

from gaitopt.cli.output import out
from gaitopt.continuation.branch_diagram import BranchDiagram

LONGEST = 44
"""Characters of a contact sequence that are shown."""


def print_diagram(diagram: BranchDiagram) -> None:
    """Print branches, and their special points in order."""
    unit = "" if diagram.unit in ("", "1") else f" [{diagram.unit}]"
    branches = Table(box=box.SIMPLE, pad_edge=False, title="branches", title_justify="left")
    for column in ("branch", "steps", "gaits", "stable", Text(f"{diagram.parameter}{unit}"), "begins", "ends"):
        branches.add_column(column, no_wrap=True)
    for number, branch in enumerate(diagram.branches):
        begin = branch.begin if branch.parent is None else f"branch {branch.parent}"
        span = f"{branch.values[0]:.6g} to {branch.values[-1]:.6g}"
        counts = (str(branch.steps), str(branch.values.size), str(int(branch.stable.sum())))
        branches.add_row(str(number), *counts, span, begin.replace("_", " "), branch.end.replace("_", " "))
    out.print(branches)
    special = Table(box=box.SIMPLE, pad_edge=False, title="special points", title_justify="left")
    for column in ("branch", "kind", Text(f"{diagram.parameter}{unit}"), "before", "after"):
        special.add_column(column, no_wrap=True)
    for number, branch in enumerate(diagram.branches):
        for point in branch.special:
            after = "" if point.after == point.before else point.after
            names = [Text(_shorten(name)) for name in (point.before, after)]
            special.add_row(str(number), point.kind.label, f"{point.value:.9f}", *names)
    if special.row_count:
        out.print(special)
    if diagram.ratios:
        ratios = ", ".join(f"{ratio:.4f}" for ratio in diagram.ratios)
        out.print(f"ratios of the distances between period doublings: {ratios}")


def _shorten(text: str) -> str:
    """Return a contact sequence with repeated steps counted, and shortened if it is long.

    Examples
    --------
    >>> _shorten("stick | stick; stick | stick")
    '2 x (stick | stick)'
    """
    steps = text.split("; ")
    if len(steps) > 1 and len(set(steps)) == 1:
        return f"{len(steps)} x ({steps[0]})"
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 4]} ..."
