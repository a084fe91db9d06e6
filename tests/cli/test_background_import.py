"""Import of modules while a solver iterates."""

import sys
import threading

import pytest

from gaitopt.cli import background_import
from gaitopt.cli.background_import import BackgroundImport

LONG = 60.0


@pytest.fixture
def imported(monkeypatch):
    """Return the list of modules that are imported, which stays empty in the main thread."""
    modules = []
    monkeypatch.setattr(background_import, "import_module", modules.append)
    return modules


def continue_until(background, reached):
    """Report iterations until a condition is fulfilled."""
    for _ in range(10_000):
        if reached():
            return
        background.continue_import()
        background.thread.join(0.001)
    raise AssertionError("the modules were not imported")


def test_a_module_that_cannot_be_imported_in_the_background_prevents_no_other(monkeypatch):
    monkeypatch.delitem(sys.modules, "colorsys", raising=False)
    with BackgroundImport(["no_such_module", "colorsys"]) as background:
        continue_until(background, lambda: "colorsys" in sys.modules)
    background.thread.join(LONG)
    assert not background.thread.is_alive()


def test_an_import_in_the_background_yields_to_the_solver_and_restores_the_interval(monkeypatch):
    before, during = sys.getswitchinterval(), []
    monkeypatch.setattr(background_import, "import_module", lambda module: during.append(sys.getswitchinterval()))
    with BackgroundImport(["colorsys"]) as background:
        continue_until(background, lambda: not background.thread.is_alive() and during)
    assert during[0] < before == sys.getswitchinterval()


def test_modules_are_imported_once_and_only_while_the_solver_iterates(imported):
    with BackgroundImport(["h5py", "json"]) as background:
        assert background.thread.ident is None
        continue_until(background, lambda: len(imported) == 2)
        background.thread.join(LONG)
        background.continue_import()
    assert imported == ["h5py", "json"]


def test_each_module_waits_for_an_iteration(monkeypatch):
    begun, finish, imported = threading.Event(), threading.Event(), []

    def import_slowly(module):
        imported.append(module)
        begun.set()
        finish.wait(LONG)

    monkeypatch.setattr(background_import, "import_module", import_slowly)
    with BackgroundImport(["h5py", "json"]) as background:
        background.continue_import()
        assert begun.wait(LONG)
        background.continue_import()  # during the import of the first module
        finish.set()
        background.thread.join(0.05)
        assert imported == ["h5py"]
        assert background.thread.is_alive()
    background.thread.join(LONG)
    assert not background.thread.is_alive()
    assert imported == ["h5py"]


def test_nothing_is_imported_without_an_iteration_and_after_the_end(imported):
    with BackgroundImport(["h5py"]) as background:
        pass
    assert background.thread.ident is None
    background.continue_import()
    background.thread.join(LONG)
    assert imported == []


def test_without_memory_for_a_thread_nothing_is_imported(imported, monkeypatch):
    def refuse():
        raise RuntimeError("can't start new thread")

    with BackgroundImport(["h5py"]) as background:
        monkeypatch.setattr(background.thread, "start", refuse)
        background.continue_import()
    assert imported == []
