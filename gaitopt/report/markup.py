"""HTML and SVG from nested elements, which escape the texts of users."""

import json
from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree

from gaitopt.motion.printable import replace_controls, typeset_powers

Element = ElementTree.Element
Content = Element | str | None


def element(tag: str, *content: Content, **attributes: object) -> Element:
    """Return an element of HTML or SVG.

    Parameters
    ----------
    tag : str
    *content : Element, str or None
        Content in order; None is skipped.
    **attributes
        ``class_`` stands for class, and an underscore for a hyphen; an attribute that is None is omitted.

    Examples
    --------
    >>> to_html(element("p", "a < b ", element("b", "c"), class_="note", data_step=1, title=None))
    '<p class="note" data-step="1">a &lt; b <b>c</b></p>'
    """
    made = Element(tag)
    for name, value in attributes.items():
        if value is not None:
            made.set(name.rstrip("_").replace("_", "-"), _format_value(value))
    for part in content:
        if isinstance(part, Element):
            made.append(part)
        elif part is not None and len(made):
            made[-1].tail = (made[-1].tail or "") + part
        elif part is not None:
            made.text = (made.text or "") + part
    return made


def to_html(made: Element) -> str:
    """Return an element as HTML text, without control characters."""
    return replace_controls(ElementTree.tostring(made, encoding="unicode", method="html"))


def data_element(data: Any, **attributes: object) -> Element:
    r"""Return a script element that contains data as JSON, with its texts escaped.

    Examples
    --------
    >>> to_html(data_element(["</script>"]))
    '<script type="application/json">["\\u003c/script>"]</script>'
    """
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return element("script", text, type="application/json", **attributes)


def table(rows: Sequence[Sequence[str]], head: Sequence[str] = (), *, name: str) -> Element:
    """Return a table whose first column names the rows, in a box that scrolls if it is too wide.

    Powers of units, as in ``m/s^2``, are typeset as superscripts.

    Parameters
    ----------
    rows : sequence of sequences of str
    head : sequence of str
        Names of the columns; none for a table of facts.
    name : str
        Label for screen readers.
    """
    cells = [
        element("tr", element("th", row[0], scope="row"), *(element("td", cell) for cell in row[1:]))
        for row in (tuple(map(typeset_powers, row)) for row in rows)
    ]
    titles = [element("th", title, scope="col") if title else element("td") for title in map(typeset_powers, head)]
    top = element("thead", element("tr", *titles)) if head else None
    filled = element("table", top, element("tbody", *cells))
    return element("div", filled, class_="scrolls", role="group", tabindex=0, aria_label=name)


def points(*places: tuple[float, float]) -> str:
    """Return places as the text of a polyline [px].

    Examples
    --------
    >>> points((1, 2), (3.14159, 4))
    '1,2 3.14,4'
    """
    return " ".join(f"{_format_value(round(x, 2))},{_format_value(round(y, 2))}" for x, y in places)


def _format_value(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
