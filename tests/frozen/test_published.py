"""The published numbers of the physics, computed again: rimless wheel, compass biped, simplest walker.

The default run of pytest leaves out what takes long; ``pytest tests/frozen --frozen=all`` computes everything.
"""

from tests.frozen import computations
from tests.frozen.comparison import assert_agree

FILE = "published"


def test_frozen_result_is_reproduced(entry):
    computed = getattr(computations, entry["computation"])(**entry["arguments"])
    assert_agree(computed, entry["result"])
