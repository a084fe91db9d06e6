"""Call public names with odd values by ``python -m tests.fuzz [COUNT] [FIRST]``, and report every raw error and hang.

``python -m tests.fuzz commands [COUNT] [FIRST]`` runs odd command lines.
"""

import faulthandler
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from tests.fuzz import command_lines
from tests.fuzz.fuzzer import fuzz

ROOT = Path(__file__).parents[2]


def run_commands(count, folder, first):
    """Yield the words, the outcome and the duration of each command line."""
    command_lines.prepare(ROOT, folder)
    for number in range(first, first + count):
        words, began = command_lines.draw(number), time.perf_counter()
        yield f"{words[0]} ({words[1:]})", command_lines.run(words, folder), time.perf_counter() - began


def report(calls):
    """Print every raw error and hang, and return whether none occurred."""
    outcomes, slow = Counter(), Counter()
    for call, outcome, seconds in calls:
        faulthandler.dump_traceback_later(200, exit=True)  # a call that no signal reaches
        outcomes[outcome.partition(" ")[0] if outcome.startswith("raw") else outcome] += 1
        slow[call.partition("(")[0]] += seconds
        if outcome.startswith(("raw", "hang")):
            print(outcome, "|", call.encode(errors="replace").decode(), flush=True)
    faulthandler.cancel_dump_traceback_later()
    print(", ".join(f"{number} {outcome}" for outcome, number in outcomes.most_common()))
    print("longest:", ", ".join(f"{name} {seconds:.1f} s" for name, seconds in slow.most_common(12)))
    return not {"raw", "hang"} & set(outcomes)


if __name__ == "__main__":
    words = sys.argv[1:]
    commands = words[:1] == ["commands"]
    numbers = [int(word) for word in words[commands:]]
    count = numbers[0] if numbers else 1000 if commands else 20_000
    with tempfile.TemporaryDirectory() as name:
        first = numbers[1] if numbers[1:] else 0
        calls = run_commands(count, Path(name), first) if commands else fuzz(count, ROOT, Path(name), first)
        well = report(calls)
    sys.exit(0 if well else 1)
