"""Command that audits gaitopt itself: audit."""

import contextlib
from collections import Counter
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitopt.cli.options import BasinOutput, Json, Quiet, Scheduler, Verbose, Workers
from gaitopt.cli.output import exit_incomplete, out, print_json, print_reason, report_file, verdict_text
from gaitopt.cli.progress_display import show_progress
from gaitopt.cli.workers import WorkerOptions, worker_options
from gaitopt.reductions import worst

if TYPE_CHECKING:
    from collections.abc import Mapping

    from gaitopt.parallel.execution import TaskObserver
    from gaitopt.study.audit.audit_file import AuditFile

LISTED = 20
"""Largest number of findings that are printed."""


def audit(
    count: Annotated[int, typer.Option(min=1, max=1_000_000, help="Number of problems.")] = 20,
    seed: Annotated[int, typer.Option(min=0, help="Random seed of the problems.")] = 18,
    starts: Annotated[
        int | None,
        typer.Option(
            min=2,
            max=100,
            help="Solve each problem again from this number of initial guesses, and compare the costs.",
            show_default="no second solve",
        ),
    ] = None,
    impulses: Annotated[
        bool,
        typer.Option("--impulses", help="Solve problems of the telescoping biped with impulses of its legs instead."),
    ] = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    output: BasinOutput = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Solve and verify random problems, and replay their gaits with a second integrator.

    The problems are installed scripts with random settings.  The second integrator shares only the symbolic equations
    of the robot with the simulator.  A false pass is a gait that the simulator verifies and the second integrator does
    not; a refused solution is one that the simulator does not verify.  Exit status 0 if there is no false pass, no
    refused solution and no error, 1 otherwise.

    Example: gaitopt audit --count 100 -o audit.json
    """
    from gaitopt.study.audit.audit_file import AuditFile
    from gaitopt.study.storage.study_lock import lock_study

    with (
        contextlib.nullcontext() if output is None else lock_study(output),
        worker_options(workers, scheduler) as team,
        show_progress("audit", hidden=json, counted="problems") as display,
    ):
        results = AuditFile(output, seed, starts, impulses=impulses)
        lost = _run(results, count, (seed, starts, impulses), team, display.count)
    rows = {key: results[key] for key in map(str, range(count)) if key in results}
    facts = summarise_audit(rows) | {"seed": seed, "count": count, "lost": lost}
    if json:
        print_json(facts | {"file": output and str(output)})
    else:
        _print_audit(facts, rows)
    if len(rows) + len(lost) < count:
        exit_incomplete("audit", output)
    if output is not None and not json:
        report_file(output)
    if facts["findings"] or lost:
        print_reason("Problems of the audit are not verified, or their processes died; see the table without --quiet.")
    raise typer.Exit(1 if facts["findings"] or lost else 0)


def _run(
    results: "AuditFile",
    count: int,
    shared: tuple[int, int | None, bool],
    team: WorkerOptions,
    observer: "TaskObserver",
) -> dict[str, str]:
    """Compute the results that are missing; return the reasons of those whose worker ended."""
    from gaitopt.cli.audit_problems import audit_number
    from gaitopt.parallel.runner import collect_tasks, run_tasks
    from gaitopt.parallel.task_graph import Task

    tasks = [Task(str(number), number) for number in range(count)]
    execution = team.execution(observer)
    try:
        running = run_tasks(audit_number, tasks, shared, known=results, execution=execution)
        return collect_tasks(running, results, tasks, observer).failures
    finally:
        results.write()


def summarise_audit(rows: "Mapping[str, Mapping[str, Any]]") -> dict[str, Any]:
    """Return the numbers of an audit: results, findings, and the costs relative to those of several starts.

    Parameters
    ----------
    rows : mapping of str to dict
        Results of :func:`gaitopt.study.audit.audited_problem.audit_problem` by the number of the problem.

    Examples
    --------
    >>> summarise_audit({"0": {"result": "verified", "script": "monopod"}})["results"]
    {'verified': 1}
    """
    from gaitopt.study.audit.audited_problem import ERROR, FALSE_PASS, REFUSED

    findings = [
        {"number": int(key), "result": row["result"], "script": row["script"], "settings": row.get("settings", [])}
        | {"reason": row.get("reason", "")}
        for key, row in rows.items()
        if row["result"] in (ERROR, FALSE_PASS, REFUSED)
    ]
    scripts = sorted({row["script"] for row in rows.values()})
    errors = [row["second_error"] for row in rows.values() if row.get("second_error") is not None]
    compared = [row["cost"] / row["best"] - 1 for row in rows.values() if row.get("best")]
    return {
        "results": dict(Counter(row["result"] for row in rows.values()).most_common()),
        "scripts": {
            name: dict(Counter(row["result"] for row in rows.values() if row["script"] == name)) for name in scripts
        },
        "largest_second_error": worst(0.0, errors),
        "compared": len(compared),
        "costlier_by_1_percent": sum(excess > 0.01 for excess in compared),
        "findings": findings,
    }


def _print_audit(facts: dict[str, Any], rows: "Mapping[str, Mapping[str, Any]]") -> None:
    """Print a table of the results by script, and the findings."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE, pad_edge=False)
    names = list(facts["results"])
    for column in ("script", "problems", *(name.replace("_", " ") for name in names)):
        table.add_column(column, no_wrap=True)
    for script, counts in facts["scripts"].items():
        table.add_row(script, str(sum(counts.values())), *(str(counts.get(name, 0)) for name in names))
    table.add_row("all", str(len(rows)), *(str(facts["results"][name]) for name in names))
    out.print(table)
    if facts["compared"]:
        out.print(
            f"cost more than 1 % above the lowest of several starts: {facts['costlier_by_1_percent']} of "
            f"{facts['compared']}"
        )
    for finding in facts["findings"][:LISTED]:
        out.print(verdict_text(f"{finding['result']}: {finding['reason']}", good=False), soft_wrap=True)
        words = " ".join(f'--set "{setting}"' for setting in finding["settings"])
        out.print(f"  problem {finding['number']}: gaitopt solve {finding['script']}.py {words}", soft_wrap=True)
    for key, reason in facts["lost"].items():
        out.print(f"problem {key}: {reason}", soft_wrap=True)
