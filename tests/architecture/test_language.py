"""The language of the field: phrases, names of functions and of local variables, first lines of docstrings."""

import ast
import io
import re
import tokenize
from pathlib import Path

import pytest

from tests.architecture.conftest import parse

ROOT = Path(__file__).parents[2]
CODE = sorted((ROOT / "gaitopt").rglob("*.py"))
SCRIPTS = sorted((ROOT / "problems").rglob("*.py"))
TESTS = sorted(
    {*(ROOT / "tests").rglob("*.py"), *(ROOT / "docs").glob("*.py"), ROOT / "conftest.py"} - {Path(__file__)}
)
PAGES = sorted([*(ROOT / "docs").rglob("*.md"), *(ROOT / "docs").rglob("*.ipynb"), *ROOT.glob("*.md")])

REPLACED = {
    r"told|tells?|says?": "reported, reports, states",
    r"go(es|ing)? on|gone on|went on": "continues, resumes",
    r"dear(er|est)?": "costly, higher cost",
    r"cheap(er|est|ly)?": "low cost, lower cost",
    r"of (one's|its|your|his|their) own|(one's|your|his) own": "custom",
    r"anew|afresh": "again",
    r"so often": "at most N times",
    r"at once": "immediately",
    r"by a hair|a hair'?s?": "within a tolerance",
    r"rest(s|ed|ing)? on": "is active",
    r"in disguise": "degenerate",
    r"led to a gait": "converged",
    r"cannot be(?! [a-z]+(?:ed|en|ad)\b)": "is invalid; the accepted values",
    r"(?-i:(?<!there )(?:is none|are none))|is no number": "is not a ..., must be finite",
    r"hold(s|ing)? (a|the) gaits?|gait (is|was) held": "stabilises the gait",
    r"ask(s|ed)? for|(is|are|was|were) wanted": "the requested ...",
    r"(the|nonlinear) programmes?": "the NLP",
    r"(?-i:Where [^.]*, else)": "If ..., otherwise ...",
    r"(?-i:(?<![a-z,;] )Of (the|[0-9]+))": "the subject first",
}
PHRASES = {re.compile(rf"\b(?:{phrase})\b", re.IGNORECASE): better for phrase, better in REPLACED.items()}
ANY_PHRASE = re.compile(rf"\b(?:{'|'.join(REPLACED)})\b", re.IGNORECASE)

REGULAR = re.compile(r"[a-z]{2,}(ed|en)")
IRREGULAR = re.compile(
    "begun|brought|built|caught|found|gone|held|kept|laid|led|lost|made|meant|met|sent|shown|spent|stood|swept|taught|told|torn"
)
NO_PARTICIPLE = re.compile(
    "between|biped|coarsen|embed|feed|flatten|lengthen|need|often|open|proceed|quadruped|screen|seed|shed|shorten|speed|ten|then|token|when"
)
VERBS = {"add", "evaluate", "has", "is", "mark", "require", "reset", "select"}
"""Verbs whose object may end in a participle (`select_admitted`); `robot_named`, a lookup by name, is admitted too."""
VAGUE = {"own", "told", "held", "begun"}


def words_of(path):
    """Return the lines of a file that a person reads: (line number, text) of docstrings, strings and comments."""
    if path.suffix != ".py":
        return list(enumerate(path.read_text().splitlines(), 1))
    kinds = {tokenize.STRING, tokenize.COMMENT} | {getattr(tokenize, "FSTRING_MIDDLE", tokenize.STRING)}
    tokens = tokenize.generate_tokens(io.StringIO(path.read_text()).readline)
    return [
        (token.start[0] + more, line)
        for token in tokens
        if token.type in kinds
        for more, line in enumerate(token.string.splitlines())
    ]


def replaced_phrases(lines):
    """Return the replaced phrases in numbered lines, each with what to write instead."""
    return [
        f"{number}: {match.group()!r} -> {better}"
        for number, line in lines
        if ANY_PHRASE.search(line)  # one pass instead of one for each phrase
        for phrase, better in PHRASES.items()
        if (match := phrase.search(line))
    ]


def is_participle(name):
    """Return whether the last word of a function's name is a participle: `refined`, not `refine` or `is_finished`."""
    first, *_, last = name.strip("_").split("_") * 2
    if first in VERBS or last == "named" or NO_PARTICIPLE.fullmatch(last):
        return False
    return bool(IRREGULAR.fullmatch(last) or REGULAR.fullmatch(last))


def functions_of(tree):
    """Return the functions and methods of a module; a property is data and may be a participle (`passed`)."""
    data = {"property", "cached_property"}
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    return [
        function
        for function in functions
        if not data & {ast.unparse(decorator).rpartition(".")[2] for decorator in function.decorator_list}
    ]


def documented(tree):
    """Return the definitions of a module, and the module, with their docstrings."""
    kinds = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
    return [(node, ast.get_docstring(node) or "") for node in ast.walk(tree) if isinstance(node, kinds)]


def test_the_package_uses_no_replaced_phrase():
    refused = {path.relative_to(ROOT): replaced_phrases(words_of(path)) for path in CODE}
    assert not listed(refused), listed(refused)


def test_pages_and_scripts_use_no_replaced_phrase():
    refused = {path.relative_to(ROOT): replaced_phrases(words_of(path)) for path in [*SCRIPTS, *PAGES]}
    assert not listed(refused), listed(refused)


def test_tests_use_no_replaced_phrase():
    refused = {path.relative_to(ROOT): replaced_phrases(words_of(path)) for path in TESTS}
    assert not listed(refused), listed(refused)


def test_no_function_is_named_by_a_participle():
    refused = {
        path.relative_to(ROOT): [
            f"{function.lineno}: {function.name}"
            for function in functions_of(parse(path.read_text()))
            if is_participle(function.name)
        ]
        for path in [*CODE, *SCRIPTS]
    }
    assert not listed(refused), listed(refused)


def test_no_docstring_begins_with_what():
    refused = {
        path.relative_to(ROOT): [
            f"{getattr(node, 'name', 'module')}: {text.splitlines()[0]}"
            for node, text in documented(parse(path.read_text()))
            if text.startswith("What ")
        ]
        for path in [*CODE, *SCRIPTS]
    }
    assert not listed(refused), listed(refused)


def test_no_local_variable_has_a_vague_name():
    refused = {
        path.relative_to(ROOT): [
            f"{node.lineno}: {node.id}"
            for node in ast.walk(parse(path.read_text()))
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) and node.id in VAGUE
        ]
        for path in CODE
    }
    assert not listed(refused), listed(refused)


def listed(refused):
    """Return one line per refused place."""
    return "\n".join(f"{path}:{place}" for path, places in refused.items() for place in places)


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("the solver is told and goes on with the cheapest gait", 3),
        ("friction cannot be -1 and x is none", 2),
        ("a robot of one's own, started anew, so often", 3),
        ("it says at once what is asked for; the bound rests on zero", 4),
        ("Where it slips, it stops, else it sticks. Of the gaits, one is best: the gait is held", 3),
        ("the toldest gait if speed is None, on its own foot, one of the gaits held constant", 0),
    ],
)
def test_the_phrases_are_found_and_only_those(text, count):
    assert len(replaced_phrases([(1, text)])) == count


@pytest.mark.parametrize("name", ["refined", "_carried", "robot_saved", "found", "is_told_begun", "print_written"])
def test_participles_are_found(name):
    assert is_participle(name) == (name != "is_told_begun")


@pytest.mark.parametrize("name", ["refine", "embed", "is_finished", "slip_speed", "solved_parameters", "screen"])
def test_verbs_nouns_and_predicates_are_no_participles(name):
    assert not is_participle(name)
