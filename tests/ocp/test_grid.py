import numpy as np
import pytest

from gaitopt import ContactSequence, InputError, Mode, MultipleShooting
from gaitopt.ocp.bounds import bounds, structure
from gaitopt.ocp.nlp.keys import Group, Kind, Unknown
from gaitopt.ocp.transcription.grid import divide_into_phases
from gaitopt.ocp.transcription.transcription import transcribe


def phases(sequence, *counts):
    return divide_into_phases(ContactSequence.parse(sequence), counts)


def test_neighbouring_phases_share_a_node():
    first, second, third = phases("slip+ stick slip- | slip+", 3, 5, 2)
    assert list(first.nodes) == [0, 1, 2, 3]
    assert list(second.nodes) == [3, 4, 5, 6, 7, 8]
    assert list(third.nodes) == [8, 9, 10]


def test_labels_count_from_one_and_name_the_mode():
    labels = [phase.place().label for phase in phases("slip+ stick | slip+", 2, 2)]
    assert labels == ["phase 1 (slip+)", "phase 2 (stick)"]


def test_a_phase_knows_its_neighbours():
    """The outcome of the impact comes before the first phase."""
    slide, stick = phases("slip+ stick | slip+", 2, 2)
    assert (slide.previous, slide.following) == (
        Mode.SLIP_FORWARD,
        Mode.STICK,
    )
    assert (stick.previous, stick.following) == (Mode.SLIP_FORWARD, None)


SLIDES = [
    # sequence, phase; whether the slide starts at rest, whether it ends at rest, the kinds of rows at its start
    ("slip+ stick | slip+", 0, False, True, []),
    ("stick slip- | stick", 1, True, False, []),
    ("slip+ | stick", 0, True, False, [Kind.SLIP_FROM_REST]),
    ("slip+ slip- stick | slip+", 0, False, True, []),
    ("slip+ slip- stick | slip+", 1, True, True, [Kind.SLIP_FROM_REST]),
    ("slip+ | slip+", 0, False, False, []),
]


@pytest.mark.parametrize(("sequence", "number", "starts_at_rest", "ends_at_rest", "start"), SLIDES)
def test_transitions_determine_the_ends_of_a_slide(
    reference_problem, sequence, number, starts_at_rest, ends_at_rest, start
):
    problem = reference_problem(sequence=sequence, intervals=20)
    transcription = transcribe(structure(problem, problem.transcription))
    limits = bounds(transcription, problem)
    _, speed = transcription.variables[Unknown.SLIDE, number]
    fixed = limits.x_lower[speed] == limits.x_upper[speed]
    assert (fixed[0], fixed[-1]) == (starts_at_rest, ends_at_rest)
    assert not np.any(fixed[1:-1])
    rows = transcription.constraints
    table = (Group.START, number)
    assert [kind for kind in Kind if table in rows and np.isin(rows.find(kind), rows[table]).any()] == start


def test_an_onset_is_on_the_cone(reference_problem):
    problem = reference_problem(sequence="stick slip- | stick", intervals=20)
    transcription = transcribe(structure(problem, problem.transcription))
    rows, limits = transcription.constraints, bounds(transcription, problem)
    (onset,) = rows.find(Kind.SLIP_ONSET)
    assert onset in rows[Group.END, 0]
    assert limits.g_lower[onset] == limits.g_upper[onset] == 0.0
    assert np.isin(rows.find(Kind.NORMAL_FORCE), rows[Group.END, 0]).any()


def test_one_count_is_needed_per_phase():
    with pytest.raises(ValueError, match="shorter"):
        phases("slip+ stick | slip+", 4)


@pytest.mark.parametrize(
    ("sequence", "intervals", "counts"),
    [
        ("stick | stick", 40, (40,)),
        ("slip+ stick slip- | slip+", 40, (10, 40, 10)),
        ("slip+ stick | slip+", 8, (5, 8)),  # a slip phase keeps at least five
        ("slip+ | slip+", 40, (40,)),  # a slip phase that is the whole step is not short
        ("slip+ stick | slip+", (7, 9), (7, 9)),
    ],
)
def test_intervals_of_each_phase(sequence, intervals, counts):
    assert MultipleShooting(intervals=intervals).intervals_for(ContactSequence.parse(sequence)) == counts


@pytest.mark.parametrize("intervals", [1, 0, -3, 2.5, float("nan"), float("inf"), "many", [], True, (40,), (1, 40)])
def test_intervals_that_cannot_be(intervals):
    with pytest.raises(InputError, match="intervals"):
        MultipleShooting(intervals=intervals).intervals_for(ContactSequence.parse("slip+ stick | slip+"))


@pytest.mark.parametrize("setting", [{"substeps": 0}, {"substeps": 1.5}, {"tolerance": 0}, {"tolerance": float("nan")}])
def test_refinement_that_cannot_be(setting):
    with pytest.raises(InputError, match=next(iter(setting))):
        MultipleShooting(**setting)
