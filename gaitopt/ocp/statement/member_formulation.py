"""Several gait problems as mathematics: the first one, and what differs in the others."""

from collections.abc import Iterator, Sequence
from typing import Any

from gaitopt.model.formulation import Formula, escape_latex
from gaitopt.ocp.statement.problem_formulation import formulate_gait_problem

OBJECTIVE = "minimise"
"""Label of the objective in the formulation of a gait problem."""


def formulate_members(problems: Sequence[Any], kind: str, omit: Sequence[str] = ()) -> tuple[Formula, ...]:
    """Return the formulation of the first problem, and the lines of the others that differ from it.

    Parameters
    ----------
    problems : sequence of GaitProblem
    kind : str
        What each problem is, such as gait or step; problems are counted from 1, and their objectives are J1, J2, ...
    omit : sequence of str
        Labels of the lines that are stated elsewhere.

    Examples
    --------
    >>> from gaitopt import GaitProblem, compass_biped
    >>> problem = GaitProblem(robot=compass_biped(), sequence="stick | stick", speed=0.6)
    >>> for line in formulate_members([problem, problem.replace(speed=0.7)], "step")[-3:]:
    ...     print(line.label, line.text)
    step 2 stick | stick, otherwise as step 1 with
    J2 cost_of_transport = 1/(m g L) ∫ Σ |u_i ṡ_i| dt
    targets speed L/T = 0.7 m/s
    """
    members = [list(_label_lines(problem, omit)) for problem in problems]
    lines = [state_in_words(f"{kind} 1", str(problems[0].sequence)), *_state_member(members[0], 1)]
    for place, member in enumerate(members[1:], start=1):
        name, sequence = f"{kind} {place + 1}", problems[place].sequence
        if (same := members.index(member)) < place:
            lines.append(state_in_words(name, f"{sequence}, as {kind} {same + 1}"))
            continue
        labels = {each.label for each in member}
        missing = dict.fromkeys(each.label for each in members[0] if each.label not in labels)
        absent = f", without {', '.join(missing)}," if missing else ""
        changed = [each for each in member if each.label == OBJECTIVE or each not in members[0]]
        lines.append(state_in_words(name, f"{sequence}, otherwise as {kind} 1{absent} with"))
        lines += _state_member(changed, place + 1)
    return tuple(lines)


def _state_member(lines: Sequence[Formula], number: int) -> Iterator[Formula]:
    """Yield the lines of one problem; a label is not repeated, and that of the objective contains the number."""
    former = ""
    for each in lines:
        label = f"J{number}" if each.label == OBJECTIVE else each.label
        yield Formula("" if label == former else label, each.text, each.latex)
        former = label


def _label_lines(problem: Any, omit: Sequence[str]) -> Iterator[Formula]:
    """Yield the lines of a problem, each with the label of the line above if it has none."""
    label = ""
    for each in formulate_gait_problem(problem).formulas:
        label = each.label or label
        if label not in omit:
            yield Formula(label, each.text, each.latex)


def state_in_words(label: str, text: str) -> Formula:
    """Return a line of words."""
    return Formula(label, text, rf"\text{{{escape_latex(text)}}}")
