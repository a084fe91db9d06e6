"""Display of results and figures in notebooks, registered with IPython when gaitopt is imported there."""

from importlib import import_module

TYPE_CHECKING = False  # that of typing, whose import takes longer than all others of gaitopt
if TYPE_CHECKING:
    from typing import Any

DISPLAYED = {
    "gaitopt.motion.gait": "Gait",
    "gaitopt.motion.planar_gait": "PlanarGait",
    "gaitopt.ocp.multistep.multistep_gait": "MultiStepGait",
    "gaitopt.simulation.simulator": "Rollout",
    "gaitopt.stability.cycle": "Cycle",
    "gaitopt.stability.planar_gaits.planar_cycle": "PlanarCycle",
    "gaitopt.study.comparison": "Comparison",
}
"""Classes with a custom display, by name, so that nothing is imported before it is displayed."""

DRAWN = (
    ("gaitopt.study.sequence_search.ranking", "Ranking"),
    ("gaitopt.study.robustness.robustness_record", "RobustnessRecord"),
    ("gaitopt.continuation.branch_diagram", "BranchDiagram"),
    ("gaitopt.continuation.optimal.optimal_branch", "OptimalDiagram"),
    ("gaitopt.tuning.record", "Tuning"),
    ("gaitopt.tuning.tuning_file", "TunedGains"),
    ("gaitopt.design.family_gaits", "FamilyGaits"),
    ("gaitopt.design.robust_plan", "RobustPlan"),
    ("xarray.core.dataset", "Dataset"),
)
"""Classes that are displayed with their figure; of datasets, those of sweeps, basins and fronts."""


def load_ipython_extension(shell: "Any") -> None:
    """Register the display of results and figures; called in a notebook on import and by ``%load_ext gaitopt``."""

    def display(result: object) -> str:
        html: str = import_module("gaitopt.report.notebook").show_in_notebook(result)
        return html

    for module, name in DISPLAYED.items():
        shell.display_formatter.formatters["text/html"].for_type_by_name(module, name, display)

    def view(result: object) -> str:
        html: str = import_module("gaitopt.plot.result_view").view_result(result)
        return html

    for module, name in DRAWN:
        shell.display_formatter.formatters["text/html"].for_type_by_name(module, name, view)

    def draw(figure: object) -> object:
        return import_module("IPython.core.pylabtools").print_figure(figure, fmt="png")

    # Figures of gaitopt do not belong to pyplot, which displays its own; a backend set by %matplotlib takes precedence.
    shell.display_formatter.formatters["image/png"].for_type_by_name("matplotlib.figure", "Figure", draw)
