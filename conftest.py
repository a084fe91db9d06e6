"""Code blocks of the pages are tests: Python runs, commands run, C compiles against an exported header.

Cells of notebook pages (``{code-cell}``) run when the documentation is built.
"""

import gc
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from sybil import Sybil
from sybil.parsers.markdown import CodeBlockParser, PythonCodeBlockParser

ROOT = Path(__file__).parent

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # two processes share the tests, and further threads would only wait

COSTLY = (
    *("tests/continuation/test_two_parameters.py", "tests/cli/test_environment.py"),
    *("tests/ocp/test_clean_statuses.py", "tests/problems/test_studies.py"),
    *("tests/cli/test_planar_feedback_commands.py", "docs/howto/design.md", "tests/design/test_stability_bound.py"),
    *("tests/control/test_planar_phase_variable.py", "docs/howto/branches.md", "tests/cli/test_studies.py"),
    *("tests/ocp/test_multicontact_optima.py", "tests/plot/test_column_figures.py"),
    *("tests/tuning/test_planar_feedback.py", "tests/problems/test_telescoping_biped.py"),
    *("tests/plot/test_gait_figure.py", "tests/cli/test_push_command.py"),
    *("tests/continuation/test_planar_branches.py", "tests/problems/test_flat_foot.py"),
    *("tests/cli/test_feedback_commands.py", "tests/cli/test_robot_of_file.py", "tests/cli/test_trace_command.py"),
    *("tests/study/test_sweep.py", "tests/architecture/test_public_names.py", "tests/cli/test_planar_stability.py"),
    *("tests/plot/test_result_figures.py", "tests/plot/test_planar_figures.py", "tests/continuation/test_trace.py"),
    *("tests/extensions/test_custom_law.py", "tests/ocp/test_exact_work.py", "tests/study/test_trade_offs.py"),
    *("tests/ocp/test_actuator_impulses.py", "tests/cli/test_planar_pictures.py"),
    *("tests/parallel/test_dask_executor.py", "docs/howto/custom_robot_walks.md", "tests/plot/test_legends.py"),
    *("tests/ocp/test_criteria.py", "tests/ocp/test_open_impact.py", "docs/howto/several_contacts.md"),
    *("docs/howto/sweeps.md", "tests/design/test_scenarios.py", "tests/ocp/test_cost_refinement.py"),
    *("tests/continuation/test_optimal_branches.py", "tests/stability/test_every_gait.py"),
    *("tests/fuzz/test_fuzz.py",),
)
"""Files with the most costly tests, in descending order; they come first, so that two processes end together."""


SLOW_PAGES = (
    *("docs/howto/branches.md", "docs/howto/design.md", "docs/howto/sweeps.md", "docs/howto/open_sequences.md"),
    *("docs/howto/several_contacts.md", "docs/howto/custom_robot_walks.md"),
)
"""Pages whose examples count as slow tests."""


def pytest_addoption(parser):
    """Add options; they belong into the conftest of the root, the only one read before the command line."""
    help_text = "frozen results to compute again: those of the default run, or all (tests/frozen)"
    parser.addoption("--frozen", choices=("default", "all"), default="default", help=help_text)
    help_text = "tests of two seconds or more: a run of the whole is without them; run only these, or all"
    parser.addoption("--slow", choices=("without", "only", "all"), help=help_text)


def pytest_configure(config):
    """Register the mark of slow tests."""
    config.addinivalue_line("markers", "slow: takes two seconds or more; a run of the whole leaves it out (see --slow)")
    if config.option.numprocesses and hasattr(config, "cache"):
        _keep_bytecode(config.cache)


def _keep_bytecode(cache):
    """Let all processes of the tests share compiled code, which takes seconds to compile in each of hundreds.

    An environment that keeps bytecode out of the folders of the sources has it in pytest's cache instead.
    """
    if os.environ.pop("PYTHONDONTWRITEBYTECODE", "") and "PYTHONPYCACHEPREFIX" not in os.environ:
        os.environ["PYTHONPYCACHEPREFIX"] = str(cache.mkdir("bytecode"))


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config):
    """Let two processes share all tests; parts of them run in this one unless ``-n`` states a number."""
    option, whole = config.option, config.args_source is config.ArgsSource.TESTPATHS
    if "PYTEST_XDIST_WORKER" in os.environ:  # this is one of the two
        return
    option.slow = option.slow or ("without" if whole else "all")  # who names a file runs all of its tests
    if whole and option.numprocesses is None:
        option.numprocesses = 2
    if option.numprocesses:
        option.dist = "loadscope"  # a file's tests stay together and share its fixtures
        option.loadscopereorder = False  # files with few tests may be costly


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Collect without searches for unreachable objects, and leave the tests themselves out of later searches.

    The tests are almost two million objects, and each full search among them would take a second.  Later searches are
    less frequent than Python's, which would take a twentieth of the time.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(10_000, 10, 10)
        gc.enable()


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    """Leave out slow tests or all others, and put the tests of costly files first; all others keep their order."""
    if config.option.slow != "all":
        parts = {slow: [item for item in items if _is_slow(item) is slow] for slow in (True, False)}
        only = config.option.slow == "only"
        config.hook.pytest_deselected(items=parts[not only])
        items[:] = parts[only]
    places = {name: place for place, name in enumerate(COSTLY)}
    items.sort(key=lambda item: places.get(item.nodeid.partition("::")[0], len(COSTLY)))


def _is_slow(item):
    return item.get_closest_marker("slow") is not None or item.nodeid.startswith(SLOW_PAGES)


def run_commands(example):
    """Run the gaitopt commands of a block; each must succeed.  Those whose results a test checks run there."""
    from gaitopt.cli.app import main
    from tests.docs.checked_commands import is_checked, read_arguments

    for line in example.parsed.splitlines():
        if is_checked(line):
            continue
        program, *arguments = read_arguments(line) or ["gaitopt", "--version"]
        assert program == "gaitopt", f"a bash block holds gaitopt commands only; {line!r} belongs into a text block"
        with pytest.raises(SystemExit) as stop:
            main(arguments)
        assert stop.value.code == 0, line


def compile_c(example):
    """Compile a block of C that uses gait.h, its statements as the body of a function."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("needs a C compiler on the PATH (Debian: apt-get install gcc)")
    from gaitopt import compass_biped, feedforward, load, write_c

    gait, robot = load("docs/examples/compass_slip.h5"), compass_biped()
    write_c(robot, feedforward(robot, gait.motion), gait.motion.parameters, "gait.c")
    includes, statements = re.match(r"((?:#[^\n]*\n|\n)*)(.*)", example.parsed, re.DOTALL).groups()
    given = "double clock, const double *q, const double *v"
    Path("block.c").write_text(f"#include <stddef.h>\n{includes}\nvoid block({given}) {{\n{statements}\n}}\n")
    subprocess.run([compiler, "-std=c99", "-Wall", "-Werror", "-fsyntax-only", "block.c"], check=True)


def enter_folder(namespace):
    """Enter an empty folder that sees the repository's examples and problems."""
    import tempfile

    namespace["_folder"], namespace["_former"] = tempfile.TemporaryDirectory(), Path.cwd()
    for name in ("docs", "problems"):
        (Path(namespace["_folder"].name) / name).symlink_to(ROOT / name)
    os.chdir(namespace["_folder"].name)


def leave_folder(namespace):
    """Return to where the tests run."""
    os.chdir(namespace["_former"])
    namespace["_folder"].cleanup()


pytest_collect_file = Sybil(
    parsers=[
        PythonCodeBlockParser(),
        CodeBlockParser(language="bash", evaluator=run_commands),
        CodeBlockParser(language="c", evaluator=compile_c),
    ],
    patterns=["*.md"],
    setup=enter_folder,
    teardown=leave_folder,
).pytest()
