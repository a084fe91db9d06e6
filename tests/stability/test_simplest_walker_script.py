"""The script of the simplest walker in the limit of massless feet."""

import numpy as np
import pytest

from gaitopt.cli.script import call_script
from tests.conftest import ROOT

STATE = [-0.2003109005442, 0.199832473005]
MULTIPLIERS = [-0.1900998410659 - 0.5575987766821j, -0.1900998410659 + 0.5575987766821j, 0]


def test_its_stable_gait_tends_to_that_of_massless_feet(cycle):
    """Source: tests/references/simplest_walker.py, which integrates the equations of Garcia et al."""
    gaits = []
    for foot_mass in (2e-4, 1e-4):
        walk = call_script(ROOT / "problems" / "simplest_walker.py", [f"foot_mass={foot_mass}"])
        gaits.append(cycle(walk.robot, walk.parameters, [-0.2003, 0.1998, -0.184, 0.0]))
    assert gaits[1].z[:2] == pytest.approx(STATE, abs=3e-5)
    double, single = ([*gait.z[:2], *np.sort_complex(gait.multipliers)] for gait in gaits)
    limit = 2 * np.array(single) - np.array(double)
    assert limit[:2] == pytest.approx(np.array(STATE), abs=1e-7)
    assert limit[2:] == pytest.approx(np.array(MULTIPLIERS), abs=5e-6)
