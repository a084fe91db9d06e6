"""The command that runs a study script."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from gaitopt.cli.options import Figure, Json, Quiet, Setting, StudyFile, Verbose
from gaitopt.cli.output import out, print_json, print_reason, report_file
from gaitopt.cli.progress_display import show_progress
from gaitopt.cli.result_output import find_facts, has_output, print_result
from gaitopt.errors import InputError

if TYPE_CHECKING:
    from gaitopt.study.published_values import Reproduction


def run(
    script: StudyFile,
    setting: Setting = None,
    output: Figure = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Run a study script: save its figures, print its results and compare its numbers with published ones.

    The function study() of the script returns a Reproduction, a figure, any result (gait, sweep, basin, search, front,
    diagram, comparison, tuned gains, push test), a number, or a mapping of names to these.  The figure is written to
    SCRIPT.png unless --output names another file; those of a mapping to SCRIPT_NAME.png.  Exit status 1 if a number
    differs from the published one in its printed digits, 0 otherwise.

    Example: gaitopt run problems/studies/compass_multipliers.py
    """
    from gaitopt.cli.script import call_script
    from gaitopt.motion.atomic import check_writable

    path = output or Path(f"{script.stem}.png")
    check_writable(path)
    with show_progress(f"running {script.name}", hidden=json):
        study = call_script(script, setting or [], "study")
        parts = study if isinstance(study, Mapping) and not has_output(study) else {"": study}
        check_parts(parts, script)
        written = {name: draw_part(part, name_figure(path, str(name))) for name, part in parts.items()}
    if json:
        facts = {str(name): _facts_of(part, written[name]) for name, part in parts.items()}
        print_json(facts[""] if list(facts) == [""] else {"results": facts})
    else:
        for name, part in parts.items():
            _print_part(str(name), part, written[name])
    agree = all(_agrees(part) for part in parts.values())
    if not agree:
        print_reason("Some numbers of the study differ from the published ones.")
    raise typer.Exit(0 if agree else 1)


def check_parts(parts: Mapping[Any, Any], script: Path) -> None:
    """Raise InputError unless each part of a study is a result, and their figures have different names."""
    from gaitopt.plot.result_figure import find_figure

    drawn = [str(name) for name, part in parts.items() if not isinstance(part, int | float)]
    files = [name_figure(Path("a.png"), name).name for name in drawn]
    if len(set(files)) < len(files):
        raise InputError(
            f"The names of the results of {script} must still differ if each character other than a letter, a digit, "
            f"'+', '-' or '.' is replaced by '_', got {drawn}."
        )
    for part in parts.values():
        is_result = has_output(part) or find_figure(part) is not None
        if not (is_result or _is_reproduction(part) or _is_figure(part) or isinstance(part, int | float)):
            raise InputError(
                f"study() of {script} must return a Reproduction, a figure, a result of gaitopt, a number, or a "
                f"mapping of names to these; it returned {type(part).__name__}."
            )


def name_figure(path: Path, name: str) -> Path:
    """Return the file of the figure of a part of a study.

    Examples
    --------
    >>> name_figure(Path("study.png"), "slow walk").name, name_figure(Path("study.png"), "").name
    ('study_slow_walk.png', 'study.png')
    """
    word = "".join(letter if letter.isalnum() or letter in "+-." else "_" for letter in name)
    return path.with_name(f"{path.stem}_{word}{path.suffix}") if word else path


def draw_part(part: Any, path: Path) -> Path | None:
    """Write the figure of a part of a study; return its path, or None for a part without a figure."""
    from gaitopt.plot.result_figure import find_figure, plot_result
    from gaitopt.plot.saving import save_figure

    if _is_reproduction(part):
        return save_figure(part.figure, path)
    if _is_figure(part):
        return save_figure(part, path)
    return save_figure(plot_result(part), path) if find_figure(part) else None


def _is_figure(part: Any) -> bool:
    from matplotlib.figure import Figure

    return isinstance(part, Figure)


def _is_reproduction(part: Any) -> bool:
    from gaitopt.study.published_values import Reproduction

    return isinstance(part, Reproduction)


def _numbers_of(study: "Reproduction") -> list[dict[str, Any]]:
    return [
        dataclasses.asdict(number) | {"difference": number.difference, "agrees": number.agrees}
        for number in study.numbers
    ]


def _facts_of(part: Any, figure: Path | None) -> dict[str, Any]:
    """Return a part of a study as plain data."""
    facts: dict[str, Any] = {"figure": None if figure is None else str(figure)}
    if _is_reproduction(part):
        return facts | {"numbers": _numbers_of(part), "remarks": list(part.remarks)}
    if isinstance(part, int | float):
        return {"value": part}
    return facts | ({"result": find_facts(part)} if has_output(part) else {})


def _print_part(name: str, part: Any, figure: Path | None) -> None:
    from gaitopt.cli.walk_output import print_numbers

    if isinstance(part, int | float):
        out.print(f"{name or 'result'}: {part:.10g}")
        return
    if name:
        out.print(name)
    if _is_reproduction(part):
        print_numbers(_numbers_of(part), part.remarks)
    elif has_output(part):
        print_result(part)
    if figure is not None:
        report_file(figure)


def _agrees(part: Any) -> bool:
    """Return whether the numbers of a part agree with published ones; true for parts without published ones."""
    return not _is_reproduction(part) or all(number.agrees for number in part.numbers)
