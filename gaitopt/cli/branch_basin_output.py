"""Output of basins along a branch."""

from typing import TYPE_CHECKING, Any

import numpy as np
from rich import box
from rich.table import Table
from rich.text import Text

from gaitopt.cli.output import out
from gaitopt.motion.summary import plain

if TYPE_CHECKING:
    import xarray as xr


def branch_basin_facts(table: "xr.Dataset") -> dict[str, Any]:
    """Return basins along a branch as plain data, with one record for each value of the parameter."""
    (over,) = map(str, table.push.dims)
    names, endings = list(map(str, table.coordinate.values)), list(map(str, table.ending.values))
    records = [
        {
            over: float(row[over]),
            "stable": bool(row.stable),
            "shares": dict(zip(endings, row.share.values.tolist(), strict=True)),
            "push": float(row.push),
            "push_ending": str(row.push_ending.values),
            "change": dict(zip(names, row.change.values.tolist(), strict=True)),
            "edges": dict(zip(names, row.edge.values.tolist(), strict=True)),
        }
        for row in (table.isel({over: k}) for k in range(table.sizes[over]))
    ]
    return plain({"parameter": over, "unit": str(table[over].attrs.get("units", "1")), "basins": records})


def print_branch_basin(table: "xr.Dataset") -> None:
    """Print the shares of the endings and the smallest fatal push of each gait."""
    facts = branch_basin_facts(table)
    shown = Table(box=box.SIMPLE, pad_edge=False, title="basins along a branch", title_justify="left")
    for column in (facts["parameter"], "shares of the starts", "fatal push [rad/s]", "ending"):
        shown.add_column(Text(column), no_wrap=column != "shares of the starts")
    for record in facts["basins"]:
        shares = ", ".join(f"{100 * share:.3g} % {name}" for name, share in record["shares"].items() if share)
        size = "" if record["push"] is None or not np.isfinite(record["push"]) else f"{record['push']:.4g}"
        shown.add_row(f"{record[facts['parameter']]:.6g}", Text(shares), size, Text(record["push_ending"]))
    out.print(shown)
