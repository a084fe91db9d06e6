"""Views of results in notebooks: a line of text, a table of numbers, and the figure of the result."""

import html
import io
from typing import TYPE_CHECKING, Any

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.plot.result_figure import find_figure, plot_result
from gaitopt.plot.style import FigureStyle

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH = 6.0
"""Width of a figure in a notebook [inch]."""


MOST_LETTERS = 200
"""Number of letters of an attribute of a dataset that are shown."""


@check_arguments
def view_result(result: Any) -> str:
    """Return a result as HTML for a notebook: its short form, the numbers of a design, and its figure.

    A dataset of another origin is displayed by xarray.

    Parameters
    ----------
    result : object
        Any result that :func:`gaitopt.plot.plot_result` draws, or that of a design: FamilyGaits or RobustPlan.

    Returns
    -------
    str

    Examples
    --------
    >>> from gaitopt import load_diagram
    >>> view_result(load_diagram("docs/examples/compass_slope.nc")).count("<svg")
    1
    """
    drawn = _draw(result)
    if hasattr(result, "assign_attrs"):
        result = result.assign_attrs({name: _shorten(value) for name, value in result.attrs.items()})
    markup = getattr(result, "_repr_html_", None)  # of a dataset
    if markup is not None:
        return str(markup()) if drawn is None else f"<div>{drawn}{markup()}</div>"
    parts = [f"<p><code>{html.escape(repr(result))}</code></p>", _tabulate_design(result), drawn or ""]
    return f'<div class="gaitopt">{"".join(parts)}</div>'


def _shorten(value: Any) -> Any:
    """Return an attribute of a dataset, a long text such as the statement of a study cut after some letters."""
    return f"{value[:MOST_LETTERS]} ..." if isinstance(value, str) and len(value) > MOST_LETTERS else value


def _draw(result: Any) -> str | None:
    """Return the figure of a result as SVG; None if there is nothing to draw."""
    shown = getattr(result, "gait", None) if find_figure(result) is None else result
    if find_figure(shown) is None:
        return None
    try:
        figure = plot_result(shown, style=FigureStyle(width=WIDTH, titled=False))
    except InputError:  # such as a sweep in which no point has a gait
        return None
    except (AttributeError, KeyError, TypeError, ValueError):
        if hasattr(result, "data_vars"):  # a part of a dataset, without some variables or dimensions
            return None
        raise
    return _to_svg(figure)


def _to_svg(figure: "Figure") -> str:
    """Return a figure as an SVG element."""
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    content = text.getvalue()
    return content[content.index("<svg") :].replace("<svg ", '<svg style="max-width: 100%; height: auto" ', 1)


def _tabulate_design(result: Any) -> str:
    """Return the parameters or gains of a design as a table; nothing for other results."""
    values = {**getattr(result, "design", {}), **getattr(result, "gains", {})}
    rows = [f"<tr><th>{html.escape(name)}</th><td>{value:.6g}</td></tr>" for name, value in values.items()]
    return f"<table>{''.join(rows)}</table>" if rows else ""
