"""Display of gaits, walks, cycles and comparisons in notebooks, made of the parts of the report.

IPython is given the function for each class by name, so that nothing is imported before a result is displayed.
"""

from collections.abc import Callable
from typing import Any

from gaitopt.arguments import check_arguments
from gaitopt.motion.gait import Gait
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.ocp.multistep.multistep_gait import MultiStepGait
from gaitopt.report.markup import Element, element, to_html
from gaitopt.report.multistep_section import multistep_card
from gaitopt.report.page import read_asset
from gaitopt.report.sections import AnyCycle, comparison_card, cycle_card, gait_card, walk_card
from gaitopt.simulation.simulator import Rollout
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
from gaitopt.study.comparison import Comparison

CARDS: dict[type, Callable[[Any], Element]] = {
    Gait: gait_card,
    PlanarGait: gait_card,
    MultiStepGait: multistep_card,
    Rollout: walk_card,
    Cycle: cycle_card,
    PlanarCycle: cycle_card,
    Comparison: comparison_card,
}


@check_arguments
def show_in_notebook(result: Gait | PlanarGait | MultiStepGait | Rollout | AnyCycle | Comparison) -> str:
    """Return a result as HTML for a notebook, in the light or dark colour scheme of the reader.

    Parameters
    ----------
    result : Gait, PlanarGait, MultiStepGait, Rollout, Cycle, PlanarCycle or Comparison

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
