"""Page on the infeasible random problems: table of results and shares."""

import numpy as np

LARGEST_RATIO = 5
"""Largest accepted ratio of the time of an infeasible problem to the median time of the feasible ones."""

FEASIBLE = ("solved", "plan_inaccurate")
"""Statuses of problems that are not infeasible: at least at the nodes, a motion satisfies all limits."""


def compose_page(results):
    """Return the page in Markdown."""
    rows, median = list_infeasible(results), median_feasible(results)
    return "\n".join(
        [
            "# Infeasible problems",
            "",
            f"Reports of the solver on {len(rows)} seeded random problems of the compass biped that have no gait near",
            "the initial guesses: a torque limit, a step length with little friction, or a speed is too demanding.",
            "Each problem is solved with the default options, and a feasible one (the same robot with usual limits)",
            "after it. The ratio is the processor time of the infeasible problem relative to the median of the",
            "feasible ones. Each limit that the report names is then changed in the original problem to the value",
            "that is reported as sufficient or, if this does not lead to a gait, removed; limits that suffice only",
            "together, which are joined by semicolons, are changed together. The changed problem is solved and its",
            "gait is verified by the simulator. The result of the change is in parentheses, that of the removal",
            "after the word *removed*; in some problems the limit was also removed although the change led to a",
            "gait. A problem is confirmed if each of its named limits leads to a verified gait in one of the two",
            "ways. Problems that turned out to be feasible are omitted, so some numbers are missing.",
            "",
            "This page is written by `python -m tests.benchmarks.infeasible_problems`.",
            "",
            summarise(results),
            "",
            "| no. | sequence | objective | status | time [s] | ratio | named limits (result of the change) |",
            "|---:|---|---|---|---:|---:|---|",
            *(compose_row(number, row, median) for number, row in rows),
            "",
            f"Date {results['date']}, gaitopt {results['versions']['gaitopt']}, CasADi "
            f"{results['versions']['casadi']}.",
            "",
        ]
    )


def compose_row(number, row, median):
    """Return the row of a problem."""
    sequence, objective = row["sequence"].replace("|", "\\|"), row["objective"].replace("_", " ")
    cells = [str(number), f"`{sequence}`", objective, row["status"].replace("_", " ")]
    cells += [f"{row['processor_seconds']:.2f}", f"{row['processor_seconds'] / median:.1f}"]
    groups = (f"{'; '.join(group['limits'])} ({describe_change(group)})" for group in row["groups"])
    return "| " + " | ".join([*cells, "<br>".join(groups)]) + " |"


def summarise(results):
    """Return the shares as a list in Markdown."""
    rows = [row for _, row in list_infeasible(results)]
    ratios = list_ratios(results)
    quantiles = ", ".join(f"{ratio:.1f}" for ratio in np.quantile(ratios, (0.5, 0.9, 1.0)))
    stated = sum(row["status"] == "infeasible" for row in rows)
    shares = [
        f"- reported as infeasible: {stated} of {len(rows)}",
        f"- median processor time of the feasible problems: {median_feasible(results):.2f} s",
        f"- reported within {LARGEST_RATIO} times this time: {np.sum(ratios <= LARGEST_RATIO)} of {len(rows)} "
        f"(ratio: median, 90 % quantile and largest {quantiles})",
        f"- confirmed: {sum(is_confirmed(row) for row in rows)} of {len(rows)}",
    ]
    shares.append(f"- confirmed with the sufficient values: {sum(is_confirmed(row, 'relaxed') for row in rows)}")
    inaccurate = [row["processor_seconds"] for row in list_inaccurate(results)]
    if inaccurate:
        shares.append(
            f"- not in the table, because the limits are satisfied at the nodes: {len(inaccurate)} with the status "
            "`plan_inaccurate`, after "
            f"at most {max(inaccurate):.1f} s of processor time"
        )
    return "\n".join(shares)


def describe_change(group):
    """Return the statuses of a problem with the sufficient values and, if it was solved, without the limits."""
    removed = "" if group["removed"] is None else f"; removed: {group['removed']}"
    return f"{group['relaxed']}{removed}".replace("_", " ")


def list_infeasible(results):
    """Return the numbers and rows of the problems for which no motion satisfies the limits, in their order."""
    rows = sorted((int(number), row) for number, row in results["problems"].items())
    return [(number, row) for number, row in rows if row["status"] not in FEASIBLE]


def list_inaccurate(results):
    """Return the rows of the problems whose limits are satisfied at the nodes, but not by a motion of the robot."""
    return [row for row in results["problems"].values() if row["status"] == "plan_inaccurate"]


def median_feasible(results):
    """Return the median processor time of the feasible problems that were solved."""
    rows = results["problems"].values()
    return float(np.median([row["feasible_seconds"] for row in rows if row["feasible_status"] == "solved"]))


def list_ratios(results):
    """Return the times of the infeasible problems relative to the median of the feasible ones."""
    return np.array([row["processor_seconds"] for _, row in list_infeasible(results)]) / median_feasible(results)


def is_confirmed(row, *ways):
    """Return whether every limit named leads to a verified gait in one of some ways of changing it."""
    ways = ways or ("relaxed", "removed")
    groups = row["groups"]
    return bool(groups) and all(any(group[way] == "solved" for way in ways) for group in groups)
