"""Statuses and stops: distinct keys, and a sentence each."""

import pytest

from gaitopt import Status, Stop


@pytest.mark.parametrize("kind", [Status, Stop])
def test_every_member_has_its_own_key_and_its_own_sentence(kind):
    """Two members with the same sentence would silently be one, since an Enum makes aliases of equal values."""
    names = list(kind.__members__)
    assert len(kind) == len(names)
    assert len({member.key for member in kind}) == len(names)
    for member in kind:
        assert member.key == member.name.lower()
        assert kind[member.key.upper()] is member
        assert member.hint.endswith(".")
        assert len(member.hint) > 15


def test_only_a_solution_is_ok():
    assert [status for status in Status if status.ok] == [Status.SOLVED]


def test_the_looser_tolerance_of_ipopt_is_no_solution():
    assert "Ipopt's 'acceptable' tolerance" in Status.ACCEPTABLE.hint
    assert "does not count the result as a solution" in Status.ACCEPTABLE.hint


def test_remedies_of_statuses_name_no_option_that_solve_lacks():
    assert "starts=8" in Status.UNCONFIRMED.hint
    assert "intervals" not in Status.PLAN_INACCURATE.hint


def test_several_possible_motions_have_a_remedy():
    assert "Try less friction" in Stop.AMBIGUOUS.hint
    assert "Margins(cone=..., impact_cone=...)" in Stop.AMBIGUOUS.hint
