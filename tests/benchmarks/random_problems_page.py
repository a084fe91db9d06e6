"""Page on the random problems: table of results and shares."""

import numpy as np

NEAR = 0.005
"""Relative excess over the best known cost that counts as near."""

AGREEMENT = 1e-4
"""Relative difference of the minimised, planned and replayed cost that counts as agreement."""

FACTOR, LEAST_ERROR = 3, 5e-4
"""Factor within which an estimate is right, and the relative error below which it is not compared."""


def compose_page(results, best):
    """Return the page in Markdown from the results of the default solve and the best known costs."""
    rows = sorted((int(number), row) for number, row in results["problems"].items())
    return "\n".join(
        [
            "# Random problems",
            "",
            f"Optimal gaits of {len(rows)} seeded random problems of the compass biped, each solved with the default",
            "options. Friction (0.1 to 0.25), speed, step length and torque limit (8 to 20 N m) vary in all",
            "problems; masses, leg length and centre of mass vary in half of them. Costs are dimensionless; those of",
            "squared torques are in N² m² s. The best known cost is the lowest of 12 starts on two coarse grids,",
            "whose best solutions are refined to 80 and 160 intervals and replayed, or that of the default solve if",
            "it is lower. The excess is the relative difference between the cost of the default solve and the best",
            "known one; it contains the error of the grid and, if the default solve ends in another local optimum,",
            "the difference between the two optima. The error of the grid is the relative difference between the",
            "cost of the default solve and that of the same local optimum on 160 intervals, for which the default",
            "solution is the initial guess. The estimate of this error is the one reported by the solve",
            f"(`cost_error`); in the list below, errors and estimates of less than {100 * LEAST_ERROR:g} % count as",
            f"{100 * LEAST_ERROR:g} %. The disagreement is the largest relative difference of the minimised, the",
            "planned and the replayed cost. The processor time in the table includes the construction of the NLPs,",
            "which later problems of the same kind use again.",
            "",
            "This page is written by `python -m tests.benchmarks.random_problems`.",
            "",
            summarise(results, best),
            "",
            "| no. | sequence | objective | status | replay | cost | best known | excess [%] | error [%] "
            "| estimate [%] | disagreement | processor time [s] |",
            "|---:|---|---|---|---|---:|---:|---:|---:|---:|---:|---:|",
            *(compose_row(number, row, find_best(best, number, row)) for number, row in rows),
            "",
            f"Date {results['date']}, gaitopt {results['versions']['gaitopt']}, CasADi "
            f"{results['versions']['casadi']}; best known costs of {best.get('date', 'unknown date')}.",
            "",
        ]
    )


def compose_row(number, row, best):
    """Return the row of a problem."""
    sequence = row["sequence"].replace("|", "\\|")
    cells = [str(number), f"`{sequence}`", row["objective"].replace("_", " "), row["status"].replace("_", " ")]
    replay = row.get("verified", "").replace("_", " ")
    cells += ["passed" if replay == "solved" else replay, text(row["cost"], ".6g"), text(best, ".6g")]
    cells += [text(percent(value), ".3f") for value in (excess(row, best), grid_error(row), row.get("estimate"))]
    cells += [text(disagreement(row), ".0e"), text(row["processor_seconds"], ".2f")]
    return "| " + " | ".join(cells) + " |"


def summarise(results, best):
    """Return the shares as a list in Markdown."""
    rows = {int(number): row for number, row in results["problems"].items()}
    solved = [row for row in rows.values() if row["status"] == "solved"]
    refused = [row for row in solved if row["verified"] != "solved"]
    feasible = {n: find_best(best, n, row) for n, row in rows.items() if find_best(best, n, row) is not None}
    compared = [excess(rows[n], cost) for n, cost in feasible.items()]
    near = sum(value is not None and value <= NEAR for value in compared)
    agreeing = sum(disagreement(row) is not None and disagreement(row) <= AGREEMENT for row in solved)
    lines = [
        f"- solved: {len(solved)} of {len(rows)}; of these, failed the replay: {len(refused)}",
        f"- within {100 * NEAR:g} % of the best known cost: {near} of {len(compared)} with a known gait",
        f"- minimised, planned and replayed cost within a relative difference of {AGREEMENT:g}: "
        f"{agreeing} of {len(solved)}",
    ]
    reported = {n: row for n, row in rows.items() if row.get("estimate") is not None}
    for text_of_truth, truths in (
        ("error of the grid", {n: grid_error(row) for n, row in reported.items()}),
        ("excess over the best known cost", {n: excess(row, feasible.get(n)) for n, row in reported.items()}),
    ):
        known = {n: truth for n, truth in truths.items() if truth is not None}
        if known:
            right = sum(is_right(reported[n]["estimate"], truth) for n, truth in known.items())
            lines.append(f"- estimate within a factor of {FACTOR} of the {text_of_truth}: {right} of {len(known)}")
    seconds = np.quantile([row["processor_seconds"] - row["build_seconds"] for row in rows.values()], (0.5, 0.9))
    median, quantile = seconds
    lines.append(
        f"- processor time without the construction of the NLPs: median {median:.2f} s, 90 % quantile {quantile:.2f} s"
    )
    return "\n".join(lines)


def find_best(best, number, row):
    """Return the best known cost of a problem, that of the row included; None without a gait."""
    known = best["problems"].get(str(number), {}).get("best")
    costs = [cost for cost in (known, row["cost"]) if cost is not None]
    return None if known is None else min(costs)


def excess(row, best):
    """Return the relative excess of a cost over the best known one; None without either."""
    return None if best is None or row["cost"] is None else row["cost"] / best - 1


def grid_error(row):
    """Return the absolute relative difference of a cost from that of the same optimum on the finest grid, or None."""
    return None if row.get("limit") is None or row["cost"] is None else abs(row["cost"] / row["limit"] - 1)


def disagreement(row):
    """Return the largest relative difference of the minimised, planned and replayed cost from the cost; or None."""
    if row["cost"] is None:
        return None
    others = [row[name] for name in ("plan", "minimised", "replayed") if row[name] is not None]
    return max(abs(other / row["cost"] - 1) for other in others)


def is_right(estimate, error):
    """Return whether an estimate is within a factor of the error, errors below the least one being equal."""
    low, high = sorted((max(estimate, LEAST_ERROR), max(error, LEAST_ERROR)))
    return high <= FACTOR * low


def percent(value):
    """Return a share in percent, or None."""
    return None if value is None else 100 * value


def text(value, form):
    """Return a formatted number, or an empty text for None."""
    return "" if value is None else format(value, form)
