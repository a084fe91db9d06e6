"""The figure of a sweep: a quantity of optimal gaits over one or two parameters, and the sequence of lowest cost."""

import json
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError, suggest
from gaitopt.motion.motion import Array
from gaitopt.motion.quantity_labels import in_shown_unit, label_quantity, show_unit
from gaitopt.plot.gait_title import list_settings
from gaitopt.plot.legends import LETTERS_PER_INCH, NO_BREAK, add_page_legend, shorten_sequence, wrap_text
from gaitopt.plot.region_map import EMPTY, AreaLook, draw_regions, empty_patch
from gaitopt.plot.style import NARROW, FigureStyle, area_color, begin_at_zero, line_style
from gaitopt.study.sweeps.sweep_file import find_cost_variable, name_variable

if TYPE_CHECKING:
    from collections.abc import Mapping

    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.transforms import Transform

HEIGHT, MAP_HEIGHT, EDGES_HEIGHT = 3.4, 2.8, 1.0
"""Heights of a figure over one parameter, of a map over two, and of its legend and axis labels [inch]."""

MOST_LINES = 3
"""Lines of the title."""

TARGETS = {"slope": "rad", "friction": "1", "speed": "m/s", "step_length": "m"}
"""Quantities of a problem that the title states, and their units."""

FAILURE_ROW = 0.07
"""Height of a row of crosses over that of the lines."""

RADIUS, LIMIT_LABEL = "spectral_radius", "stability limit"
"""Variable of the spectral radius, and label of its limit 1."""

LINEAR_RADIUS = 20.0
"""Largest spectral radius on a linear axis, on which smaller ones can be distinguished from the stability limit."""

LEAST_SPREAD = 1e-6
"""Relative difference of values below which they are shown as equal."""

LIMIT_LOOK: dict[str, Any] = FigureStyle.limit_line | {"linestyle": ":"}
"""Style of the stability limit, whose dots differ from the dashes of the contact sequences."""

SAMPLE_LENGTH = 3.2
"""Length of a line in the legend in font sizes, which shows its dashes beside its mark."""

COLOURS = "cividis"
"""Colour map of a quantity, which is the same for readers with and without colour vision."""

RADIUS_COLOURS, RADIUS_SPREAD = "coolwarm", (0.05, 1.0)
"""Colour map of spectral radii, blue for stable, grey at the limit (points without a gait are white) and red for
unstable gaits, also distinguishable without full colour vision; least and largest distance of its ends from the
stability limit."""

MOST_SEQUENCES, MOST_ROWS = 6, 3
"""Number of sequences up to which those without a gait are named, and of rows of crosses up to which each has one."""

FEW_CELLS, FEW_TICKS = 6, 8
"""Number of cells along the axis of a map whose values are all labelled, and of labels that fit along it."""


@check_arguments
def plot_sweep(table: "xr.Dataset", *, quantity: str | None = None, style: FigureStyle | None = None) -> "Figure":
    """Draw a quantity of the optimal gaits of a sweep over its parameters, by default the minimised objective.

    Over one parameter, each contact sequence is a line, the gaits of lowest minimised objective are large marks, and a
    cross at the bottom marks a point without a gait.  Over two parameters, maps show the quantity of the gait of lowest
    cost and its contact sequence.  Parameters with one value are left out.  In a figure of the spectral radius, a
    dotted line marks the stability limit, 1; in a map, stable gaits are blue and unstable ones red.

    Parameters
    ----------
    table : xarray.Dataset
        From :func:`gaitopt.sweep` or :func:`gaitopt.load_sweep`.
    quantity : str, optional
        Numeric variable of the dataset.  If it has a value for each actuator or contact, the largest magnitude is
        drawn.
    style : FigureStyle, optional

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the quantity is unknown, more than two parameters vary, or no gait was found.

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped, sweep
    >>> problem = GaitProblem(robot=compass_biped(), sequence="stick | stick", speed=0.6, step_length=0.45,
    ...                       limits=Limits(torque=6), transcription=MultipleShooting(intervals=8))
    >>> figure = plot_sweep(sweep(problem, {"friction": [0.2, 0.25]}, starts=1), quantity="impact_loss")
    >>> figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()
    ('friction', 'impact loss [J]')
    """
    quantity = quantity or find_cost_variable(table)
    values, unit = _read_quantity(table, quantity)
    style = style or FigureStyle()
    title = _describe_sweep(table, int(LETTERS_PER_INCH * style.width)) if style.titled else ""
    table = table.squeeze([name for name in table.status.dims if name != "sequence" and table.sizes[name] == 1])
    names = [str(name) for name in table.status.dims if name != "sequence"]
    if not names:
        raise InputError("A figure of a sweep needs a parameter with at least two values.")
    if len(names) > 2:
        chosen = f"table.sel({names[-1]}={float(table[names[-1]].values[0]):g})"
        raise InputError(f"A figure shows at most two parameters of a sweep, got {', '.join(names)}; use {chosen}.")
    values = values.reshape(table.status.shape)
    lowest = find_lowest(table)
    if not np.any(lowest >= 0):
        interrupted = " It was interrupted: the same command resumes it." if not table.attrs.get("complete", 1) else ""
        raise InputError(f"The sweep has no solved gait to draw.{interrupted}")
    label = label_quantity(name_variable(table, quantity), unit)
    drawn = _DrawnQuantity(in_shown_unit(values, unit), lowest, label, title, quantity == RADIUS)
    if len(names) == 1:
        return _draw_lines(table, names[0], drawn, style)
    return _draw_maps(table, names, drawn, style)


class _DrawnQuantity(NamedTuple):
    """A quantity of the gaits of a sweep, and the texts of its figure.

    Attributes
    ----------
    values : (n_sequences, ...) array
    lowest : int array
        Number of the sequence of lowest cost at each point, -1 without a gait.
    label, title : str
    is_radius : bool
        Whether the quantity is the spectral radius, which has a stability limit.
    """

    values: Array
    lowest: "np.typing.NDArray[np.intp]"
    label: str
    title: str
    is_radius: bool


def _describe_sweep(table: "xr.Dataset", letters: int) -> str:
    """Return the robot of a sweep and what its gaits have in common, in at most three lines and one of settings.

    The only contact sequence is stated over two parameters; over one parameter, it is in the legend.  The text is empty
    for an incomplete dataset.
    """
    try:
        problem = json.loads(table.attrs["question"])["problem"]
    except (KeyError, ValueError):
        return ""
    robot = str(problem.get("robot", "")).replace("_", " ")
    targets = "".join(f", {text}" for text in list_targets(table, problem))
    stated = {name for name in TARGETS if name.replace("_", NO_BREAK) in targets}
    script = json.loads(table.attrs.get("script", "null"))
    settings = list_settings(script, letters, {*stated, "sequence", *map(str, table.coords)})
    named = sum(table.sizes[name] > 1 for name in table.status.dims) == 1  # in the legend
    if not robot or named or table.sizes["sequence"] > 1:
        return wrap_text(f"{robot}{targets}", letters) + settings
    sequences = shorten_sequence(str(table.sequence.values[0]))
    texts = [wrap_text(f"{robot}, {each}{targets}", letters) for each in sequences]
    return next((text for text in texts if text.count("\n") < MOST_LINES), texts[-1]) + settings


def list_targets(table: "xr.Dataset", problem: "Mapping[str, Any]") -> list[str]:
    """Return slope, friction, speed and step length as texts, unless they are axes or have no single value.

    Parameters
    ----------
    table : xarray.Dataset
        A study, whose coordinates replace the values of its problem.
    problem : mapping
    """
    texts = []
    for name, unit in TARGETS.items():
        value: Any = table[name].values if name in table.coords else problem.get(name)
        if np.size(value) != 1 or not isinstance(number := np.asarray(value).item(), int | float):
            continue
        if np.isfinite(number) and (number or name != "slope"):
            shown = float(in_shown_unit(np.array(float(number)), unit))
            words = "" if unit == "1" else show_unit(unit)
            texts.append(f"{name.replace('_', ' ')} {shown:.4g} {words}".rstrip().replace(" ", NO_BREAK))
    return texts


def find_lowest(table: "xr.Dataset") -> "np.typing.NDArray[np.intp]":
    """Return the number of the contact sequence of lowest cost at each point of a sweep, -1 without a gait."""
    sequences = [str(name) for name in table.sequence.values]
    names = table.lowest_sequence.values.astype(str) if "lowest_sequence" in table else None
    if names is not None and {"", *sequences}.issuperset(names.ravel()):  # false if sequences were deselected
        return np.array([sequences.index(name) if name else -1 for name in names.ravel()]).reshape(names.shape)
    cost = np.where(table.status.values == "solved", table.objective.values, np.inf)
    return np.where(np.isfinite(cost).any(axis=0), np.argmin(cost, axis=0), -1)


def _read_quantity(table: "xr.Dataset", quantity: str) -> tuple[Array, str]:
    """Return the values of a quantity over sequences and axes, and its unit; InputError for an unknown quantity."""
    places = set(table.status.dims)
    known = [str(n) for n, v in table.data_vars.items() if v.dtype.kind in "fi" and places <= set(v.dims)]
    if quantity not in known:
        raise InputError(f"The sweep has no quantity {quantity!r}. {suggest(quantity, known)}")
    column = table[quantity]
    others = [name for name in column.dims if name not in places]
    if others:
        column = abs(column).max(others)
    return np.asarray(column.transpose(*table.status.dims).values, dtype=float), str(table[quantity].attrs["units"])


def _draw_lines(table: "xr.Dataset", name: str, drawn: _DrawnQuantity, style: FigureStyle) -> "Figure":
    values = drawn.values
    unit = str(table[name].attrs.get("units", "1"))
    across = in_shown_unit(table[name].values, unit)
    with style.figure(HEIGHT) as figure:
        axes = figure.subplots()
        shown = _select_sequences(values)
        for position, number in enumerate(shown):
            row, line, best = values[number], line_style(position), drawn.lowest == number
            axes.plot(across, row, label=str(table.sequence.values[number]), marker="o", markersize=2.5, **line)
            axes.plot(across[best], row[best], "o", color=line["color"], markersize=5.5, label="_lowest")
        if drawn.is_radius:
            axes.axhline(1, label=LIMIT_LABEL, **LIMIT_LOOK)
        if drawn.is_radius and _needs_decades(values):
            axes.set_yscale("log")
        else:
            axes.set_ylim(*_shown_range(values, *axes.get_ylim()))
            begin_at_zero(axes)
        failed = _mark_failures(axes, across, values[shown])
        axes.set(xlabel=label_quantity(name, unit), ylabel=drawn.label)
        handles, labels = axes.get_legend_handles_labels()
        if len(values) > 1:
            mark = axes.plot([], [], "o", color="0.3", markersize=5.5)[0]
            handles, labels = [*handles, mark], [*labels, _name_lowest(table)]
        if failed:
            cross = axes.plot([], [], "x", color="0.3", markersize=4, linestyle="none")[0]
            unsolved = bool(np.all(table.status.values[~np.isfinite(values)] != "solved"))
            handles, labels = [*handles, cross], [*labels, EMPTY if unsolved else "no value"]
        place: dict[str, Any] = {"loc": "outside upper center", "handlelength": SAMPLE_LENGTH, "title": drawn.title}
        legend = add_page_legend(figure, handles, labels, columns=3, width=style.width, **place)
        legend.get_title().set_multialignment("center")
    return figure


def _needs_decades(radii: Array) -> bool:
    """Return whether an axis of spectral radii is logarithmic, on a linear one of which radii near 1 would coincide."""
    return bool(np.nanmin(radii) > 0 and np.nanmax(radii) > LINEAR_RADIUS)


def _name_lowest(table: "xr.Dataset") -> str:
    """Return the legend of the gaits of lowest cost: the minimised objective, which the lines may not show."""
    objective = str(table.objective.attrs.get("name", "")) if "objective" in table else ""
    return f"lowest {objective.replace('_', ' ') or 'cost'}"


def _shown_range(values: Array, low: float, high: float) -> tuple[float, float]:
    """Return the ends of an axis; values that differ by less than the tolerance of a solve are shown as equal."""
    size = float(np.nanmax(np.abs(values)))
    if size == 0 or np.nanmax(values) - np.nanmin(values) > LEAST_SPREAD * size:
        return low, high
    middle = (low + high) / 2
    return middle - 0.05 * size, middle + 0.05 * size


def _select_sequences(values: Array) -> list[int]:
    """Return the numbers of the sequences that are drawn: if there are many, those with a gait."""
    numbers = range(len(values))
    return [number for number in numbers if len(values) <= MOST_SEQUENCES or np.isfinite(values[number]).any()]


def _mark_failures(axes: "Axes", across: Array, values: Array) -> bool:
    """Mark points without a gait by crosses below the lines; return whether there are any.

    Each sequence that has some has a row of crosses; if many have, one row marks the points where none has a gait.
    """
    failed = ~np.isfinite(values)
    incomplete, colours = np.flatnonzero(failed.any(axis=1)), [line_style(row)["color"] for row in range(len(values))]
    if incomplete.size > MOST_ROWS:
        failed, colours = np.array([failed.all(axis=0)]), ["0.3"]
        incomplete = np.flatnonzero(failed.any(axis=1))
    transform = axes.yaxis.get_transform()  # logarithmic axes have rows of equal height, too
    low, high = axes.get_ylim()
    begin, end = transform.transform(np.array([low, high]))
    row_height = FAILURE_ROW * (end - begin)
    axes.set_ylim(_invert(transform, begin - row_height * incomplete.size), high)
    for row, number in enumerate(incomplete):
        places = across[failed[number]]
        height = np.full(places.size, _invert(transform, begin - row_height * (row + 0.4)))
        axes.plot(places, height, "x", color=colours[number], markersize=4, label="_failure", clip_on=False)
    if low == 0 and incomplete.size:  # the axis is extended for the crosses only
        axes.set_yticks([tick for tick in axes.get_yticks() if 0 <= tick <= high])
    return bool(incomplete.size)


def _invert(transform: "Transform", place: float) -> float:
    """Return the value at a place of an axis."""
    return float(transform.inverted().transform(np.array([place]))[0])


def _draw_maps(table: "xr.Dataset", names: list[str], drawn: _DrawnQuantity, style: FigureStyle) -> "Figure":
    lowest = drawn.lowest
    units = [str(table[name].attrs.get("units", "1")) for name in names]
    across, upward = (in_shown_unit(table[name].values, unit) for name, unit in zip(names, units, strict=True))
    chosen = np.take_along_axis(drawn.values, np.maximum(lowest, 0)[None], axis=0)[0]
    chosen = np.where(lowest >= 0, chosen, np.nan)
    several, narrow = table.sizes["sequence"] > 1, style.width < NARROW
    rows, count = (1 + several, 1) if narrow else (1, 1 + several)
    with style.figure(MAP_HEIGHT * rows + EDGES_HEIGHT) as figure:
        panels = figure.subplots(rows, count, sharex=True, sharey=True, squeeze=False).ravel()
        look = _radius_look(chosen) if drawn.is_radius else _value_look(chosen)
        mesh = panels[0].pcolormesh(across, upward, chosen.T, shading="nearest", rasterized=True, **look)
        beyond = drawn.is_radius and np.nanmax(chosen) > mesh.norm.vmax
        extent = "max" if beyond else "neither"
        colorbar = figure.colorbar(mesh, ax=panels[0], label=drawn.label, location="top", extend=extent)
        if drawn.is_radius:
            colorbar.ax.set_xlim(*_radius_range(chosen))
        handles: list[Artist] = _draw_limit(panels[0], (across, upward), chosen) if drawn.is_radius else []
        if several:
            panels[1].set_title("contact sequence of lowest cost")
            sequences = [str(name) for name in table.sequence.values]
            looks = {name: AreaLook(area_color(number)) for number, name in enumerate(sequences)}
            handles = [*draw_regions(panels[1], (across, upward), lowest, looks), *handles]
        elif np.any(lowest < 0):
            handles = [empty_patch(), *handles]
        if handles:
            labels = [str(handle.get_label()) for handle in handles]
            place: dict[str, Any] = {"loc": "outside upper center", "title": drawn.title}
            legend = add_page_legend(figure, handles, labels, columns=3, width=style.width, **place)
            legend.get_title().set_multialignment("center")
        elif drawn.title:
            figure.suptitle(drawn.title, fontsize=style.font_size)
        for axes in panels:
            axes.grid(visible=False)
            axes.set(xlabel=label_quantity(names[0], units[0]), ylabel=label_quantity(names[1], units[1]))
            axes.label_outer()
        _mark_cells(panels[0], across, upward)  # the panels share their axes
    return figure


def _value_look(values: Array) -> dict[str, Any]:
    """Return the colours of the values of a map."""
    low, high = _shown_range(values, float(np.nanmin(values)), float(np.nanmax(values)))
    return {"cmap": COLOURS, "vmin": low, "vmax": high}


def _radius_look(radii: Array) -> dict[str, Any]:
    """Return the colours of a map of spectral radii, whose centre is the stability limit; radii above 2 have one."""
    from matplotlib.colors import CenteredNorm

    spread = float(np.clip(np.nanmax(np.abs(radii - 1)), *RADIUS_SPREAD))
    return {"cmap": RADIUS_COLOURS, "norm": CenteredNorm(1, spread)}


def _radius_range(radii: Array) -> tuple[float, float]:
    """Return the ends of the colour bar of a map of spectral radii, between which all of them are.

    It is at least as long as the least distance of the colours from the stability limit.
    """
    low, high = (float(min(end(radii), 1 + RADIUS_SPREAD[1])) for end in (np.nanmin, np.nanmax))
    more = max(RADIUS_SPREAD[0] - (high - low), 0.0)
    return low - more * (low >= 1), high + more * (low < 1)


def _mark_cells(axes: "Axes", across: Array, upward: Array) -> None:
    """Place ticks at the centres of the cells of a map if there are few; others are between the computed points."""
    for axis, values in ((axes.xaxis, across), (axes.yaxis, upward)):
        even = np.min(np.diff(np.sort(values))) >= np.ptp(values) / FEW_TICKS  # labels of closer ticks would overlap
        if values.size <= FEW_CELLS and even:
            axis.set_ticks(values, [f"{value:.4g}" for value in values])


def _draw_limit(axes: "Axes", places: tuple[Array, Array], radii: Array) -> "list[Artist]":
    """Draw the line along which the spectral radius is 1; return its handle of the legend, or none if there is none."""
    from matplotlib.lines import Line2D

    if not np.nanmin(radii) < 1 < np.nanmax(radii):
        return []
    look = LIMIT_LOOK | {"color": "black", "linewidth": 1.2}
    axes.contour(*places, radii.T, levels=[1.0], colors="black", linestyles=[look["linestyle"]], linewidths=1.2)
    return [Line2D([], [], label=LIMIT_LABEL, **look)]
