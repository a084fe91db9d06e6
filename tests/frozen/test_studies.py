"""Multipliers under laws, tuned gains, basins, a sweep, a search and warm starts, computed again.

The default run of pytest leaves out what takes long; ``pytest tests/frozen --frozen=all`` computes everything.
"""

from tests.frozen import computations
from tests.frozen.comparison import assert_agree

FILE = "studies"


def test_frozen_result_is_reproduced(entry):
    computed = getattr(computations, entry["computation"])(**entry["arguments"])
    assert_agree(computed, entry["result"])
