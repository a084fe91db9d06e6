"""plot_result: the figure of a result of any kind."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.plot.style import FigureStyle

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURES = {
    "Gait": "gait_figure:plot_gait",
    "PlanarGait": "gait_figure:plot_gait",
    "MultiStepGait": "gait_figure:plot_motion",
    "Rollout": "gait_figure:plot_motion",
    "Cycle": "gait_figure:plot_motion",
    "PlanarCycle": "gait_figure:plot_motion",
    "Comparison": "comparison_figure:plot_comparison",
    "BranchDiagram": "branch_figure:plot_branches",
    "OptimalDiagram": "optimum_figure:plot_optima",
    "Ranking": "ranking_figure:plot_ranking",
    "RobustnessRecord": "robustness_figure:plot_robustness",
    "TunedGains": "tuning_figure:plot_tuning",
    "Tuning": "tuning_figure:plot_tuning",
}
"""Functions that draw each class of result, by name, so that only the one that is used is imported."""

TABLES = {
    "gaitopt sweep": "sweep_figure:plot_sweep",
    "gaitopt basin": "basin_figure:plot_basin",
    "gaitopt set of basins along a branch": "branch_basin_figure:plot_branch_basin",
    "gaitopt front": "front_figure:plot_front",
}
"""Functions that draw each kind of dataset, by its attribute ``format``."""

QUANTITIES = {"plot_sweep": "quantity", "plot_branches": "coordinate"}
"""Parameter that selects the quantity of a figure, by its function."""


def find_figure(result: Any) -> str | None:
    """Return the name of the function that draws a result; None if it is not a result of gaitopt.

    The result may be a dictionary of push tests, which share a figure.

    Examples
    --------
    >>> from gaitopt import load
    >>> find_figure(load("docs/examples/compass_slip.h5")), find_figure(1.0)
    ('gait_figure:plot_gait', None)
    """
    tests = list(result.values()) if isinstance(result, dict) else []
    if tests and {find_figure(test) for test in tests} == {FIGURES["RobustnessRecord"]}:
        return FIGURES["RobustnessRecord"]
    kind = type(result)
    if kind.__name__ == "BranchDiagram" and result.curves:
        return "curve_figure:plot_curves"
    if kind.__module__.startswith("gaitopt.") and kind.__name__ in FIGURES:
        return FIGURES[kind.__name__]
    stored = getattr(result, "attrs", {}).get("format")
    return TABLES.get(stored) if isinstance(stored, str) else None


@check_arguments
def plot_result(result: Any, *, quantity: str | None = None, style: FigureStyle | None = None) -> "Figure":
    """Draw a result of any kind with the function for this kind.

    Parameters
    ----------
    result : Gait, PlanarGait, MultiStepGait, Rollout, Cycle, Comparison, BranchDiagram, OptimalDiagram, Ranking, \
Tuning, TunedGains, RobustnessRecord or xarray.Dataset
        Such as from :func:`gaitopt.study.load_result`; a dataset is that of a sweep, a basin, basins along
        a branch, or a front.  A dictionary of RobustnessRecord by label is drawn in one figure.
    quantity : str, optional
        Variable of a sweep, or coordinate of a diagram of periodic gaits.
    style : FigureStyle, optional

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the result is of another class or has nothing to draw, or its figure has no choice of a quantity.

    Examples
    --------
    >>> from gaitopt.study import load_result
    >>> figure = plot_result(load_result("docs/examples/compass_slope.nc"), style=FigureStyle(width=3.5))
    >>> figure.axes[-1].get_ylabel().split()
    ['spectral', 'radius', 'of', 'the', 'period']
    """
    name = find_figure(result)
    if quantity is not None and name == "curve_figure:plot_curves":
        name = FIGURES["BranchDiagram"]
    if name is None:
        raise InputError(
            f"There is no figure of an object of class {type(result).__name__}; accepted are {', '.join(FIGURES)}, and "
            "the datasets of sweeps, basins and fronts."
        )
    module, _, function = name.partition(":")
    options: dict[str, Any] = {"style": style}
    if quantity is not None:
        if function not in QUANTITIES:
            raise InputError(
                f"The quantity {quantity!r} is not available: only sweeps and diagrams of periodic gaits have one."
            )
        options[QUANTITIES[function]] = quantity
    draw = getattr(import_module(f"gaitopt.plot.{module}"), function)
    figure: Figure = draw(result.motion if function == "plot_motion" else result, **options)
    return figure
