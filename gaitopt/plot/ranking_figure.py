"""The figure of a search: the cost of each contact sequence, and its contact modes over the step."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.planar_gait import AnyGait
from gaitopt.motion.quantity_labels import label_quantity
from gaitopt.motion.view_motion import view_motion
from gaitopt.plot.legends import LETTERS_PER_INCH, add_page_legend, wrap_text
from gaitopt.plot.mode_bar import merge_modes
from gaitopt.plot.style import BODY, FIRST_LEG, MODE_FILL, MODE_HATCH, NARROW, FigureStyle
from gaitopt.study.sequence_search.ranking import Ranking, ranking_cost

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_ROWS = 15
"""Number of contact sequences that are drawn, those of lowest cost."""

ROW_HEIGHT, LINE_HEIGHT, EDGES_HEIGHT = 0.24, 0.19, 0.95
"""Heights of a bar, of a line of text above it, and of legend and axis labels [inch]."""


@check_arguments
def plot_ranking(ranking: Ranking, *, style: FigureStyle | None = None) -> "Figure":
    """Draw the ranked contact sequences of a search from top to bottom: cost, extra cost, and modes over the step.

    Parameters
    ----------
    ranking : Ranking
        From :func:`gaitopt.search` or :func:`gaitopt.study.load_ranking`.
    style : FigureStyle, optional

    Returns
    -------
    matplotlib.figure.Figure
        At most 15 sequences are drawn, those of lowest cost.

    Raises
    ------
    InputError
        If no contact sequence has a gait.

    Examples
    --------
    >>> from gaitopt import load
    >>> from gaitopt.study.sequence_search.ranking import judge_gait, rank_gaits
    >>> ranking = rank_gaits([judge_gait(load("docs/examples/compass_slip.h5"), 5e-3, None)], complete=True)
    >>> [axes.get_xlabel() for axes in plot_ranking(ranking).axes]
    ['cost of transport', 'fraction of the step [%]']
    """
    gaits = [finding.gait for finding in ranking.findings if finding.ranked and finding.gait is not None]
    if not gaits:
        raise InputError(f"No contact sequence has a gait to draw: {ranking.findings[0].reason}.")
    style, shown = style or FigureStyle(), gaits[:MOST_ROWS]
    feet = _list_feet(shown)
    letters = int((style.width - 0.3) * LETTERS_PER_INCH)
    texts = [_describe(gait, gaits[0], letters) for gait in shown]
    heights = [ROW_HEIGHT + LINE_HEIGHT * (1 + text.count("\n")) for text in texts]
    with style.figure(sum(heights) + EDGES_HEIGHT + LINE_HEIGHT * (len(feet) > 1)) as figure:
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1, 1.4))
        right.patch.set_visible(False)  # the texts of the left panel extend over the right one
        modes = dict[Mode, None]()
        bottom = 0.0
        for gait, text, height in zip(shown, texts, heights, strict=True):
            middle = bottom + height - ROW_HEIGHT / 2
            color = FIRST_LEG if gait is gaits[0] else BODY
            left.barh(middle, ranking_cost(gait), 0.8 * ROW_HEIGHT, color=color)
            place: dict[str, Any] = {"transform": left.get_yaxis_transform(), "va": "bottom", "clip_on": False}
            left.text(0.0, middle - 0.45 * ROW_HEIGHT, text, zorder=5, in_layout=False, **place)
            modes |= dict.fromkeys(_draw_modes(right, gait, middle, feet))
            bottom += height
        label = _cost_label(gaits[0])
        left.set(xlabel=label.replace(" [", "\n[") if style.width < NARROW else label, ylim=(bottom, 0), yticks=[])
        rows = f"\nfrom top: {', '.join(feet)}" if len(feet) > 1 else ""
        right.set(xlabel=f"fraction of the step [%]{rows}", xlim=(0, 100))
        for axes in (left, right):
            axes.grid(visible=False)
            axes.spines["left"].set_visible(False)
            axes.tick_params(left=False, labelleft=False)
        _add_mode_legend(figure, list(modes), style.width)
    return figure


def _describe(gait: AnyGait, best: AnyGait, letters: int) -> str:
    """Return the contact sequence and the cost of a gait in lines of at most `letters` characters."""
    cost, lowest = ranking_cost(gait), ranking_cost(best)
    extra = "" if gait is best else f" (+{100 * (cost / lowest - 1):.2g} %)"
    sequence = str(gait.sequence)
    if sequence.endswith(("|", ">")):  # a mark at the end would belong to the number that follows
        sequence = f"'{sequence}'"
    return wrap_text(f"{sequence}: {cost:.4g}{extra}", letters)


def _cost_label(gait: AnyGait) -> str:
    return label_quantity(gait.problem["objective"], gait.problem.get("objective_unit", ""))


def _list_feet(gaits: Sequence[AnyGait]) -> list[str]:
    """Return the names of the feet that touch the ground in some gait, or of the stops of a robot without feet."""
    views = [view_motion(gait.motion) for gait in gaits]
    names = dict.fromkeys(view.contacts[foot].name for view in views for foot in view.loaded)
    return list(names or dict.fromkeys(view.contacts[stop].name for view in views for stop in view.closing))


def _draw_modes(axes: "Axes", gait: AnyGait, middle: float, feet: Sequence[str]) -> list[Mode]:
    """Draw the mode of each foot over the step, a row for each, around a height; return the modes."""
    view = view_motion(gait.motion)
    numbers = {contact.name: number for number, contact in enumerate(view.contacts)}
    height, drawn = 0.8 * ROW_HEIGHT / len(feet), list[Mode]()
    for row, name in enumerate(feet):
        level = middle + (row - (len(feet) - 1) / 2) * height
        always_free = [(0.0, view.period, Mode.FREE)]
        for start, end, mode in merge_modes(view, numbers[name]) if name in numbers else always_free:
            begin, width = 100 * start / view.period, 100 * (end - start) / view.period
            look: dict[str, Any] = {"facecolor": MODE_FILL[mode], "hatch": MODE_HATCH[mode], "edgecolor": "0.3"}
            axes.barh(level, width, height, left=begin, linewidth=0.4, **look)
            drawn.append(mode)
    return drawn


def _add_mode_legend(figure: "Figure", modes: list[Mode], width: float) -> None:
    from matplotlib.patches import Patch

    order = [mode for mode in MODE_FILL if mode in modes]
    handles = [
        Patch(facecolor=MODE_FILL[mode], hatch=MODE_HATCH[mode], edgecolor="0.3", linewidth=0.5) for mode in order
    ]
    labels = [mode.label for mode in order]
    add_page_legend(figure, handles, labels, columns=len(order), width=width, loc="outside upper center")
