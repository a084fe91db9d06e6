"""Write docs/reproduction.md and docs/frontiers.md with their figures: every number of the studies beside ours.

Run it with ``python docs/make_reproduction.py``; it takes a few minutes with the fast engine.  ``python
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
    "rimless_cascade",
    "rimless_basin_slope",
    "rimless_basin_friction",
    "rimless_lift_off",
    "compass_portraits",
    "compass_force_ratio",
    "compass_multipliers",
    "compass_actuated",
    "imitation_cost",
    "feedback_figures",
    "feedback_laws",
    "benchmarks",
)
FRONTIERS = ("frontier_friction", "frontier_energy", "frontier_speed_step", "frontier_ankle")
DOTS_PER_INCH, LARGEST_IMAGE = 110, 150_000
NEGLIGIBLE = 1e-2
"""Part of a tolerance below which a difference is rounding."""

HEAD = """# The study, reproduced

Every number of *B. Gamus and Y. Or, Dynamic bipedal walking under stick-slip transitions, SIAM Journal on Applied
Dynamical Systems 14 (2015)* beside ours, and of benchmarks computed independently of gaitopt ("own computation"). A
number agrees when it differs by no more than the tolerance: half a unit of the last printed digit, or what is said.
thd and xd are the rates of the angle theta and of the foot's place x, a star marks a periodic gait just after its
impact, and tau_c = sqrt((m l^2 + I_c) / (m g l)).

This page is written by `python docs/make_reproduction.py`, which runs the scripts in `problems/studies`; this one was
written with the {engine} engine. Each script runs alone, too: `python problems/studies/NAME.py`.

**{agreeing} of {total} numbers agree.** {exceptions}
"""


FRONTIERS_HEAD = """# Frontiers of cheap gaits

What walking costs the compass biped with motors on level ground (leg 1.6 m, 10 kg in all, 6 N m at ankle and hip where
nothing else is said), as friction, speed, step length and motors change. Every gait is the best of several starts,
passed on between neighbouring points in both directions, and replayed by the event-driven simulator; every optimum is
a local one.

This page is written by `python docs/make_reproduction.py frontiers`.
"""


def main(pages):
    """Run all studies of some pages and write these."""
    sys.path.insert(0, str(STUDIES))
    if "reproduction" in pages:
        sections, numbers = run(ORDER)
        write("reproduction", head(numbers), sections)
    if "frontiers" in pages:
        write("frontiers", FRONTIERS_HEAD, run(FRONTIERS)[0])


def write(page, beginning, sections):
    """Write a page."""
    (DOCS / f"{page}.md").write_text("\n".join([beginning, *sections]), encoding="utf-8")


def run(names):
    """Run studies, save their figures, and return their sections and numbers."""
    sections, numbers = [], []
    for name in names:
        began = time.perf_counter()
        script = runpy.run_path(str(STUDIES / f"{name}.py"))
        study = script["study"]()
        save_image(study.figure, name)
        sections.append(section(name, script["__doc__"], study))
        numbers += study.numbers
        print(f"{name}: {time.perf_counter() - began:.1f} s", file=sys.stderr)
    return sections, numbers


def save_image(figure, name):
    """Save a figure, and refuse one too large for a page."""
    path = DOCS / "images" / f"study_{name}.png"
    figure.savefig(path, dpi=DOTS_PER_INCH)
    if path.stat().st_size > LARGEST_IMAGE:
        raise SystemExit(f"{path.name} has {path.stat().st_size} bytes, more than {LARGEST_IMAGE}.")


def head(numbers):
    """Return the beginning of the page: how many numbers agree, and which do not."""
    wrong = [number for number in numbers if not number.agrees]
    exceptions = "" if not wrong else f"The other {len(wrong)}, explained where they stand: "
    exceptions += "; ".join(f"{number.name} (ours {ours(number)}, published {reference(number)})" for number in wrong)
    return HEAD.format(
        engine=default_engine().name,
        agreeing=len(numbers) - len(wrong),
        total=len(numbers),
        exceptions=f"{exceptions}." if wrong else "",
    )


def section(name, docstring, study):
    """Return the part of the page on one study."""
    title, _, text = docstring.partition("\n")
    paragraph = [text.strip(), ""] if text.strip() else []
    lines = [f"## {title.rstrip('.')}", "", *paragraph, f"![{title}](images/study_{name}.png)", ""]
    if study.numbers:
        lines += [
            "| number | unit | ours | published | difference | tolerance | agrees | source |",
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
        ours(number),
        reference(number),
        difference(number),
        f"{number.tolerance:.0e}" if number.tolerance else "exact",
        "yes" if number.agrees else "**no**",
        number.source,
    )
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def ours(number):
    """Return our value with one digit more than the tolerance."""
    if NEGLIGIBLE * number.tolerance <= abs(number.value) < 10 * number.tolerance:
        return f"{number.value:.1e}"
    return f"{number.value:z.{_decimals(number) + 1}f}" if number.tolerance else f"{number.value:g}"


def difference(number):
    """Return how far we are off; rounding, which every run does in its own way, only as a bound."""
    negligible = NEGLIGIBLE * number.tolerance
    if abs(number.difference) < negligible:
        return f"< {negligible:.0e}"
    return f"{number.difference:+.1e}" if number.difference else "0"


def reference(number):
    """Return the published value as it is printed."""
    decimals = _decimals(number)
    printed = number.tolerance == 0.5 * 10**-decimals
    return f"{number.reference:.{decimals}f}" if printed else f"{number.reference:.13g}"


def _decimals(number):
    """Return how many decimals have half a unit within the tolerance."""
    return max(round(-math.log10(2 * number.tolerance)), 0) if number.tolerance else 0


if __name__ == "__main__":
    main(sys.argv[1:] or ("reproduction", "frontiers"))
