"""The walker with heel and toe and the hopper of the how-to page are whole scripts, short enough to write."""

import ast
import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "custom_robot.md"
MOST_LINES = 38


def script_of(heading):
    """Return the code blocks between a heading and the next one, one after the other."""
    section = re.split(r"^##+ ", PAGE.read_text(encoding="utf-8").split(f"\n## {heading}\n")[1], flags=re.MULTILINE)[0]
    return "".join(re.findall(r"```python\n(.*?)```", section, re.DOTALL))


@pytest.fixture(scope="module")
def run():
    """Return a function that runs the script of a section in an empty namespace, and returns its names."""

    def execute(heading):
        names = {}
        exec(compile(script_of(heading), heading, "exec"), names)
        return names

    return execute


@pytest.mark.parametrize("heading", ["Walker with heel and toe", "Hopper with a joint stop"])
def test_a_robot_and_its_gait_take_few_lines(heading):
    script = script_of(heading)
    lines, statements = (
        script.splitlines(),
        [node for node in ast.walk(ast.parse(script)) if isinstance(node, ast.stmt)],
    )
    assert 20 < len(lines) <= MOST_LINES
    assert max(map(len, lines)) <= 120
    assert len({node.lineno for node in statements}) == len(statements)  # one on each line


@pytest.mark.slow
def test_the_walker_with_heel_and_toe_walks(run):
    names = run("Walker with heel and toe")
    walk = names["walk"]
    assert walk.verification.passed, walk.verification.reasons
    assert str(walk.sequence) == walk.verification.sequence == "heel a stick | toe a stick |"
    assert len(names["heel_toe"].links) == 6


def test_the_hopper_hops(run):
    hop = run("Hopper with a joint stop")["hop"]
    assert hop.stable
    assert hop.sequence == "sole closed > sole closed | full length latched |"
