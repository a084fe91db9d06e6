"""The scripts compute the stored reference numbers again, and use nothing of gaitopt."""

import ast
from pathlib import Path

import numpy as np
import pytest

from tests.references import compass_optimum, compass_passive, rimless_wheel, simplest_walker
from tests.references.storage import MULTIPLIER_ACCURACY, differ_most, load_references, round_to

HERE = Path(__file__).parent
SCRIPTS = {
    module.__name__.rpartition(".")[2]: module
    for module in (compass_passive, rimless_wheel, simplest_walker, compass_optimum)
}


def pytest_generate_tests(metafunc):
    """Give the test the quick computations of each script, or all of them with ``--frozen=all``."""
    if "computation" in metafunc.fixturenames:
        everything = metafunc.config.getoption("frozen") == "all"
        pairs = [
            (script, name)
            for script, module in SCRIPTS.items()
            for name in (module.COMPUTATIONS if everything else module.QUICK)
        ]
        metafunc.parametrize(("script", "computation"), pairs, ids=[" ".join(pair) for pair in pairs])


def test_the_stored_numbers_are_computed_again(script, computation):
    function, accuracy = SCRIPTS[script].COMPUTATIONS[computation]
    stored = dict(load_references()[script][computation])
    assert stored.pop("accuracy") == accuracy
    found = round_to(function(), accuracy)
    assert differ_most(found.pop("multipliers", 0), stored.pop("multipliers", 0)) <= MULTIPLIER_ACCURACY
    assert differ_most(found, stored) <= accuracy


def test_every_computation_is_stored_and_no_other():
    stored = {script: set(computations) for script, computations in load_references().items()}
    assert stored == {script: set(module.COMPUTATIONS) for script, module in SCRIPTS.items()}


@pytest.mark.parametrize(
    "path", [*HERE.glob("*.py"), *(HERE.parent / "newton_euler").glob("*.py")], ids=lambda p: p.name
)
def test_no_script_uses_gaitopt(path):
    for node in ast.walk(ast.parse(path.read_text())):
        names = [alias.name for alias in getattr(node, "names", ()) if isinstance(node, ast.Import)]
        names += [node.module] if isinstance(node, ast.ImportFrom) else []
        assert not any(name.partition(".")[0] == "gaitopt" for name in names)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gait_a", "gait_b", "gait_c", "goswami"])
def test_another_integrator_agrees(name, request):
    """A Runge-Kutta pair of order 5 instead of 8; but for one gait with ``--frozen=all`` only."""
    if name != "gait_a" and request.config.getoption("frozen") != "all":
        pytest.skip("computed with --frozen=all")
    function, accuracy = compass_passive.COMPUTATIONS[name]
    found, stored = round_to(function("RK45"), accuracy), load_references()["compass_passive"][name]
    for key, values in found.items():
        assert differ_most(values, stored[key]) <= (MULTIPLIER_ACCURACY if key == "multipliers" else accuracy)


def test_types_without_events_meet_their_closed_forms():
    stored = load_references()["rimless_wheel"]
    beta = (np.cos(np.pi / 5) + 1 / 3) / (4 / 3)
    assert stored["type_a"]["multipliers"][0][0] == pytest.approx(beta**2, abs=MULTIPLIER_ACCURACY)
    rate = beta * np.sqrt(4 * np.sin(np.radians(13)) * np.sin(np.pi / 10) / (1 - beta**2))
    assert stored["type_a"]["z"] == pytest.approx([rate], abs=stored["type_a"]["accuracy"])
    assert stored["six_spokes"]["multipliers"][0][0] == pytest.approx(4 / 9, abs=MULTIPLIER_ACCURACY)
