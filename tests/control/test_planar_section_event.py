"""The event at which the clock of a planar law is reset."""

from dataclasses import replace

import pytest

from gaitopt import Collocation, InputError
from gaitopt.control.planar_laws.planar_feedback import find_section
from gaitopt.ocp import solve_planar
from tests.ocp.multicontact_examples import walk


def test_a_gait_that_does_not_end_with_an_impact_is_rejected_with_what_to_do():
    gait = solve_planar(walk(transcription=Collocation(intervals=10)))
    assert find_section(gait) == "foot B closes"
    (event,) = gait.motion.events
    smooth = replace(event, names=("foot A slip+",), outcome=None)
    for events, remedy in (
        (
            (smooth,),
            "It has no impact, so its multipliers and feedback laws are not available; gaitopt verify replays it.",
        ),
        ((event, smooth), "Solve it with a sequence that begins after its impact"),
    ):
        changed = gait.replace_fields(motion=replace(gait.motion, events=events))
        with pytest.raises(InputError, match=f"must end with an impact, .* reset. {remedy}"):
            find_section(changed)
