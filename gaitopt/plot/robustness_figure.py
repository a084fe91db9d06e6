"""The figure of push tests: the largest disturbances survived, and the return to the gait over the steps."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.motion.quantity_labels import in_shown_unit, label_quantity
from gaitopt.plot.legends import add_page_legend, extend_page
from gaitopt.plot.style import NARROW, FigureStyle, line_style
from gaitopt.stability.recovery import Recovery
from gaitopt.study.robustness.robustness_record import RobustnessRecord

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROW_HEIGHT, BAR_HEIGHT, RETURN_HEIGHT, NARROW_RETURN_HEIGHT = 0.42, 0.13, 2.2, 1.7
"""Heights of the axis of a disturbance, of each bar in it, and of the panel of the return to the gait [inch]."""

COLUMNS, TALLEST = 2, 8.0
"""Number of columns of the axes of disturbances, and largest height of the figure [inch]."""

NAMES = {"friction patch": "loss of friction on a patch"}
"""Titles of the kinds whose name does not state what is measured."""

NARROW_NAMES = {"friction patch": "loss of friction"}
"""The same in a figure of the width of a column."""

OPEN_LOOP = "open loop"
"""Name of the recovery in open loop."""

CROSS: dict[str, Any] = {"marker": "x", "linestyle": "none", "color": "0.15", "markersize": 4, "clip_on": False}
"""Style of the mark of the smallest disturbance that the gait does not survive, which may be at the end of the axis."""

COLUMN_SPACE = 0.06
"""Space between two axes of disturbances over the width of one, which separates the numbers at their ends."""


@check_arguments
def plot_robustness(
    records: RobustnessRecord | Mapping[str, RobustnessRecord], *, style: FigureStyle | None = None
) -> "Figure":
    """Draw push tests: the largest disturbance of each kind survived, and the share of walks that have returned.

    Each kind of disturbance has a separate axis, with a bar for each test up to the largest disturbance survived and
    a cross at the smallest one not survived.  Below are the shares of the walks that have returned to the gait after a
    number of steps, from random pushes in a ball.

    Parameters
    ----------
    records : RobustnessRecord or mapping of str to RobustnessRecord
        From :func:`gaitopt.study.load_robustness`; several tests are compared, by their labels.
    style : FigureStyle, optional

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If there is no record.

    Examples
    --------
    >>> from gaitopt.study import RobustnessMargins
    >>> margins = (RobustnessMargins("push", 0.1, 0.2, "rad/s"), RobustnessMargins("sensor delay", 0.01, None, "s"))
    >>> record = RobustnessRecord(law="lqr", radius=0.4, steps=50, margins=margins, recoveries={"lqr": None})
    >>> [axes.get_title(loc="left") for axes in plot_robustness(record).axes]
    ['push [rad/s]', 'sensor delay [s]']
    """
    tests = {records.law: records} if isinstance(records, RobustnessRecord) else dict(records)
    if not tests:
        raise InputError("A figure of push tests needs at least one record.")
    style = style or FigureStyle()
    kinds = list(dict.fromkeys(margin.kind for test in tests.values() for margin in test.margins))
    returns = _named_recoveries(tests)
    rows = -(-len(kinds) // COLUMNS)
    height = rows * (ROW_HEIGHT + BAR_HEIGHT * len(tests) + 0.2)
    narrow = style.width < NARROW
    heights = [height] * bool(kinds) + [NARROW_RETURN_HEIGHT if narrow else RETURN_HEIGHT] * bool(returns)
    if not heights:
        raise InputError("These push tests contain neither a disturbance survived nor a recovery.")
    with style.figure(sum(heights) + 0.5) as figure:
        grid = figure.add_gridspec(len(heights), 1, height_ratios=heights)
        inner = grid[0].subgridspec(max(rows, 1), COLUMNS if len(kinds) > 1 else 1)
        figure.get_layout_engine().set(wspace=COLUMN_SPACE)  # type: ignore[union-attr, call-arg]
        names = NARROW_NAMES if narrow else NAMES
        for number, kind in enumerate(kinds):
            axes = figure.add_subplot(inner[number % rows, number // rows], label=kind)
            _draw_kind(axes, kind, names.get(kind, kind), tests)
            axes.locator_params(axis="x", nbins=4 if narrow else 5)
        if returns:
            axes = figure.add_subplot(grid[-1], label="return")
            _draw_returns(axes, returns)
            _add_key_of_returns(figure, axes, tests, style.width)
        if kinds:
            _add_key(figure, tests, style.width)
    return figure


def _add_key(figure: "Figure", tests: Mapping[str, RobustnessRecord], width: float) -> None:
    """Draw the key of the bars and of the crosses above the figure; that of several tests is headed by their meaning.

    The label of a test contains its law if the laws differ and the label does not name it.
    """
    from matplotlib.lines import Line2D

    several, laws = len(tests) > 1, {test.law for test in tests.values()}
    labels = []
    for label, test in tests.items():
        law = f" ({test.law})" if len(laws) > 1 and test.law not in label else ""
        label += f"{law}{' (interrupted)' if test.missing else ''}"
        labels.append(label if several else f"{label}: largest survived")
    bars: list[Any] = [*figure.axes[0].containers, Line2D([], [], **CROSS)]
    heading = {"title": "largest disturbance survived"} if several else {}
    key = add_page_legend(
        figure, bars, [*labels, "smallest not survived"], columns=3, width=width, loc="outside upper center", **heading
    )
    extend_page(figure, key, TALLEST)


def _named_recoveries(tests: Mapping[str, RobustnessRecord]) -> dict[str, tuple[Recovery, dict[str, Any]]]:
    """Return the recoveries of all tests and the styles of their lines, by their laws.

    If there are several tests, the names begin with their labels, and the lines have the colours of their bars.
    """
    named: dict[str, tuple[Recovery, dict[str, Any]]] = {}
    for number, (label, test) in enumerate(tests.items()):
        known = {name: recovery for name, recovery in test.recoveries.items() if recovery is not None}
        for name, recovery in known.items():
            single = len(tests) == 1
            look = line_style(0 if single and len(known) == 1 else _place(name, known))
            if not single:
                look["color"] = line_style(number)["color"]
            named[name if single or name == label else f"{label}: {name}"] = recovery, look
    return named


def _place(name: str, recoveries: Mapping[str, Recovery | None]) -> int:
    """Return the number of the style of a recovery: in order, and after all others, at least 1, in open loop."""
    others = [other for other in recoveries if other != OPEN_LOOP]
    return others.index(name) if name in others else max(len(others), 1)


def _draw_kind(axes: "Axes", kind: str, name: str, tests: Mapping[str, RobustnessRecord]) -> None:
    """Draw the margins of one kind of disturbance, a bar for each test."""
    largest, unit = 0.0, "1"
    for number, test in enumerate(tests.values()):
        margin = next((margin for margin in test.margins if margin.kind == kind), None)
        color = line_style(number)["color"]
        if margin is None:
            axes.barh(number, 0.0, 0.7, color=color)
            _state_empty_bar(axes, number, "not tested")
            continue
        unit = margin.unit
        survived = float(in_shown_unit(np.array(margin.survived), unit))
        failed = None if margin.failed is None else float(in_shown_unit(np.array(margin.failed), unit))
        axes.barh(number, survived, 0.7, color=color)
        if failed is not None:
            axes.plot([failed], [number], **CROSS, zorder=3)
        elif not survived:
            _state_empty_bar(axes, number, "none survived")
        largest = max(largest, survived, failed or 0.0)
    axes.set_title(label_quantity(name, unit), loc="left", pad=3)
    axes.set(ylim=(len(tests) - 0.5, -0.5), yticks=[], xlim=(0, 1.08 * largest if largest else 1.0))
    axes.grid(visible=False, axis="y")


def _state_empty_bar(axes: "Axes", number: int, text: str) -> None:
    """State in the place of a bar why it is empty."""
    place: dict[str, Any] = {"textcoords": "offset points", "va": "center", "color": "0.4", "size": "small"}
    axes.annotate(text, (0, number), (2, 0), **place)


def _draw_returns(axes: "Axes", returns: Mapping[str, tuple[Recovery, dict[str, Any]]]) -> None:
    """Draw the share of the walks of each law that have returned to the gait after a number of steps."""
    recoveries = [recovery for recovery, _ in returns.values()]
    for name, (recovery, look) in returns.items():
        settling = np.sort(np.array(recovery.settling, dtype=float))
        steps = np.concatenate([[0.0], settling, [float(recovery.steps)]])
        counts = np.concatenate([[0.0], np.arange(1, settling.size + 1), [float(settling.size)]])
        axes.step(steps, 100 * counts / recovery.starts, where="post", label=name, **look)
    size = max(recovery.radius for recovery in recoveries)
    axes.set(xlabel="steps after the push", ylabel="returned [%]", ylim=(-4, 104))
    axes.set_title(f"random pushes up to {size:.3g} rad/s", loc="left", pad=3)
    axes.set_xlim(0, max(recovery.steps for recovery in recoveries))


def _add_key_of_returns(figure: "Figure", axes: "Axes", tests: Mapping[str, RobustnessRecord], width: float) -> None:
    """Draw the key of the lines below the figure.

    The colours of several tests are those of their bars, so that the key contains only what the kinds of lines mean.
    """
    from matplotlib.lines import Line2D

    handles: list[Any]
    handles, labels = axes.get_legend_handles_labels()
    if len(tests) > 1 and any(test.margins for test in tests.values()):
        names: dict[int, set[str]] = {}
        for test in tests.values():
            known = {name: recovery for name, recovery in test.recoveries.items() if recovery is not None}
            for name in known:
                names.setdefault(_place(name, known), set()).add(name)
        places = sorted(names)
        handles = [Line2D([], [], **line_style(place) | {"color": "0.3"}) for place in places]
        labels = [names[place].pop() if len(names[place]) == 1 else "under the law" for place in places]
    add_page_legend(figure, handles, labels, columns=3, width=width, loc="outside lower center")
