"""Output of a gait as a table."""

from rich import box
from rich.table import Table
from rich.text import Text

from gaitopt.cli.output import out, verdict_text
from gaitopt.motion.gait import Gait
from gaitopt.motion.gait_table import tabulate_gait
from gaitopt.motion.planar_gait import PlanarGait


def print_gait(gait: Gait | PlanarGait) -> None:
    """Print the facts of a gait as a table."""
    table = Table(box=box.SIMPLE, show_header=False, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    for name, text in tabulate_gait(gait):
        table.add_row(name, _colour_verdict(gait, name, text))
    out.print(table)


def _colour_verdict(gait: Gait | PlanarGait, name: str, text: str) -> Text:
    """Return a fact with its verdict, the part before the colon, in colour."""
    good = {"status": gait.status.ok, "replay": gait.verification is not None and gait.verification.passed}
    verdict, colon, rest = text.partition(":")
    if name in good and colon:
        return Text.assemble(verdict_text(verdict, good[name]), f":{rest}")
    return Text(text, style="yellow" if name == "warning" else "")
