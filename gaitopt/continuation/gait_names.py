"""Names of the gaits of a bifurcation diagram, each of which has one colour in figures and pages."""

from collections import Counter

from gaitopt.continuation.branch_diagram import BranchDiagram, distinct_steps, omit_outcome


def name_gaits(diagram: BranchDiagram) -> dict[tuple[str, int], str]:
    """Return the names of the gaits of a diagram, in order of appearance.

    A name is the contact sequence as printed elsewhere, and the period if it is longer than one step.  If gaits of
    several contacts differ in the outcome of an impact alone, their names state the outcomes.

    Parameters
    ----------
    diagram : BranchDiagram

    Returns
    -------
    dict of (str, int) to str
        By the different sequences of the steps of a gait, see :func:`distinct_steps`, and its period in steps.

    Examples
    --------
    >>> from gaitopt import load_diagram
    >>> list(name_gaits(load_diagram("docs/examples/compass_slope.nc")).items())[1]
    (('stick | stick', 2), 'stick | stick, 2 steps')
    """
    pairs = [(distinct_steps(each), branch.steps) for branch in diagram.branches for each in branch.sequences]
    printed = {pair: distinct_steps(omit_outcome(pair[0])) for pair in pairs}
    counts = Counter((name, steps) for (_, steps), name in printed.items())
    names: dict[tuple[str, int], str] = {}
    for (sequence, steps), name in printed.items():
        unique = name if counts[name, steps] == 1 else sequence
        names[sequence, steps] = unique if steps == 1 else f"{unique}, {steps} steps"
    return names
