"""Audit of 100 problems: no gait passes that the second integrator refutes, and no solution is refused.

``pytest tests/benchmarks/test_audit.py --benchmark-only -s`` takes about four minutes on a quiet machine.
"""

import json

from gaitopt.cli.app import main

COUNT = 100


def test_no_false_pass_among_random_problems(benchmark, capsys):
    def run():
        try:
            main(["audit", "--count", str(COUNT), "--json"])
        except SystemExit:
            return json.loads(capsys.readouterr().out)

    facts = benchmark.pedantic(run, rounds=1)
    assert facts["findings"] == []
    assert not facts["lost"]
    assert sum(facts["results"].values()) == COUNT
    assert facts["results"]["verified"] > 0.7 * COUNT
