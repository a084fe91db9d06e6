"""The figure of a basin: the ending of the walk from each start."""

import itertools
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.motion.quantity_labels import in_shown_unit, label_quantity
from gaitopt.plot.branch_figure import add_titled_legend, angle_symbol_of
from gaitopt.plot.diagram_title import describe_model
from gaitopt.plot.legends import NO_BREAK
from gaitopt.plot.region_map import AreaLook, draw_regions
from gaitopt.plot.style import FigureStyle, area_color
from gaitopt.study.basins.basin_file import basin_key, ending_labels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

HEIGHT, STRIP_HEIGHT = 3.6, 2.6
"""Height of a map, and of the figure of a basin over one coordinate [inch]."""

SAME_PLACE = 0.01
"""Distance over the length of an axis below which two gaits are drawn as one."""

LINE, LETTERS_PER_INCH = 70, 12
"""Largest number of characters of a line above the axes, and of these characters per inch."""

FAILURES = {
    "fell": AreaLook("0.85"),
    "lift_off": AreaLook("0.7", "////"),
    "no_touchdown": AreaLook("0.97", "...."),
    "unsettled": AreaLook("#F0E442"),
    "painleve": AreaLook("0.3"),
    "double_support": AreaLook("0.85", "xxxx"),
    "no_start": AreaLook("white", "\\\\\\\\"),
}
"""Looks of endings that are not gaits: three greys that are far apart, and hatches."""

OTHER_FAILURES = tuple(AreaLook(grey, hatch) for grey in ("0.85", "0.6") for hatch in ("++++", "||||", "----", "oo"))
"""Looks of rare failures."""


@check_arguments
def plot_basin(table: "xr.Dataset", *, style: FigureStyle | None = None) -> "Figure":
    r"""Draw the ending of the walk from each start of a basin: a colour for each gait, greys and hatches for failures.

    Over one coordinate, the number of steps until the ending is drawn above the colours.

    Parameters
    ----------
    table : xarray.Dataset
        From :func:`gaitopt.basin` or :func:`gaitopt.load_basin`.
    style : FigureStyle, optional

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If more than two coordinates or parameters vary, or no start is computed.

    Examples
    --------
    >>> from gaitopt import basin, rimless_wheel
    >>> figure = plot_basin(basin(rimless_wheel(), {"slope": 0.23}, {"theta_rate": [0.1, 1.0, 2.0]}))
    >>> figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()
    ('$\\dot{\\theta}$ [rad/s]', 'steps until the ending')
    """
    names = [str(name) for name in table.ending.dims]
    if len(names) > 2:
        raise InputError(f"A figure shows at most two axes of a basin, got {', '.join(names)}; select one by .isel.")
    labels = ending_labels(table)
    known = sorted(label for label in set(labels.ravel().tolist()) if label)
    if not known:
        raise InputError("The basin has no computed start to draw.")
    kinds = np.array([known.index(label) if label else -1 for label in labels.ravel()]).reshape(labels.shape)
    style, looks = style or FigureStyle(), ending_looks(known)
    units = [str(table[name].attrs.get("units", "1")) for name in names]
    places = [in_shown_unit(table[name].values, unit) for name, unit in zip(names, units, strict=True)]
    shown = [_coordinate_label(name, unit) for name, unit in zip(names, units, strict=True)]
    with style.figure(HEIGHT if len(names) == 2 else STRIP_HEIGHT) as figure:
        axes = figure.subplots()
        if len(names) == 1:
            steps = np.where(table.steps.values > 0, table.steps.values, np.nan)
            top = 1.08 * float(np.nanmax(steps, initial=1.0))
            handles = draw_regions(
                axes, (places[0], np.array([0.0, top])), np.stack([kinds, kinds], axis=1), looks, empty="not computed"
            )
            axes.plot(places[0], steps, color="black", linewidth=1.0, drawstyle="steps-mid")
            axes.set(xlabel=shown[0], ylabel="steps until the ending", ylim=(0, top))
        else:
            handles = draw_regions(axes, (places[0], places[1]), kinds, looks, empty="not computed")
            axes.set(xlabel=shown[0], ylabel=shown[1])
        shown_handles: list[Artist] = [*handles, *_mark_gait(axes, table)]
        axes.set_title(_describe_start(table, style.width), fontsize="medium")
        texts = [name_ending(str(handle.get_label())) for handle in shown_handles]
        title = _describe_basin(table, style.width) * style.titled
        add_titled_legend(figure, shown_handles, texts, title, style, columns=3)
    return figure


def _describe_basin(table: "xr.Dataset", width: float) -> str:
    """Return the title: the robot, its parameters that are not axes, and the law."""
    key = basin_key(table)
    law = str(key["method"].get("law", "")).replace("_", " ")
    varied = {str(name) for name in table.ending.dims}
    facts = [] if law in ("", "passive") else [f"law {law}"]
    parameters = {name: float(value) for name, value in key["parameters"].items()}  # infinite ones are texts
    return describe_model(str(key["robot"]), parameters, width, varied=varied, facts=facts)


def _mark_gait(axes: "Axes", table: "xr.Dataset") -> list["Line2D"]:
    """Mark the gaits in which walks end; of a robot with several contacts, the gait that the key of its basin contains.

    The starts near a gait are on a line or a plane that may not contain it, of which its projection is marked.
    """
    names = [str(name) for name in table.ending.dims]
    gait = basin_key(table)["method"].get("gait", {})
    rows = [[gait[name] for name in names]] if all(name in gait for name in names) else []
    places = np.array(rows or _find_gaits(table, names)).reshape(-1, len(names))
    if not len(places):
        return []
    units = [str(table[name].attrs.get("units", "1")) for name in names]
    shown = [in_shown_unit(places[:, k], unit) for k, unit in enumerate(units)]
    look: dict[str, Any] = {"color": "black", "label": "gait"}
    if len(names) == 1:
        lines = [axes.axvline(value, linestyle=":", linewidth=1.0, **look) for value in shown[0]]
        return lines[:1]
    return list(axes.plot(*shown, marker="+", markersize=4, linestyle="none", clip_on=False, **look))


def _find_gaits(table: "xr.Dataset", names: list[str]) -> list[list[float]]:
    """Return the different gaits in which walks end that are inside the axes, in their coordinates [SI, rad].

    Gaits of several steps have a row for each step at whose start walks ended.
    """
    coordinates = [str(name) for name in table.coordinate.values]
    if not any(name in coordinates for name in names):
        return []
    labels, final = ending_labels(table), table.final.values
    grid = np.meshgrid(*(table[name].values for name in names), indexing="ij")
    columns = [
        final[..., coordinates.index(name)] if name in coordinates else values
        for name, values in zip(names, grid, strict=True)
    ]
    walks = np.vectorize(lambda label: "|" in label)(labels)
    rows = np.column_stack([column[walks] for column in columns])
    lows, highs = (np.array([end(table[name].values) for name in names]) for end in (np.min, np.max))
    rows = rows[np.all((rows >= lows) & (rows <= highs), axis=1)]
    digits = [SAME_PLACE * max(float(np.ptp(table[name].values)), 1e-12) for name in names]
    _, firsts = np.unique(np.round(rows / digits), axis=0, return_index=True)
    return [list(map(float, rows[first])) for first in firsts]


def _describe_start(table: "xr.Dataset", width: float) -> str:
    """Return a text with the coordinates of all starts that are not axes, and their values."""
    key = basin_key(table)
    parts = [f"{angle_symbol_of(name)} {value:.4g}".replace(" ", NO_BREAK) for name, value in key["base"].items()]
    text = f"other coordinates [SI, rad]: {', '.join(parts)}" if parts else ""
    if "gait" in key["method"]:
        text = f"{text}; all others: near the gait" if text else "other coordinates: near the gait"
    return textwrap.fill(text, min(LINE, int(LETTERS_PER_INCH * width))).replace(NO_BREAK, " ")


def ending_looks(labels: list[str]) -> dict[str, AreaLook]:
    """Return the look of each ending: light colours for gaits, greys and hatches for failures.

    Examples
    --------
    >>> ending_looks(["fell", "stick | stick"])["stick | stick"]
    AreaLook(color='#73b1d5', hatch='')
    """
    gaits = [label for label in labels if "|" in label]
    looks = {name: AreaLook(area_color(number)) for number, name in enumerate(gaits)}
    others = [label for label in labels if label not in {*looks, *FAILURES}]
    looks |= FAILURES | dict(zip(others, itertools.cycle(OTHER_FAILURES), strict=False))
    return {label: looks[label] for label in labels}


def name_ending(label: str) -> str:
    """Return the name of an ending in a legend.

    Examples
    --------
    >>> name_ending("lift_off"), name_ending("painleve"), name_ending("slip- | stick")
    ('lift off', 'Painleve paradox', 'slip- | stick')
    """
    return "Painleve paradox" if label == "painleve" else label.replace("_", " ")


def _coordinate_label(name: str, unit: str) -> str:
    symbol = angle_symbol_of(name)
    label = label_quantity(name, unit)
    return label.replace(name.replace("_", " "), symbol, 1) if symbol.startswith("$") else label
