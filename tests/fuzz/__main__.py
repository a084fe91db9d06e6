"""Call public names with odd values by ``python -m tests.fuzz [COUNT] [FIRST]`` and report every raw error and hang."""

import faulthandler
import sys
import tempfile
from collections import Counter
from pathlib import Path

from tests.fuzz.fuzzer import fuzz

if __name__ == "__main__":
    count, first = int(sys.argv[1]) if sys.argv[1:] else 20_000, int(sys.argv[2]) if sys.argv[2:] else 0
    outcomes, slow = Counter(), Counter()
    with tempfile.TemporaryDirectory() as folder:
        for call, outcome, seconds in fuzz(count, Path(__file__).parents[2], Path(folder), first):
            faulthandler.dump_traceback_later(120, exit=True)  # a call that no signal reaches
            outcomes[outcome.split()[0]] += 1
            slow[call.partition("(")[0]] += seconds
            if outcome.startswith(("raw", "hang")):
                print(outcome, "|", call, flush=True)
    print(", ".join(f"{number} {outcome}" for outcome, number in outcomes.most_common()))
    print("longest:", ", ".join(f"{name} {seconds:.1f} s" for name, seconds in slow.most_common(12)))
    sys.exit(0 if set(outcomes) <= {"accepted", "refused"} else 1)
