import pytest

from gaitopt import ContactSequence, InputError, Mode, MultipleShooting
from gaitopt.ocp.transcription.grid import divide_into_phases


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


def test_a_slide_from_a_slipping_impact_starts_in_motion_and_ends_at_rest():
    slide, stick = phases("slip+ stick | slip+", 2, 2)
    assert (slide.starts_at_rest, slide.ends_at_rest, slide.breaks_away, slide.onset) == (False, True, False, None)
    assert (stick.starts_at_rest, stick.ends_at_rest, stick.breaks_away, stick.onset) == (False, False, False, None)


def test_a_slide_after_sticking_has_its_onset_on_the_cone_and_ends_in_motion():
    stick, slide = phases("stick slip- | stick", 2, 2)
    assert stick.onset is Mode.SLIP_BACKWARD
    assert (slide.starts_at_rest, slide.ends_at_rest, slide.breaks_away) == (True, False, False)


def test_a_slide_right_after_a_sticking_impact_breaks_away():
    (slide,) = phases("slip+ | stick", 4)
    assert slide.starts_at_rest
    assert slide.breaks_away


def test_a_slide_that_reverses_breaks_away():
    forward, backward, _ = phases("slip+ slip- stick | slip+", 2, 2, 2)
    assert forward.ends_at_rest
    assert backward.starts_at_rest
    assert backward.breaks_away


def test_complete_slip_never_rests():
    (slide,) = phases("slip+ | slip+", 4)
    assert not slide.starts_at_rest
    assert not slide.ends_at_rest


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


@pytest.mark.parametrize("intervals", [1, 0, -3, 2.5, float("nan"), float("inf"), "many", None, True, (40,), (1, 40)])
def test_intervals_that_cannot_be(intervals):
    with pytest.raises(InputError, match="intervals"):
        MultipleShooting(intervals=intervals).intervals_for(ContactSequence.parse("slip+ stick | slip+"))


@pytest.mark.parametrize("setting", [{"substeps": 0}, {"substeps": 1.5}, {"tolerance": 0}, {"tolerance": float("nan")}])
def test_refinement_that_cannot_be(setting):
    with pytest.raises(InputError, match=next(iter(setting))):
        MultipleShooting(**setting)
