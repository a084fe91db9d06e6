"""Contact modes: signs and spelling."""

import pytest

from gaitopt import Mode


@pytest.mark.parametrize(
    ("spelling", "sign", "slips"), [("stick", 0, 0), ("slip+", 1, 1), ("slip-", -1, 1), ("free", 0, 0)]
)
def test_sign_and_spelling(spelling, sign, slips):
    mode = Mode(spelling)
    assert (mode.sign, mode.slips) == (sign, bool(slips))
    if sign:
        assert Mode.slipping(0.3 * sign) is mode
