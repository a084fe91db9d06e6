"""Contact sequences that continue a branch of optimal gaits where a contact mode is about to change."""

from gaitopt.continuation.optimal.parametric_nlp import ParametricNlp
from gaitopt.errors import SequenceError
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.ocp.nlp.keys import Kind

IMPACT_CONES = (Kind.IMPACT_CONE, Kind.FORWARD_IMPACT_CONE, Kind.BACKWARD_IMPACT_CONE)
SLIPS = (Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD)


def list_neighbours(nlp: ParametricNlp, index: int) -> tuple[ContactSequence, ...]:
    """Return the contact sequences next to that of an NLP at a constraint that becomes active.

    A sticking impact at its friction cone has the slipping impacts as neighbours, and a slip phase of the shortest
    duration the sequence without it; other constraints have none.

    Parameters
    ----------
    nlp : ParametricNlp
    index : int
        The constraint, counted after the unknowns if it is a row.
    """
    transcription, sequence = nlp.transcription, nlp.problem.sequence
    layouts = transcription.variables, transcription.constraints
    place, key = layouts[0].entries[index] if index < nlp.size else layouts[1].entries[index - nlp.size]
    candidates = list[tuple[tuple[Mode, ...], Mode]]()
    if key.kind in IMPACT_CONES and sequence.impact is Mode.STICK:
        candidates = [((slip, *sequence.phases), slip) for slip in SLIPS]
    elif key.kind is Kind.DURATION and place.phase is not None and sequence.phases[place.phase].slips:
        candidates = [_remove_phase(sequence, place.phase)]
    return tuple(neighbour for one in candidates if (neighbour := _make_sequence(*one)) is not None)


def _remove_phase(sequence: ContactSequence, number: int) -> tuple[tuple[Mode, ...], Mode]:
    """Return the phases without one, joined if equal modes meet, and the impact, whose mode begins the step."""
    phases = list(sequence.phases[:number])
    for mode in sequence.phases[number + 1 :]:
        if not phases or mode is not phases[-1]:
            phases.append(mode)
    return tuple(phases), sequence.impact if number or not phases else phases[0]


def _make_sequence(phases: tuple[Mode, ...], impact: Mode) -> ContactSequence | None:
    """Return a contact sequence, or None if it is invalid."""
    try:
        return ContactSequence(phases=phases, impact=impact).check_periodic()
    except SequenceError:
        return None
