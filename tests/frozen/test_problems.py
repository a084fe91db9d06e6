"""Random problems, solved again: every objective, many contact sequences, both transcriptions, several robots.

The default run of pytest solves a third of them; ``pytest tests/frozen --frozen=all`` solves all.
"""

from tests.frozen import computations
from tests.frozen.comparison import assert_agree

FILE = "problems"


def test_frozen_result_is_reproduced(entry):
    computed = getattr(computations, entry["computation"])(**entry["arguments"])
    assert_agree(computed, entry["result"])
