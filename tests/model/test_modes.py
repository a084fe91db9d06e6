"""Contact modes: signs and spelling."""

import pytest

from gaitopt import Mode


@pytest.mark.parametrize(("spelling", "sign"), [("stick", 0), ("slip+", 1), ("slip-", -1), ("free", 0)])
def test_sign_and_spelling(spelling, sign):
    mode = Mode(spelling)
    assert (mode.sign, mode.slips) == (sign, sign != 0)
    if sign:
        assert Mode.slipping(0.3 * sign) is mode
