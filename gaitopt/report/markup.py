"""HTML and SVG from nested elements, so that no text of a user can ever be taken for markup."""

import json
from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree

Element = ElementTree.Element
Content = Element | str | None


def element(tag: str, *content: Content, **attributes: object) -> Element:
    """Return an element of HTML or SVG.

    Parameters
    ----------
    tag : str
    *content : Element, str or None
        What it holds, in order; None holds nothing.
    **attributes
        ``class_`` stands for class, and an underscore for a hyphen; one that is None is left out.

    Examples
    --------
    >>> to_html(element("p", "a < b ", element("b", "c"), class_="note", data_step=1, title=None))
    '<p class="note" data-step="1">a &lt; b <b>c</b></p>'
    """
    made = Element(tag)
    for name, value in attributes.items():
        if value is not None:
            made.set(name.rstrip("_").replace("_", "-"), _spelled(value))
    for part in content:
        if isinstance(part, Element):
            made.append(part)
        elif part is not None and len(made):
            made[-1].tail = (made[-1].tail or "") + part
        elif part is not None:
            made.text = (made.text or "") + part
    return made


def to_html(made: Element) -> str:
    """Return an element as HTML text."""
    return ElementTree.tostring(made, encoding="unicode", method="html")


def data_element(data: Any, **attributes: object) -> Element:
    r"""Return a script element that holds data as JSON, which cannot end the script whatever its texts say.

    Examples
    --------
    >>> to_html(data_element(["</script>"]))
    '<script type="application/json">["<\\/script>"]</script>'
    """
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("</", "<\\/")
    return element("script", text, type="application/json", **attributes)


def table(rows: Sequence[Sequence[str]], head: Sequence[str] = (), *, name: str) -> Element:
    """Return a table whose first column names the rows, in a box that scrolls where it is too wide.

    Parameters
    ----------
    rows : sequence of sequences of str
    head : sequence of str
        Names of the columns; none for a table of facts.
    name : str
        Said by screen readers.
    """
    cells = [
        element("tr", element("th", row[0], scope="row"), *(element("td", cell) for cell in row[1:])) for row in rows
    ]
    top = element("thead", element("tr", *(element("th", title, scope="col") for title in head))) if head else None
    filled = element("table", top, element("tbody", *cells))
    return element("div", filled, class_="scrolls", role="region", tabindex=0, aria_label=name)


def points(*places: tuple[float, float]) -> str:
    """Return places as the text of a polyline [px].

    Examples
    --------
    >>> points((1, 2), (3.14159, 4))
    '1,2 3.14,4'
    """
    return " ".join(f"{_spelled(round(x, 2))},{_spelled(round(y, 2))}" for x, y in places)


def _spelled(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
