"""write_report: gaits as one self-contained HTML page for any browser."""

import base64
import hashlib
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.planar_gait import AnyGait, check_any_gait
from gaitopt.ocp.multistep.multistep_gait import MultiStepGait
from gaitopt.report.markup import Element, element, to_html
from gaitopt.report.multistep_section import multistep_section
from gaitopt.report.sections import AnyCycle, comparison_section, cycle_section, gait_section
from gaitopt.version import __version__

Reported = AnyGait | AnyCycle | MultiStepGait


@check_arguments
def write_report(gaits: Mapping[str, Reported], path: str | Path, *, title: str = "Gait report") -> Path:
    """Write gaits as one self-contained HTML page.

    A player shows the walker of each gait with its contact force in the friction cone and the marks of its slides, and
    moves a mark on every chart.  The page contains energy, multipliers (of the torques replayed in open loop), the
    resolved problem and versions; several gaits are compared in a table.  It loads nothing from the network.

    Parameters
    ----------
    gaits : mapping of str to Gait, PlanarGait, MultiStepGait, Cycle or PlanarCycle
        Optimal gaits, or periodic gaits of simulations, by title.  Gaits of several steps have no player.
    path : str or Path
        Usually ends in ``.html``.
    title : str
        Title of the page.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If there are no gaits.
    ArchiveError
        If the file is not writable; an older file of that name is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> from gaitopt import load, write_report
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page = write_report({"slipping": gait}, f"{folder}/report.html")
    ...     page.read_text(encoding="utf-8").count("<section")
    1
    """
    if not isinstance(gaits, Mapping):
        raise InputError('A report needs a mapping from titles to gaits, such as {"slipping": gait}.')
    if not gaits:
        raise InputError("A report needs at least one gait.")
    for gait in gaits.values():
        if not isinstance(gait, AnyCycle | MultiStepGait):
            check_any_gait(gait)
    path = Path(path)
    text = "<!doctype html>\n" + to_html(_page(gaits, title)) + "\n"
    with write_atomically(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def _section(gait: Reported, title: str, name: str) -> Element:
    if isinstance(gait, MultiStepGait):
        return multistep_section(gait, title=title, name=name)
    if isinstance(gait, AnyCycle):
        return cycle_section(gait, title=title, name=name)
    return gait_section(gait, title=title, name=name)


def read_asset(name: str) -> str:
    """Return the text of a style sheet or script of the page."""
    return (files("gaitopt.report") / "assets" / name).read_text(encoding="utf-8")


def content_policy(*scripts: str) -> str:
    """Return the content security policy of a page: it runs these scripts only, and loads nothing.

    Examples
    --------
    >>> content_policy("")[:49]
    "default-src 'none'; img-src data:; style-src 'uns"
    """
    digests = (base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts)
    sources = " ".join(f"'sha256-{digest}'" for digest in digests)
    return (
        "default-src 'none'; img-src data:; style-src 'unsafe-inline'; "
        f"script-src {sources}; base-uri 'none'; form-action 'none'"
    )


def _page(gaits: Mapping[str, Reported], title: str) -> Element:
    names = {f"gait-{number}": name for number, name in enumerate(gaits, start=1)}
    several = len(gaits) > 1
    optimal = {title: gait for title, gait in gaits.items() if not isinstance(gait, AnyCycle | MultiStepGait)}
    links = [element("a", title, href=f"#{name}") for name, title in names.items()]
    return document(
        title,
        element("header", element("h1", title), element("nav", *links, aria_label="Gaits") if several else None),
        comparison_section(optimal) if len(optimal) > 1 else None,
        *(_section(gaits[title], title, name) for name, title in names.items()),
        scripts=("player.js",),
    )


def document(
    title: str, *content: Element | None, scripts: Sequence[str], styles: Sequence[str] = ("page.css", "parts.css")
) -> Element:
    """Return a page that contains its styles and scripts.

    Parameters
    ----------
    title : str
    *content : Element or None
    scripts, styles : sequence of str
        Names of assets.
    """
    footer = element("footer", f"Written by gaitopt {__version__}.")
    texts = [read_asset(name) for name in scripts]
    body = element(
        "body", element("main", *content, footer), *(element("script", text) for text in texts), class_="gaitopt"
    )
    head = element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", http_equiv="Content-Security-Policy", content=content_policy(*texts)),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("meta", name="color-scheme", content="light dark"),
        element("title", title),
        element("link", rel="icon", href="data:,"),
        element("style", "".join(read_asset(name) for name in styles)),
    )
    return element("html", head, body, lang="en")
