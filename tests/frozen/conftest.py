"""One test per frozen result: those of the default run, or all of them with ``pytest tests/frozen --frozen=all``."""

from tests.frozen.storage import load_frozen

collect_ignore = ["make_frozen.py"]


def pytest_generate_tests(metafunc):
    """Give each test of a module the entries of the file the module names."""
    if "entry" in metafunc.fixturenames:
        everything = metafunc.config.getoption("frozen") == "all"
        entries = [entry for entry in load_frozen(metafunc.module.FILE) if everything or entry["default"]]
        metafunc.parametrize("entry", entries, ids=[entry["name"] for entry in entries])
