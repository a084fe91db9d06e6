"""Gaits whose texts try to become HTML, JavaScript, terminal escapes, LaTeX, C, table cells or paths."""

import dataclasses

from gaitopt.motion import Violation

SCRIPT = "<script>document.title='run'</script>"
CLOSING = "</script><!--<script><img src=x onerror=\"document.title='run'\">"
ESCAPE = "\x1b[31m\x1b]0;title\x07\x9b1m\u202e"
LATEX = r"$\bad{$ \input{/etc/passwd} th__a_b"
C = "*/ int main(void) { return 1; } /* \\"
CELL = '=1+1,"a"\nb'
PATH = "../../../etc/passwd"
MARKUP = "[bold]x[/nonsense]"
LONE = "\ud800"

TEXT = " ".join((SCRIPT, CLOSING, ESCAPE, LATEX, C, CELL, PATH, MARKUP))
"""Free text of a file: a message, a description of the problem."""

JSON_TEXT = TEXT + LONE
"""Free text in JSON, which may contain half a character."""

NAME = " ".join((SCRIPT, LATEX, C, "=1+1,'a'", PATH, MARKUP))
"""Name without the characters that no name may have."""


def make_hostile(gait):
    """Return a gait with such texts wherever a file has texts; names differ by their last character."""
    names = {
        name: tuple(f"{NAME}{number}" for number in range(len(getattr(gait.motion, name))))
        for name in ("angles", "actuators", "points")
    }
    problem = {**gait.problem, "name": JSON_TEXT, "objective": JSON_TEXT, "objective_unit": TEXT, "note": [JSON_TEXT]}
    problem["torque_limit"] = dict.fromkeys(names["actuators"], 6.0)
    solver = dataclasses.replace(
        gait.solver,
        message=TEXT,
        warnings=(JSON_TEXT, "x"),
        violations=(Violation(JSON_TEXT, JSON_TEXT, float("nan")),),
    )
    verification = dataclasses.replace(gait.verification, reasons=(JSON_TEXT,))
    return dataclasses.replace(
        gait,
        robot=dataclasses.replace(gait.robot, name=NAME),
        motion=dataclasses.replace(gait.motion, **names),
        problem=problem,
        solver=solver,
        verification=verification,
        versions={"gaitopt": TEXT, "<b>": TEXT},
    )


def rename_robot(gait):
    """Return a gait that is hostile only in the name of its robot, which all commands accept."""
    return dataclasses.replace(gait, robot=dataclasses.replace(gait.robot, name=NAME))
