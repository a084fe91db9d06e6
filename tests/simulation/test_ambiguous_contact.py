"""Remedies for a plan whose replay is ambiguous: the friction and the cone margin that are named."""

import re
from dataclasses import replace

import pytest

from gaitopt import Margins, Status, solve, verify
from gaitopt.simulation.ambiguous_contact import describe_ambiguity
from gaitopt.simulation.planar_verification import replay_planar
from tests.walkers.heel_toe import Build, heel_toe_step

BUILD = Build(14.0, 2.0, 0.1, 1.0, 0.4, -0.04, 0.08)
"""A walker whose heel may stick, slip or leave the ground at the start of the step if friction is 0.8."""


@pytest.fixture(scope="module")
def ambiguous():
    return verify(solve(heel_toe_step(0.05, build=BUILD)))


@pytest.mark.slow
def test_an_ambiguous_replay_names_contact_instant_friction_and_margin(ambiguous):
    assert ambiguous.status is Status.NOT_VERIFIED
    (reason,) = ambiguous.verification.reasons
    pattern = (
        r"At 0 s the motion of heel a is unique if friction is at most (\S+): set friction=\1, .*Margins\(cone=(\S+)\)"
    )
    friction, margin = (float(number) for number in re.search(pattern, reason).groups())
    assert "Try less friction" not in reason
    problem = heel_toe_step(0.05, build=BUILD)
    for changed in (problem.replace(friction=friction), problem.replace(margins=Margins(cone=margin))):
        assert verify(solve(changed)).status is Status.SOLVED


@pytest.mark.slow
def test_nothing_is_named_where_the_motion_is_unique(ambiguous):
    motion = ambiguous.motion
    little = replace(motion, parameters=motion.parameters | {"friction": 0.2})
    assert describe_ambiguity(ambiguous.replace_fields(motion=little), replay_planar(ambiguous)) == ""
