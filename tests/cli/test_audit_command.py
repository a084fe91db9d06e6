"""The command audit: its table, its file, and what it resumes."""

import pytest

from gaitopt.cli import audit_problems


def test_an_audit_is_resumed(command, folder, monkeypatch):
    calls = []

    def judge(shared, number):
        calls.append(number)
        result = "false pass" if number == 2 else "verified"
        return {"script": "monopod", "settings": ["speed=1"], "result": result, "reason": "why", "second_error": 1e-9}

    monkeypatch.setattr(audit_problems, "audit_number", judge)
    first = command("audit", "--count", "2", "--workers", "1", "-o", "audit.json")
    assert first.status == 0
    assert "wrote audit.json" in first.out
    again = command("audit", "--count", "3", "--workers", "1", "-o", "audit.json", "--json")
    assert (again.status, calls) == (1, [0, 1, 2])
    assert again.json["results"] == {"verified": 2, "false pass": 1}
    assert again.json["findings"][0]["number"] == 2
    shown = command("audit", "--count", "3", "--workers", "1", "-o", "audit.json")
    assert 'problem 2: gaitopt solve monopod.py --set "speed=1"' in shown.out
    other = command("audit", "--count", "3", "--seed", "4", "-o", "audit.json")
    assert (other.status, "another seed" in other.err) == (2, True)
    assert [path.name for path in folder.iterdir()] == ["audit.json"]


def test_an_incomplete_audit_states_in_one_sentence_what_is_computed(command, monkeypatch):
    def judge(shared, number):
        if number:
            raise KeyboardInterrupt
        return {"script": "monopod", "settings": [], "result": "verified", "reason": "", "second_error": 1e-9}

    monkeypatch.setattr(audit_problems, "audit_number", judge)
    run = command("audit", "--count", "3", "--workers", "1", "-o", "audit.json")
    assert run.status == 130
    last = "Incomplete: 1 problem is kept in audit.json. Run the same command again to resume."
    assert run.err.splitlines()[-1] == last
    assert "wrote" not in run.out


@pytest.mark.parametrize(("output", "message"), [("a.txt", "Use .json (audit)"), ("nope/a.json", "does not exist")])
def test_a_file_that_cannot_be_written_is_refused_before_the_work(command, folder, output, message):
    run = command("audit", "--count", "1", "-o", output)
    assert run.status == 2
    assert run.err.startswith(f"Error: Cannot write {output}")
    assert message in run.err
    assert [*folder.iterdir()] == []
