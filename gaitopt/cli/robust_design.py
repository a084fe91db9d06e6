"""Design of a robust gait: its plan, its test in unseen scenarios, and its files."""

import functools
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from gaitopt.cli.output import out, print_json, print_reason, report_file
from gaitopt.cli.output_files import create_folder, describe_earlier
from gaitopt.cli.progress_display import show_progress
from gaitopt.dataclass import dataclass
from gaitopt.errors import NoGaitError
from gaitopt.motion.gait import Gait
from gaitopt.motion.printable import format_count

if TYPE_CHECKING:
    from gaitopt.cli.failed_solve import FailureFile
    from gaitopt.design.robust_plan import RobustPlan
    from gaitopt.design.robust_problem import RobustProblem
    from gaitopt.design.scenario_test import ScenarioTest


@dataclass(frozen=True, kw_only=True)
class RobustDesign:
    """A robust plan and its tests.

    Attributes
    ----------
    plan : RobustPlan
    robust, nominal : ScenarioTest
        Tests of the plan and of the gait of lowest cost in the same unseen scenarios.
    files : tuple of Path
        The gait, and the tuned gains if there are any.
    """

    plan: "RobustPlan"
    robust: "ScenarioTest"
    nominal: "ScenarioTest"
    files: tuple[Path, ...]

    @property
    def passed(self) -> bool:
        """Whether the gait survives all candidate scenarios and all unseen ones."""
        return self.plan.robust and self.robust.passed

    @property
    def headline(self) -> str:
        """The result in one sentence; a plan that does not survive all unseen scenarios is not called robust."""
        text = str(self.plan)
        if not self.plan.robust:
            return text
        if self.robust.passed:
            return f"{text}; {self._unseen} survived"
        return f"not fully {text}; only {self._unseen} survived"

    @property
    def _unseen(self) -> str:
        return f"{self.robust.total_survived} of {self.robust.total} unseen scenarios"

    @property
    def remark(self) -> str:
        """Remark on the files; a plan that is not fully robust keeps their usual names, since it is a verified gait."""
        if self.plan.robust and not self.robust.passed:
            return f"not fully robust: only {self._unseen} survived"
        return ""

    @property
    def advice(self) -> str:
        """Changes with which more scenarios are survived; empty if all are, or the reason is not known."""
        if not self.plan.robust or self.robust.passed:
            return self.plan.advice
        from gaitopt.design.scenario_test import worst_walk

        scenarios = self.plan.scenarios
        worst = worst_walk(self.robust.failures, scenarios.tolerance)
        pushes = f" and more than {format_count(scenarios.pushes, 'push', 'pushes')} each" if scenarios.push else ""
        smaller = (
            "a smaller push= (gaitopt push states the largest one that a gait survives), " if scenarios.push else ""
        )
        remedy = (
            f"Worst unseen scenario: {str(worst).removesuffix('.')}. Plan for {smaller}narrower ranges or more "
            f"candidate scenarios, with more than {format_count(scenarios.values, 'value')} of each range{pushes} "
            "(values=, pushes= of Scenarios), or choose another law."
        )
        return f"{remedy} {self.plan.explain_deviation(worst)}".strip()

    def summarise(self) -> dict[str, Any]:
        """Return the results as plain data for JSON."""
        plan = self.plan
        return {
            "robust": plan.robust,
            "robust_unseen": self.robust.passed,
            "message": self.headline,
            "advice": self.advice,
            "additional_cost": plan.additional_cost,
            "objective": plan.gait.solver.objective,
            "nominal_objective": plan.nominal.solver.objective,
            "law": plan.law.name,
            "gains": plan.gains,
            "selected": [str(scenario) for scenario in plan.selected],
            "unseen": {"plan": _count(self.robust), "nominal": _count(self.nominal)},
            "files": [str(path) for path in self.files],
        }


def _count(test: "ScenarioTest") -> dict[str, int]:
    names = ("scenarios", "survived", "pushed", "recovered")
    return {name: getattr(test, name) for name in names}


def design_robust(stated: "RobustProblem", folder: Path, stem: str, *, count: int, repeat: str, json: bool) -> None:
    """Solve a robust problem, test its gait in unseen scenarios, save gait and gains, and report the results.

    `repeat` is the command that repeats the design.
    """
    from gaitopt.motion.atomic import check_writable

    stated = _load_law(stated)
    names = stem, f"{stem}_failed"
    with create_folder(folder):
        for name in names:
            for path in _paths(folder, name):
                check_writable(path)
        with show_progress(f"{stated.name}: planning and tuning", hidden=json) as display:
            plan = _solve(stated, folder, *names, repeat=repeat)
            display.describe(f"{stated.name}: test in {count} unseen scenarios")
            tests = [_test(stated, plan, count, nominal=nominal) for nominal in (False, True)]
        files = _save(plan, tests[0], *_paths(folder, names[not plan.robust]))
    result = RobustDesign(plan=plan, robust=tests[0], nominal=tests[1], files=files)
    if json:
        print_json(result.summarise())
    else:
        _print(result)
        if earlier := describe_earlier(_paths(folder, names[plan.robust])):
            out.print(earlier, soft_wrap=True)
    if not result.passed:
        print_reason(result.headline)
    raise typer.Exit(0 if result.passed else 1)


def _solve(stated: "RobustProblem", folder: Path, name: str, failed: str, *, repeat: str) -> "RobustPlan":
    """Return the plan; if a gait does not exist, its failed solve is written and the error names the file."""
    try:
        return stated.solve()
    except NoGaitError as error:
        if not isinstance(error.gait, Gait):
            raise
        from gaitopt.cli.failed_solve import write_failure

        file = _describe_failure(write_failure(error.gait, stated.problem, _paths(folder, failed)[0]))
        earlier = describe_earlier(_paths(folder, name))
        raise NoGaitError(f"{error} {file} {earlier} To repeat the design: {repeat}".replace("  ", " ")) from None


def _describe_failure(failure: "FailureFile") -> str:
    """Return a sentence on the file of a failed solve."""
    if failure.path is None:
        return f"Nothing was written: {failure.reason}."
    if failure.reason:
        return f"{failure.path} contains the last iterate; its solve cannot be repeated: {failure.reason}."
    return f"{failure.path} contains this problem without the scenarios, for 'gaitopt solve'."


def _paths(folder: Path, name: str) -> tuple[Path, Path]:
    """Return the files of a gait and of the gains of its law."""
    return folder / f"{name}.h5", folder / f"{name}_law.json"


def _load_law(stated: "RobustProblem") -> "RobustProblem":
    """Return the problem; a law SCRIPT.py:FUNCTION is replaced by this function."""
    from gaitopt.cli.script_law import custom_design
    from gaitopt.tuning.law_script import split_script_law

    source = split_script_law(stated.law) if isinstance(stated.law, str) else None
    return stated if source is None else replace(stated, law=functools.partial(custom_design, *source))


def _test(stated: "RobustProblem", plan: "RobustPlan", count: int, *, nominal: bool) -> "ScenarioTest":
    from gaitopt.design.scenario_test import check_scenarios

    gait, law = (plan.nominal, plan.nominal_law) if nominal else (plan.gait, plan.law)
    return check_scenarios(gait, law, stated.scenarios, count=count)


def _save(plan: "RobustPlan", unseen: "ScenarioTest", gait: Path, gains: Path) -> tuple[Path, ...]:
    """Write the gait with the result of its tests, and the tuned gains of its law if it has any."""
    from gaitopt.motion.archive import save
    from gaitopt.tuning.tuning_file import save_tuning

    written = save(plan.recorded_gait(unseen), gait)
    return (written,) if plan.tuning is None else (written, save_tuning(plan.tuning, gains))


def _print(result: RobustDesign) -> None:
    from gaitopt.motion.gait_table import format_objective
    from gaitopt.tuning.gain_units import describe_gains, format_gains

    plan = result.plan
    unit = plan.gait.problem.get("objective_unit")
    out.print(result.headline, soft_wrap=True)
    if result.advice:
        out.print(result.advice, soft_wrap=True)
    costs = [format_objective(gait.solver.objective, unit) for gait in (plan.gait, plan.nominal)]
    out.print(f"objective: {costs[0]}, without scenarios {costs[1]}")
    if plan.gains:
        family = plan.tuning.family if plan.tuning else ""
        out.print(f"{describe_gains(family)}: {format_gains(family, plan.gains)}", soft_wrap=True)
    out.print(f"gait in unseen scenarios: {result.robust}")
    out.print(f"gait of lowest cost in the same scenarios: {result.nominal}")
    for path in result.files:
        report_file(path, result.remark)
    if not plan.robust:
        out.print("the plan is not robust; its gait and gains were written for inspection")
