"""The matrix of the catalogue: its rows, and the page that it has written."""

import pkgutil

from gaitopt.model import robots
from tests.matrix import COLUMNS, PAGE, attempt, catalogue, row, scripts


def test_a_passive_robot_passes_check_replay_and_multipliers():
    cells = dict(zip(COLUMNS, row("hopper", scripts()["hopper"]), strict=True))
    assert cells["robot"] == "vertical_hopper"
    assert cells["check"] == "passed"
    assert cells["gait"] == "periodic, sole closed > sole closed | full length latched |"
    assert cells["law that stabilises it"] == "stable without feedback"
    assert not cells["multipliers"].startswith("no: ")


def test_a_failure_is_a_cell_with_its_reason():
    def fail():
        raise ValueError("The legs are too short. Use longer ones.")

    assert attempt(fail) == "no: The legs are too short"


def test_every_module_of_the_catalogue_has_its_robot():
    modules = {entry.name for entry in pkgutil.iter_modules(robots.__path__)} - {"catalogue", "planar_catalogue"}
    assert [module for module in modules if not any(name.startswith(module) for name in catalogue())] == []


def test_the_page_names_every_robot_of_the_catalogue():
    text = PAGE.read_text(encoding="utf-8")
    assert [robot.name for robot in catalogue().values() if robot.name.removesuffix("_10") not in text] == []


def test_the_page_has_a_row_for_every_script():
    text = PAGE.read_text(encoding="utf-8")
    assert [name for name in scripts() if f"| {name} |" not in text] == []
