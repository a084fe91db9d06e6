"""A sample of damaged files; ``python -m tests.damage 3000`` reads more of them."""

import numpy as np
import pytest

from gaitopt import basin, load_diagram, rimless_wheel, save
from gaitopt.continuation.diagram_file import save_diagram
from tests.damage.damaged_files import UNNOTICED, damage, read_damaged


@pytest.mark.parametrize("kind", ["gait", "diagram", "basin"])
def test_no_damage_goes_unnoticed(kind, slip_gait, tmp_path, request):
    path = tmp_path / f"whole.{'h5' if kind == 'gait' else 'nc'}"
    if kind == "gait":
        save(slip_gait, path)
    elif kind == "diagram":
        save_diagram(load_diagram(request.config.rootpath / "docs/examples/compass_slope.nc"), path)
    else:
        basin(rimless_wheel(), {"slope": 0.23}, {"theta_rate": [0.1, 2.0]}, path=path)
    original = path.read_bytes()
    for number in range(40):
        content = damage(original, np.random.default_rng([1, number]))
        assert read_damaged(kind, content, original, tmp_path / f"damaged{path.suffix}") != UNNOTICED
