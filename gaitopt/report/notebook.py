"""What a notebook shows of gaits, walks, cycles and comparisons: the parts of the report, registered with IPython.

The results themselves know nothing of pages.  IPython is told by name which function draws which class, so that
nothing is imported before something is shown.
"""

from collections.abc import Callable
from typing import Any

from gaitopt.motion.gait import Gait
from gaitopt.report.markup import Element, element, to_html
from gaitopt.report.page import read_asset
from gaitopt.report.sections import comparison_card, cycle_card, gait_card, walk_card
from gaitopt.simulation.simulator import Rollout
from gaitopt.stability.cycle import Cycle
from gaitopt.study.comparison import Comparison

CARDS: dict[type, Callable[[Any], Element]] = {
    Gait: gait_card,
    Rollout: walk_card,
    Cycle: cycle_card,
    Comparison: comparison_card,
}


def show_in_notebook(result: Gait | Rollout | Cycle | Comparison) -> str:
    """Return a result as the HTML that a notebook shows for it, light or dark as the reader's screen is.

    Parameters
    ----------
    result : Gait, Rollout, Cycle or Comparison

    Returns
    -------
    str

    Examples
    --------
    >>> from gaitopt import load
    >>> show_in_notebook(load("docs/examples/compass_slip.h5")).count("<svg")
    2
    """
    card = CARDS[type(result)](result)
    return to_html(element("div", element("style", read_asset("parts.css")), card, class_="gaitopt"))
