"""Problems of robots with several contacts that no gait can solve: decided before the solve, with the reason."""

from collections.abc import Iterator

from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.ocp.multicontact.arming_range import explain_unreachable_arming
from gaitopt.ocp.multicontact.momentum_balance import explain_imbalance
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem


def explain_planar_impossibility(problem: PlanarProblem) -> str | None:
    """Return why no gait can solve a problem; None if no known reason applies.

    Parameters
    ----------
    problem : PlanarProblem

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> problem = PlanarProblem(robot=monopod(), sequence="foot stick > flight |", speed=1.5)
    >>> explain_planar_impossibility(problem) is None
    True
    """
    if problem.sequence.is_open:
        return explain_imbalance(problem)
    return explain_unequal_slip(problem) or explain_imbalance(problem) or explain_unreachable_arming(problem)


def explain_unequal_slip(problem: PlanarProblem) -> str | None:
    """Return the contacts of one rigid body that do not stick or slip together in the sequence of a problem, or None.

    Two contacts, points or arcs, that stay on the straight ground touch it at material points of the body whose normal
    velocities vanish.  If the points differ, the body does not rotate; in either case, their tangential velocities are
    equal.  The same holds after an impact for the contacts that it leaves closed.

    Parameters
    ----------
    problem : PlanarProblem
        A problem with a closed contact sequence.

    Examples
    --------
    >>> from gaitopt.model.robots.flat_foot_walker import flat_foot_walker
    >>> problem = PlanarProblem(robot=flat_foot_walker(), sequence="heel A stick, toe A slip+ |", friction=0.8)
    >>> print(explain_unequal_slip(problem))
    heel A and toe A are contacts of one rigid body, so that they stick or slip together while both are closed, but in \
phase 1 the sequence has 'heel A stick, toe A slip+': write 'heel A stick, toe A stick' or 'heel A slip+, toe A slip+'
    """
    for place, state in _list_states(problem):
        bodies = dict[str, dict[str, Mode]]()
        for contact, (name, mode) in zip(problem.robot.contacts, state.modes, strict=True):
            if contact.slides and mode is not Mode.FREE:
                bodies.setdefault(contact.body, {})[name] = mode
        for modes in bodies.values():
            different = tuple(dict.fromkeys(modes.values()))
            if len(different) > 1:
                choices = " or ".join(repr(_spell(dict.fromkeys(modes, mode))) for mode in different)
                return (
                    f"{' and '.join(modes)} are contacts of one rigid body, so that they stick or slip together while "
                    f"both are closed, but in {place} the sequence has {_spell(modes)!r}: write {choices}"
                )
    return None


def _list_states(problem: PlanarProblem) -> Iterator[tuple[str, ContactState]]:
    """Yield the modes in the phases and in the outcomes of the impacts, with their places in the sequence."""
    robot, sequence = problem.robot, problem.sequence
    for number, state in enumerate(sequence.states(robot)):
        yield f"phase {number + 1}", state
        if sequence.events[number].impact:
            yield f"the impact after phase {number + 1}", sequence.outcome(robot, number)


def _spell(modes: dict[str, Mode]) -> str:
    """Return contacts and their modes as in the text of a sequence."""
    return ", ".join(f"{name} {mode.value}" for name, mode in modes.items())
