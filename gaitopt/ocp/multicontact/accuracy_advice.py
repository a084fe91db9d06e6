"""Remedies for an inaccurate plan of a robot with several contacts, without those that its problem already has."""

import math
from collections.abc import Iterator, Sequence

from gaitopt.model.contacts.mode import Mode
from gaitopt.ocp.multicontact.phase_grid import GridPhase
from gaitopt.ocp.multicontact.planar_guess import PoseGuess
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem

LEAST_FORCE, LEAST_SEPARATION = 0.02, 0.01
"""Margins of normal force [1] and separation [m/s] that are advised; with larger ones, the plan has another cause."""

MOST_ADVISED = 2
"""Number of remedies that are advised first; the others are stated for the case that these fail."""

FINE_POINTS = 8
"""Number of points of an interval that is advised if the motion magnifies the error of the plan."""


def advise_on_accuracy(
    problem: PlanarProblem, phase: GridPhase, contacts: Sequence[str], *, is_replayable: bool, is_converging: bool
) -> str:
    """Return the remedies for a phase whose plan is inaccurate between its nodes, in the order in which to try them.

    Parameters
    ----------
    problem : PlanarProblem
    phase : GridPhase
        The least accurate phase.
    contacts : sequence of str
        Contacts whose normal force is at its lower bound there.
    is_replayable : bool
        Whether the error is so small that a replay may pass.
    is_converging : bool
        Whether more intervals decrease the error.
    """
    remedies = [
        *(("more intervals in this phase",) if is_converging and not contacts else ()),
        *(("Collocation(tolerance=1e-6) if the plan then passes its replay",) if is_replayable and contacts else ()),
        *_advise_margins(problem, phase, contacts),
        *_advise_sequence(problem, contacts),
        *_advise_postures(problem),
        f"{'a' if isinstance(problem.guess, PoseGuess) else 'another'} guess near a plausible motion",
    ]
    first, rest = remedies[:MOST_ADVISED], remedies[MOST_ADVISED:]
    text = f"use {', or '.join(first)}"
    return f"{text}; if the plan remains inaccurate, {', or '.join(rest)}." if rest else f"{text}."


def _advise_margins(problem: PlanarProblem, phase: GridPhase, contacts: Sequence[str]) -> Iterator[str]:
    """Yield the margins to forces at their bounds that are smaller than those that help."""
    margins, names = problem.margins, problem.robot.contact_names
    if not contacts:
        return
    advised = [f"normal_force={LEAST_FORCE:g}"] if margins.normal_force < LEAST_FORCE else []
    opens = phase.outcome is not None and any(
        phase.state[i] is not Mode.FREE and phase.outcome[i] is Mode.FREE for i in map(names.index, contacts)
    )
    if opens and margins.separation < LEAST_SEPARATION:
        advised.append(f"separation={LEAST_SEPARATION:g}")
    if advised:
        yield f"larger margins, such as Margins({', '.join(advised)})"


def _advise_sequence(problem: PlanarProblem, contacts: Sequence[str]) -> Iterator[str]:
    """Yield the sequence in which the contacts whose force vanishes leave the ground, if larger margins do not help."""
    if contacts and problem.margins.normal_force >= LEAST_FORCE:
        opens = "open" if len(contacts) > 1 else "opens"
        yield f"a contact sequence in which {' and '.join(contacts)} {opens} in this phase"


def _advise_postures(problem: PlanarProblem) -> Iterator[str]:
    """Yield the limits that exclude implausible postures, with the angles that have none."""
    robot, ranges = problem.robot, problem.limits.coordinate
    angles = [name for name, unit in zip(robot.coordinates, robot.units, strict=True) if unit == "rad"]
    if unlimited := [name for name in angles if not all(map(math.isfinite, ranges.get(name, (math.inf,))))]:
        yield f"PlanarLimits.coordinate of {', '.join(unlimited)}, which excludes postures outside its ranges"


def advise_on_magnification(problem: PlanarProblem) -> str:
    """Return the remedies for a plan whose replay magnifies its error, without the points that the grid already has."""
    points = f", Collocation(points={FINE_POINTS})," if problem.transcription.points < FINE_POINTS else ""
    return f"use more intervals{points} or verify with Tolerances(state=...)."
