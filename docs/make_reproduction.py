"""Write the pages reproduction, frontiers and slipping_contacts of docs with their figures, from problems/studies.

Run it with ``python docs/make_reproduction.py``; it takes a few minutes with the heyoka engine.  ``python
docs/make_reproduction.py frontiers`` writes one page only.
"""

import math
import runpy
import sys
import time
from pathlib import Path

from gaitopt.simulation import default_engine

DOCS = Path(__file__).resolve().parent
STUDIES = DOCS.parent / "problems" / "studies"
ORDER = (
    "rimless_regions",
    "rimless_force_ratio",
    "rimless_portraits",
    "rimless_branches",
    "rimless_types",
    "rimless_cascade",
    "rimless_basin_slope",
    "rimless_basin_friction",
    "rimless_lift_off",
    "compass_portraits",
    "compass_force_ratio",
    "compass_multipliers",
    "compass_branches",
    "compass_cascade",
    "compass_actuated",
    "imitation_cost",
    "feedback_figures",
    "feedback_laws",
    "benchmarks",
)
FRONTIERS = ("frontier_friction", "frontier_energy", "frontier_speed_step", "frontier_ankle")
CONTACTS = ("double_support", "slipping_landings")
DOTS_PER_INCH, LARGEST_IMAGE = 110, 150_000
NEGLIGIBLE = 1e-2
"""Fraction of a tolerance below which a difference is attributed to rounding."""

HEAD = """# Reproduction of Gamus & Or (2015)

This page compares numbers computed by gaitopt with all numbers of *B. Gamus and Y. Or, Dynamic bipedal walking under
stick-slip transitions, SIAM Journal on Applied Dynamical Systems 14 (2015)*, and with benchmarks computed independently
of gaitopt ("independent computation"). A number agrees if the difference does not exceed the tolerance, which is half a
unit of the last printed digit unless another value is stated. The source "claim" denotes a statement of the respective
section that is checked by computation.

alpha is the slope and mu the friction coefficient. The rimless wheel has n spokes of length l, the mass m and the
moment of inertia I_c about its centre; kappa = I_c / (m l^2) is its inertia ratio,
tau_c = sqrt((m l^2 + I_c) / (m g l)), and theta_rate the rate of its angle theta, "after impact" in a periodic gait.
th1 and th2 are the angles of the stance leg and the swing leg of the compass biped. T is the duration of a step; in
energy balances, m is the total mass and L the travel per step.

Unless a row or its section states otherwise, the rimless wheel has n = 10, kappa = 1/3 and alpha = 13 deg, and the
passive compass biped legs of 1.6 m and 4 kg with their centre of mass at 0.8 m, a hip mass of 2 kg, g = 9.8 m/s^2 and
alpha = 1 deg. Type A and Gait A are those at unlimited friction, Gaits B and C those at mu = 0.14.

The gaits have the names of the paper. Rimless wheel: in Type A the foot sticks throughout; in Type B it sticks at the
impact and slips within the step; in Type C it slips at the impact, sticks, and slips again; in Type D it slips
throughout. Passive compass biped: in Gait A the foot sticks throughout; in Gait B it sticks at the impact and slips
within the step; in Gait C it slips forward at the impact.

`python docs/make_reproduction.py` writes this page by running the scripts in `problems/studies`, here with the {engine}
engine. Each script can also be run separately: `python problems/studies/NAME.py`.

**{agreeing} of {total} numbers agree.** {exceptions}
"""


FRONTIERS_HEAD = """# Gaits of minimum cost

This page shows the cost of transport of the compass biped with motors on level ground (leg length 1.6 m, total mass
10 kg, torque limits of 6 N m at ankle and hip unless stated otherwise) as a function of friction, speed, step length
and motors. Every gait is the best of several starts, including warm starts from neighbouring points in both directions,
and is replayed by the event-driven simulator. All optima are local. The standard gait has friction 0.14, 0.633 m/s and
steps of 0.4713 m.

`python docs/make_reproduction.py frontiers` writes this page.
"""

CONTACTS_HEAD = """# Slip of several contacts

This page compares gaits in which the slip of a contact is planned: that of the trailing foot in a double support, and
that of the landing foot in hopping and running. Every gait is an optimum, which is replayed by the event-driven
simulator; gaits that fail the replay are listed as failed and are not shown. All optima are local: each point is
warm-started from its neighbours in both directions.

`python docs/make_reproduction.py contacts` writes this page.
"""


def main(pages):
    """Run the studies of the given pages and write the pages."""
    sys.path.insert(0, str(STUDIES))
    if "reproduction" in pages:
        sections, numbers = run(ORDER)
        write("reproduction", head(numbers), sections)
    if "frontiers" in pages:
        write("frontiers", FRONTIERS_HEAD, run(FRONTIERS)[0])
    if "contacts" in pages:
        write("slipping_contacts", CONTACTS_HEAD, run(CONTACTS)[0])


def write(page, introduction, sections):
    """Write a page."""
    (DOCS / f"{page}.md").write_text("\n".join([introduction, *sections]), encoding="utf-8")


def run(names):
    """Run studies, save their figures, and return their sections and numbers."""
    sections, numbers = [], []
    for name in names:
        start = time.perf_counter()
        script = runpy.run_path(str(STUDIES / f"{name}.py"))
        study = script["study"]()
        save_image(study.figure, name)
        sections.append(section(name, script["__doc__"], study))
        numbers += study.numbers
        print(f"{name}: {time.perf_counter() - start:.1f} s", file=sys.stderr)
    return sections, numbers


def save_image(figure, name):
    """Save a figure; exit if the file is too large for a page."""
    path = DOCS / "images" / f"study_{name}.png"
    figure.savefig(path, dpi=DOTS_PER_INCH)
    if path.stat().st_size > LARGEST_IMAGE:
        raise SystemExit(f"{path.name} has {path.stat().st_size} bytes; at most {LARGEST_IMAGE} are accepted.")


def head(numbers):
    """Return the introduction of the page: how many numbers agree, and which do not."""
    wrong = [number for number in numbers if not number.agrees]
    exceptions = "" if not wrong else f"The other {len(wrong)} are explained in the respective sections: "
    exceptions += "; ".join(
        f"{number.name} (computed {computed(number)}, reference {reference(number)})" for number in wrong
    )
    return HEAD.format(
        engine=default_engine().name,
        agreeing=len(numbers) - len(wrong),
        total=len(numbers),
        exceptions=f"{exceptions}." if wrong else "",
    )


def section(name, docstring, study):
    """Return the section of the page on one study."""
    title, _, text = docstring.partition("\n")
    paragraph = [text.strip(), ""] if text.strip() else []
    lines = [f"## {title.rstrip('.')}", "", *paragraph, f"![{title}](images/study_{name}.png)", ""]
    if study.numbers:
        lines += [
            "| quantity | unit | computed | reference | difference | tolerance | agrees | source |",
            "|---|---|---:|---:|---:|---:|---|---|",
            *map(row, study.numbers),
            "",
        ]
    lines += [f"- {remark}" for remark in study.remarks]
    lines += ["" if study.remarks else None, f"Script: `problems/studies/{name}.py`", ""]
    return "\n".join(line for line in lines if line is not None)


def row(number):
    """Return a number as a row of the table."""
    cells = (
        number.name,
        number.unit,
        computed(number),
        reference(number),
        difference(number),
        f"{number.tolerance:.0e}" if number.tolerance else "exact",
        "yes" if number.agrees else "**no**",
        number.source,
    )
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def computed(number):
    """Return the computed value with one digit more than the tolerance."""
    if NEGLIGIBLE * number.tolerance <= abs(number.value) < 10 * number.tolerance:
        return f"{number.value:.1e}"
    return f"{number.value:z.{_decimals(number) + 1}f}" if number.tolerance else f"{number.value:g}"


def difference(number):
    """Return the difference; rounding errors, which vary between runs, are given as a bound."""
    negligible = NEGLIGIBLE * number.tolerance
    if abs(number.difference) < negligible:
        return f"< {negligible:.0e}"
    return f"{number.difference:+.1e}" if number.difference else "0"


def reference(number):
    """Return the published value as printed."""
    decimals = _decimals(number)
    printed = number.tolerance == 0.5 * 10**-decimals
    return f"{number.reference:.{decimals}f}" if printed else f"{number.reference:.13g}"


def _decimals(number):
    """Return the number of decimals whose half unit is the tolerance."""
    return max(round(-math.log10(2 * number.tolerance)), 0) if number.tolerance else 0


if __name__ == "__main__":
    main(sys.argv[1:] or ("reproduction", "frontiers", "contacts"))
