"""Every public name is importable, known to type checkers and editors, and has an example that runs as a doctest."""

import ast
import inspect
import subprocess
import sys
import types
from importlib import import_module
from pathlib import Path

import pytest

import gaitopt
from gaitopt.lazy_exports import LazyPackage, exported_names

PACKAGE = Path(gaitopt.__file__).parent
WINGS = sorted(f"gaitopt.{path.parent.name}" for path in PACKAGE.glob("*/__init__.pyi"))
MODULES = ("gaitopt.errors", "gaitopt.parameters", "gaitopt.progress", "gaitopt.status")
MOST_NAMES = 100
OFTEN = [(name, module) for name, module in exported_names("gaitopt").items()]
PLACES = {(name, module) for wing in WINGS for name, module in exported_names(wing).items()} | {
    (name, module) for module in MODULES for name in import_module(module).__all__
}
THINGS = {name: getattr(import_module(module), name) for name, module in sorted(PLACES)}


def test_few_names_stand_at_the_top_and_each_stands_in_its_wing():
    assert 50 < len(gaitopt.__all__) <= MOST_NAMES
    assert sorted(gaitopt.__all__) == gaitopt.__all__
    assert set(OFTEN) <= PLACES
    assert gaitopt.__version__.count(".") == 2


def test_no_public_name_has_two_meanings():
    assert len(PLACES) == len({name for name, _ in PLACES})


def test_every_wing_but_the_command_line_has_public_names():
    packages = {f"gaitopt.{path.parent.name}" for path in PACKAGE.glob("*/__init__.py")}
    assert packages - set(WINGS) == {"gaitopt.cli"}


@pytest.mark.parametrize("package", ["gaitopt", *WINGS])
def test_a_package_lists_its_names_and_refuses_others(package):
    module = import_module(package)
    assert set(dir(module)) - {"__version__"} == set(module.__all__) == set(exported_names(package))
    assert all(where.startswith(f"{package}.") for where in exported_names(package).values())
    with pytest.raises(AttributeError, match=f"module '{package}' has no attribute 'solv'"):
        _ = module.solv


@pytest.mark.parametrize("package", ["gaitopt", *WINGS])
def test_the_names_of_a_stub_are_those_that_python_reads(package):
    stub = ast.parse(Path(import_module(package).__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    entries = {entry.name: node.module for node in imports for entry in node.names if entry.name == entry.asname}
    assert {name: where for name, where in entries.items() if name[0] != "_"} == exported_names(package)


@pytest.mark.parametrize(
    "first", ["gaitopt.study.sweeps.sweep", "gaitopt.control.joint_pd", "gaitopt.study.sweeps.sweep_file"]
)
def test_a_name_never_becomes_the_module_of_that_name(first):
    code = (
        f"import types, {first}, gaitopt.study, gaitopt.control\n"
        "from gaitopt.study import sweep\n"
        "from gaitopt.control import joint_pd\n"
        "assert {type(sweep), type(joint_pd)} == {types.FunctionType}, (sweep, joint_pd)\n"
        "from gaitopt.study.sweeps.sweep import sweep as again\n"
        "assert again is sweep is gaitopt.sweep is gaitopt.study.sweep\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)


def test_a_wing_imports_none_of_its_modules():
    code = f"import sys, {', '.join(WINGS)}\nprint(*[name for name in sys.modules if name.count('.') > 1])"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True, timeout=120)
    assert not [name for name in done.stdout.split() if name.startswith("gaitopt.")]
    assert isinstance(gaitopt, LazyPackage)


SNIPPET = """\
from gaitopt import GaitProblem, compass_biped, solve
from gaitopt.stability import Cycle
from gaitopt.study.sweeps.sweep import sweep

reveal_type(GaitProblem)
reveal_type(solve)
reveal_type(sweep)
reveal_type(Cycle)
GaitProblem(robot=3, wordd="x")
from gaitopt import solv
"""


@pytest.mark.slow
def test_type_checkers_know_the_public_names(tmp_path):
    snippet = tmp_path / "snippet.py"
    snippet.write_text(SNIPPET)
    tool = [sys.executable, "-m", "mypy", "--strict", "--config-file=", "--follow-imports=silent"]
    cache = ["--ignore-missing-imports", f"--cache-dir={tmp_path}", "--no-error-summary", str(snippet)]
    done = subprocess.run([*tool, *cache], cwd=PACKAGE.parent, capture_output=True, text=True, timeout=600)
    lines = [line.removeprefix(f"{snippet}:") for line in done.stdout.splitlines()]
    revealed = [line.partition("Revealed type is ")[2] for line in lines if "Revealed type" in line]
    assert len(revealed) == 4
    assert not [text for text in revealed if text.startswith('"Any')]
    assert "gaitopt.ocp.problem.GaitProblem" in revealed[0]
    assert "gaitopt.stability.cycle.Cycle" in revealed[3]
    errors = "\n".join(line for line in lines if " error: " in line)
    assert 'Argument "robot" to "GaitProblem" has incompatible type "int"' in errors
    assert 'Unexpected keyword argument "wordd" for "GaitProblem"' in errors
    assert 'Module "gaitopt" has no attribute "solv"' in errors
    assert {line.split(":")[0] for line in lines if " error: " in line} == {"9", "10"}


@pytest.mark.parametrize(
    ("text", "completed"),
    [
        ("from gaitopt import GaitP", "GaitProblem"),
        ("from gaitopt.study import swe", "sweep"),
        ("import gaitopt\ngaitopt.plot_g", "plot_gait"),
        ("from gaitopt import GaitProblem\nGaitProblem(frictio", "friction="),
    ],
)
def test_editors_complete_the_public_names(text, completed):
    jedi = pytest.importorskip("jedi")
    project = jedi.Project(PACKAGE.parent)
    assert completed in [completion.name for completion in jedi.Script(text, project=project).complete()]


def test_every_public_name_is_documented():
    for name, thing in THINGS.items():
        assert inspect.getdoc(thing), f"{name} has no docstring"
        docstring = thing.__doc__ or ""
        assert docstring.strip(), f"{name} only inherits a docstring"
        assert (name, thing.__module__) in PLACES, f"{name} is not defined where its stub imports it from"


def without_example(thing):
    """Return whether a name is an exception, which needs no example, or abstract, which has no instances."""
    return inspect.isclass(thing) and (issubclass(thing, Exception) or inspect.isabstract(thing))


def test_every_public_function_and_class_has_an_example():
    for name, thing in THINGS.items():
        if not isinstance(thing, type | types.FunctionType) or without_example(thing):
            continue
        documentation = inspect.getdoc(thing)
        assert "Examples\n--------" in documentation, f"{name} has no example"
        assert ">>>" in documentation.split("Examples\n--------")[1], f"the example of {name} is not tested"


def test_every_public_method_is_documented():
    classes = [(name, thing) for name, thing in THINGS.items() if inspect.isclass(thing)]
    members = [(name, thing, *pair) for name, thing in classes for pair in vars(thing).items()]
    for name, owner, member, value in members:
        if member.startswith("_") or not (inspect.isfunction(value) or isinstance(value, property | classmethod)):
            continue
        assert inspect.getdoc(getattr(owner, member)), f"{name}.{member} has no docstring"
