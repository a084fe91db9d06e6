"""gaitopt: optimal-control gait design for planar walking with foot slippage.

Everything listed in ``__all__`` is public and loaded when first used, so that importing gaitopt is quick.
"""

import sys
from importlib import import_module, metadata
from typing import Any

try:
    __version__ = metadata.version("gaitopt")
except metadata.PackageNotFoundError:  # a source tree that is not installed
    __version__ = "0+unknown"

_PUBLIC = {
    "gaitopt.continuation.branch": ("Branch", "SpecialPoint"),
    "gaitopt.continuation.tracing": ("trace_branch",),
    "gaitopt.control.computed_torque": ("computed_torque",),
    "gaitopt.control.joint_pd": ("joint_pd",),
    "gaitopt.control.law": ("Law", "feedforward", "passive"),
    "gaitopt.control.phase_variable": ("by_stance_angle",),
    "gaitopt.control.state_feedback": ("state_feedback",),
    "gaitopt.control.step_to_step": ("step_to_step",),
    "gaitopt.errors": ("ArchiveError", "GaitoptError", "InputError", "ScriptError", "SequenceError"),
    "gaitopt.export.c_code": ("write_c",),
    "gaitopt.export.csv_file": ("write_csv",),
    "gaitopt.export.torque_table": ("write_torques",),
    "gaitopt.model.assembly": ("assemble",),
    "gaitopt.model.robots.catalogue": ("robot_named",),
    "gaitopt.model.check": ("RobotCheck", "check_robot"),
    "gaitopt.model.robots.compass": ("compass_biped",),
    "gaitopt.model.contacts.impact": ("Impact", "complementarity_pairs", "solve_impact"),
    "gaitopt.model.mechanics": ("PointMass", "RigidLink"),
    "gaitopt.model.contacts.mode": ("Mode",),
    "gaitopt.model.robots.rimless": ("rimless_wheel",),
    "gaitopt.model.robot": ("Coordinates", "Robot"),
    "gaitopt.motion.archive": ("load", "save"),
    "gaitopt.motion.energy": ("Ledger", "absolute_work", "cost_of_transport", "ledger", "positive_work"),
    "gaitopt.motion.gait": ("Gait", "SolverReport", "Verification", "Violation"),
    "gaitopt.motion.motion": ("Jump", "Motion", "Segment"),
    "gaitopt.motion.proposal": ("Proposal",),
    "gaitopt.motion.solution": ("Solution", "Table"),
    "gaitopt.motion.summary": ("summarise",),
    "gaitopt.motion.contact_sequence": ("ContactSequence",),
    "gaitopt.ocp.transcription.collocation": ("Collocation",),
    "gaitopt.ocp.statement.warm_start": ("WarmStart", "FromMotion"),
    "gaitopt.ocp.statement.initial_guess": ("Guess", "Keyframes", "LinearGuess", "RandomPerturbation"),
    "gaitopt.ocp.mode_search.homotopy": ("Homotopy",),
    "gaitopt.ocp.nlp.ipopt": ("Ipopt",),
    "gaitopt.ocp.nlp.active_set": ("Newton",),
    "gaitopt.ocp.statement.limits": ("Limits", "Margins"),
    "gaitopt.ocp.statement.objective": ("CostOfTransport", "Objective", "PositiveWork", "TorqueSquared"),
    "gaitopt.ocp.solve.passive_gait": ("passive_cycle",),
    "gaitopt.ocp.problem": ("GaitProblem",),
    "gaitopt.ocp.transcription.relaxation": ("ExactPenalty", "FischerBurmeister", "Relaxation", "Scholtes"),
    "gaitopt.ocp.transcription.shooting": ("MultipleShooting",),
    "gaitopt.ocp.solver": ("solve",),
    "gaitopt.parameters": ("Parameter",),
    "gaitopt.plot.animation": ("animate",),
    "gaitopt.plot.comparison_figure": ("plot_comparison",),
    "gaitopt.plot.gait_figure": ("plot_gait",),
    "gaitopt.plot.saving": ("save_figure",),
    "gaitopt.plot.style": ("FigureStyle",),
    "gaitopt.progress": ("HomotopyIteration", "Iteration"),
    "gaitopt.report.notebook": ("show_in_notebook",),
    "gaitopt.report.page": ("write_report",),
    "gaitopt.simulation.engine_choice": ("default_engine",),
    "gaitopt.simulation.scipy_engine": ("ScipyEngine",),
    "gaitopt.simulation.simulator": ("Event", "Rollout", "simulate"),
    "gaitopt.simulation.verification": ("Tolerances", "replay", "verify"),
    "gaitopt.stability.assessment": ("assess_stability",),
    "gaitopt.stability.critical_friction": ("CriticalFriction",),
    "gaitopt.stability.cycle": ("Cycle",),
    "gaitopt.stability.gain_sensitivity": ("GainSensitivity", "gain_sensitivity"),
    "gaitopt.stability.recovery": ("PushTest", "Recovery", "largest_recovery", "recovery"),
    "gaitopt.stability.cycle_search": ("find_cycles",),
    "gaitopt.stability.summary": ("summarise_cycle",),
    "gaitopt.stability.walk_problem": ("WalkProblem",),
    "gaitopt.status": ("Status", "Stop"),
    "gaitopt.study.basin.basin": ("basin", "basin_edges"),
    "gaitopt.study.basin.basin_file": ("Basin", "load_basin", "save_basin"),
    "gaitopt.parallel.dask_executor": ("DaskCluster",),
    "gaitopt.study.comparison": ("Comparison", "compare"),
    "gaitopt.study.robustness.robustness_margins": ("RobustnessMargins", "WalkTest", "assess_robustness"),
    "gaitopt.study.imitation": ("Imitation", "controlled_gait", "imitate"),
    "gaitopt.study.sequence_search.ranking": ("RankedGait", "Ranking"),
    "gaitopt.study.published_values": ("PublishedValue", "Reproduction"),
    "gaitopt.study.sequence_search.search": ("search",),
    "gaitopt.study.basin.attractor": ("SettlingCriterion",),
    "gaitopt.study.sweep.sweep": ("sweep",),
    "gaitopt.study.sweep.sweep_file": ("load_sweep", "load_sweep_gait"),
    "gaitopt.tuning.controller_family": ("ControllerFamily", "Gain", "controller_family_named"),
    "gaitopt.tuning.lqr": ("LqrWeights", "lqr", "step_lqr"),
    "gaitopt.tuning.objective": ("SensitivityNorm", "SpectralRadius"),
    "gaitopt.tuning.record": ("Trial", "Tuning"),
    "gaitopt.tuning.gain_search": ("GainSearchOptions",),
    "gaitopt.tuning.tune": ("tune_feedback",),
}
_HOME = {name: module for module, names in _PUBLIC.items() for name in names}

__all__ = ["__version__", *sorted(_HOME)]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'gaitopt' has no attribute {name!r}")
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__


_SHOWN = {
    "gaitopt.motion.gait": "Gait",
    "gaitopt.simulation.simulator": "Rollout",
    "gaitopt.stability.cycle": "Cycle",
    "gaitopt.study.comparison": "Comparison",
}
"""Classes that notebooks draw, by name: the layers of the results know nothing of pages."""


def load_ipython_extension(shell: Any) -> None:
    """Let notebooks draw results and figures; called when gaitopt is imported in one, or by ``%load_ext gaitopt``."""

    def show(result: Any) -> str:
        html: str = import_module("gaitopt.report.notebook").show_in_notebook(result)
        return html

    for module, name in _SHOWN.items():
        shell.display_formatter.formatters["text/html"].for_type_by_name(module, name, show)

    def draw(figure: Any) -> Any:
        return import_module("IPython.core.pylabtools").print_figure(figure, fmt="png")

    # Ours are not pyplot's, which notebooks draw by themselves; where %matplotlib has a say, it keeps it.
    shell.display_formatter.formatters["image/png"].for_type_by_name("matplotlib.figure", "Figure", draw)


if "IPython" in sys.modules and (_shell := sys.modules["IPython"].get_ipython()) is not None:
    load_ipython_extension(_shell)
