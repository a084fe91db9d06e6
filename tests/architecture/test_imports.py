"""The journey runs one way: no import cycles, layers kept, nothing heavy at import."""

import ast
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from gaitopt.cli.app import MODULES, import_commands
from tests.architecture.conftest import parse

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "gaitopt"


def modules(package=PACKAGE):
    """Return the source of every module by dotted name."""
    found = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path.read_text()
    return found


def imported(name, source, known):
    """Return the known modules that a module imports when it is loaded (not inside functions or for types only)."""
    found = set()
    for node in module_level(parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = name.split(".")[: -node.level] if node.level else []
            origin = ".".join([*base, *([node.module] if node.module else [])])
            found |= {origin} | {f"{origin}.{alias.name}" for alias in node.names}
    return {target for target in found if target in known} - {name}


def module_level(tree):
    """Yield the statements that run when a module is loaded."""
    for node in tree.body if hasattr(tree, "body") else []:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            continue
        if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
            continue
        yield node
        yield from module_level(node)
        for part in ("orelse", "finalbody", "handlers"):
            for child in getattr(node, part, []):
                yield child
                yield from module_level(child)


def graph(sources):
    return {name: imported(name, source, set(sources)) for name, source in sources.items()}


def cycle(edges):
    """Return one import cycle as a list of modules, or an empty list."""
    done, path = set(), []

    def visit(name):
        if name in path:
            return [*path[path.index(name) :], name]
        if name in done:
            return []
        path.append(name)
        for target in sorted(edges[name]):
            if found := visit(target):
                return found
        done.add(path.pop())
        return []

    for name in edges:
        if found := visit(name):
            return found
    return []


def test_no_import_cycle_in_the_package():
    edges = graph(modules())
    assert len(edges) > 50, "the package was not found"
    assert edges["gaitopt.ocp.solver"] >= {"gaitopt.ocp.solution.single_start", "gaitopt.status"}
    found = cycle(edges)
    assert not found, " -> ".join(found)


LATE = "try:\n    import p.a\nexcept ImportError:\n    pass"
EXAMPLES = [
    ("import p.b", "from p import a", ["p.a", "p.b", "p.a"]),
    ("from .b import x", LATE, ["p.a", "p.b", "p.a"]),
    ("import p.b", "def f():\n    import p.a", []),
    ("import p.b", "if TYPE_CHECKING:\n    import p.a", []),
]


@pytest.mark.parametrize(("a", "b", "expected"), EXAMPLES)
def test_the_search_finds_cycles_and_only_those(a, b, expected):
    assert cycle(graph({"p": "", "p.a": a, "p.b": b})) == expected


def test_the_layers_hold():
    tool = Path(sys.executable).with_name("lint-imports")
    done = subprocess.run([tool, "--no-cache"], cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    assert {contract["containers"][0] for contract in contracts} >= {"gaitopt", "gaitopt.ocp", "gaitopt.study"}
    assert f"{len(contracts)} kept, 0 broken" in done.stdout


def loaded_by(statement):
    """Return the top-level modules loaded after a statement in a fresh interpreter."""
    code = f"import sys\n{statement}\nprint(*{{name.split('.')[0] for name in sys.modules}})"
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    return set(done.stdout.split())


@pytest.mark.parametrize(
    "statement",
    [
        "import gaitopt",
        "from gaitopt.cli.app import app",
        "from gaitopt import solve, verify, load, simulate",
    ],
)
def test_no_matplotlib_without_a_plot(statement):
    loaded = loaded_by(statement)
    assert "gaitopt" in loaded
    assert not loaded & {"matplotlib", "PIL", "imageio_ffmpeg", "pytest"}


def test_importing_gaitopt_loads_no_numerics():
    assert not loaded_by("import gaitopt") & {"casadi", "numpy", "scipy", "h5py"}


def test_a_command_handles_an_interrupt_before_slow_imports():
    statement = "before = set(sys.modules); import gaitopt.__main__; print(*(set(sys.modules) - before)); sys.exit()"
    loaded = loaded_by(statement)
    assert "gaitopt" in loaded
    assert not loaded & {"re", "typing", "pathlib", "inspect", "json"}


def test_the_command_line_imports_scipy_and_hdf5_when_they_are_used():
    assert not loaded_by("from gaitopt.cli.app import app") & {"scipy", "h5py"}


def test_a_command_is_imported_without_the_others():
    modules = "print(*[name for name in sys.modules if name.startswith('gaitopt.cli.')])"
    loaded = loaded_by(f"from gaitopt.cli.app import import_commands; import_commands(['solve', 'a.py']); {modules}")
    assert "gaitopt.cli.solving" in loaded
    assert not loaded & {"gaitopt.cli.studies", "gaitopt.cli.walking", "gaitopt.cli.exporting"}
    assert len(import_commands(["--help"])) == len(import_commands([])) == len(MODULES)


SOLVE = """
from gaitopt import GaitProblem, Limits, compass_biped, solve

problem = GaitProblem(robot=compass_biped(), sequence="slip+ stick | slip+", friction=0.14, speed=0.633,
                      step_length=0.4713, limits=Limits(torque=6))
assert solve(problem).status.ok
import sys
assert not {"scipy.integrate", "scipy.linalg", "scipy.optimize", "scipy.sparse", "scipy.special"} & set(sys.modules)
"""


def test_a_solve_imports_no_part_of_scipy():
    """The import of any of these parts takes as long as a fifth of the solve."""
    assert "gaitopt" in loaded_by(SOLVE)


NOT_INSTALLED = """
from importlib import metadata
from pathlib import Path

known, iterdir = metadata.version, Path.iterdir

def version(name):
    if name == "gaitopt":
        raise metadata.PackageNotFoundError(name)
    return known(name)

metadata.version = version
Path.iterdir = lambda path: (entry for entry in iterdir(path) if not entry.name.startswith("gaitopt-"))
import gaitopt
from gaitopt.motion.versions import versions

print(gaitopt.__version__, versions()["gaitopt"], versions()["numpy"] != "0+unknown")
"""


def test_a_source_tree_that_is_not_installed_can_be_imported():
    run = subprocess.run([sys.executable, "-c", NOT_INSTALLED], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["0+unknown", "0+unknown", "True"]


@pytest.mark.parametrize(
    "module",
    [
        "gaitopt.study.basins.basin_walk",
        "gaitopt.simulation.taylor.heyoka_engine",
        "gaitopt.stability.cycle_search",
        "gaitopt.ocp.solver",
        "gaitopt.simulation.verification",
    ],
)
def test_workers_and_short_commands_import_neither_scipy_nor_h5py(module):
    """Their import takes longer than a solve or a search for gaits."""
    code = f"import {module}, sys; print([name for name in ('scipy', 'h5py', 'xarray') if name in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
