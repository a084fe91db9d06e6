"""The page on the audit: ``python -m tests.audit_page FILE [COUNT]``.

The command ``gaitopt audit --count COUNT -o FILE`` is run, which continues the results in FILE, and
``docs/audit.md`` is written from them.  Without COUNT the page is written from the results in FILE as they are.
"""

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np

from gaitopt.cli.audit_command import summarise_audit

PAGE = Path(__file__).resolve().parents[1] / "docs" / "audit.md"

HEAD = """# Audit

{count} random problems, solved with the default options, verified by replay in the simulator, and replayed again by a
second integrator. The problems are the installed scripts below with random settings (seed {seed}). The second
integrator shares only the symbolic equations of the robot with the simulator: contact forces, contact modes, event
location, impacts and the integration are computed by separate code. Both integrate by the method DOP853: the simulator
by its engine `scipy`, which is gaitopt's own implementation and takes the same steps as SciPy's, the second integrator
by that of SciPy. Every problem can be repeated by `gaitopt solve` with the settings in the results of `gaitopt audit`.

- *verified*: the plan and both replays agree in the sequence, the state (within {state:g}, SI units) and the period
  (within {period:g} s).
- *false pass*: the simulator verifies the gait, and the second integrator does not.
- *refused*: the solve returns a gait that fails its replay in the simulator (status `not_verified`).
- *plan inaccurate*, *infeasible* and others: statuses of solves without a gait. They include problems that have no
  gait, since the settings are drawn at random.

The objective `hop_effort` of `monopod.py` is the integral of the squared hip torque plus 1e-3 m² times the squared leg
force.

This page is written by `python -m tests.audit_page FILE`.

"""


def compose_page(data):
    """Return the page in Markdown from the content of an audit file."""
    from gaitopt.simulation.replay_tolerances import Tolerances
    from gaitopt.study.audit.audited_problem import FACTOR

    rows, tolerances = data["problems"], Tolerances()
    facts = summarise_audit(rows)
    allowed = {"state": FACTOR * tolerances.state, "period": FACTOR * tolerances.period}
    names = sorted({"verified", "false pass", "refused", *facts["results"]}, key=lambda name: order(name, facts))
    lines = [HEAD.format(count=len(rows), seed=data["seed"], **allowed)]
    lines += [f"| script | problems | {' | '.join(name.replace('_', ' ') for name in names)} |"]
    lines += ["|---|" + "---:|" * (len(names) + 1)]
    for script, counts in [*facts["scripts"].items(), ("all", facts["results"])]:
        cells = [str(sum(counts.values())), *(str(counts.get(name, 0)) for name in names)]
        lines.append(f"| {script} | {' | '.join(cells)} |")
    lines += ["", *describe(rows), ""]
    versions = data.get("versions", {})
    lines.append(", ".join(f"{name} {versions[name]}" for name in ("gaitopt", "casadi", "scipy") if name in versions))
    return "\n".join(lines) + "\n"


def order(name, facts):
    """Return the place of a result: both replays first, then the number of its problems."""
    fixed = ("verified", "false pass", "refused")
    return (fixed.index(name), 0) if name in fixed else (len(fixed), -facts["results"][name])


def describe(rows):
    """Return a list of numbers and reasons in Markdown."""
    errors = [row["second_error"] for row in rows.values() if row.get("second_error") is not None]
    seconds = [row["seconds"] for row in rows.values()]
    lines = []
    if errors:
        lines.append(
            "- largest deviation of the state of the second replay from the plan (SI units): "
            f"{max(errors):.1e}; median {np.median(errors):.0e}"
        )
    lines.append(f"- processor time of a problem: median {np.median(seconds):.1f} s, largest {max(seconds):.0f} s")
    solved = [row for row in rows.values() if row["result"] in ("verified", "false pass", "refused")]
    for name, key in (("sequences", "sequence"), ("objectives", "objective")):
        counts = Counter(row[key] for row in solved)
        lines.append(f"- {name} of the solved problems: " + ", ".join(f"`{k}` {n}" for k, n in counts.most_common()))
    return lines


def main(words):
    """Run the command, if a count is given, and write the page."""
    if len(words) > 1:
        status = subprocess.run(
            [sys.executable, "-m", "gaitopt", "audit", "--count", words[1], "-o", words[0]]
        ).returncode
        if status not in (0, 1):
            return status
    PAGE.write_text(compose_page(json.loads(Path(words[0]).read_text(encoding="utf-8"))), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
