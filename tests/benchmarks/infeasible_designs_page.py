"""Page on the infeasible design problems: table of results and shares."""

from tests.benchmarks.infeasible_problems_page import describe_change, is_confirmed, list_infeasible


def compose_page(results):
    """Return the page in Markdown."""
    rows = list_infeasible(results)
    return "\n".join(
        [
            "# Infeasible designs",
            "",
            f"Reports of the solver on {len(rows)} seeded random design problems of the compass biped that have no",
            "gait near the initial guesses. The centre of mass of the legs (`leg_com`) and the hip mass are free",
            "within narrow bounds, and one demand is excessive: the torque limit (*peak torque*), the friction",
            "coefficient, the speed, the step length, or the bound on the spectral radius. Each limit that the",
            "report names is changed to the value that is reported as sufficient or, if this does not lead to a",
            "gait, removed; limits that suffice only together form a set, are joined by semicolons, and are changed",
            "together. The numbers of a free parameter are its bound and a sufficient bound. The changed problem is",
            "solved, its gait is verified by the simulator, and its spectral radius",
            "is computed. The result of the change is in parentheses, that of the removal after the word *removed*.",
            "A problem is confirmed if each of its named limits or sets leads to a verified gait and no smaller part",
            "of a set does. Problems that turned out to be feasible are omitted, so some numbers are missing.",
            "",
            "This page is written by `python -m tests.benchmarks.infeasible_designs`.",
            "",
            summarise(results),
            "",
            "| no. | demand | sequence | status | time [s] | named limits (result of the change) |",
            "|---:|---|---|---|---:|---|",
            *(compose_row(number, row) for number, row in rows),
            "",
            f"Date {results['date']}, gaitopt {results['versions']['gaitopt']}, CasADi "
            f"{results['versions']['casadi']}.",
            "",
        ]
    )


def compose_row(number, row):
    """Return the row of a problem."""
    radius = "" if row["radius"] is None else f", radius at most {row['radius']:.3g}"
    sequence, status = row["sequence"].replace("|", "\\|"), row["status"].replace("_", " ")
    cells = [str(number), row["kind"] + radius, f"`{sequence}`", status, f"{row['processor_seconds']:.2f}"]
    groups = (f"{'; '.join(group['limits'])} ({describe_change(group)})" for group in row["groups"])
    return "| " + " | ".join([*cells, "<br>".join(groups)]) + " |"


def summarise(results):
    """Return the shares as a list in Markdown."""
    rows = [row for _, row in list_infeasible(results)]
    stated = sum(row["status"] == "infeasible" for row in rows)
    return "\n".join(
        [
            f"- reported as infeasible: {stated} of {len(rows)}",
            f"- confirmed: {sum(map(is_smallest, rows))} of {len(rows)}",
            f"- confirmed with the sufficient values: {sum(is_smallest(row, 'relaxed') for row in rows)}",
        ]
    )


def is_smallest(row, *ways):
    """Return whether every set that is named leads to a verified gait, and no smaller part of it does."""
    return is_confirmed(row, *ways) and all("solved" not in group["smaller"] for group in row["groups"])
