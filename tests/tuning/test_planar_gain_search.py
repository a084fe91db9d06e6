"""Search for gains of the feedback of robots with several contacts."""

import numpy as np
import pytest

from gaitopt import Collocation, GainSearchOptions
from gaitopt.control import planar_joint_pd
from gaitopt.interrupts import InterruptRecord
from gaitopt.ocp import solve_planar
from gaitopt.progress import silent
from gaitopt.stability import find_planar_cycle
from gaitopt.tuning import controller_family_named
from gaitopt.tuning.gain_search import GainSearch
from gaitopt.tuning.ground_map import PlanarGroundMap
from gaitopt.tuning.tuning_objective import SpectralRadius
from tests.ocp.multicontact_examples import walk


@pytest.fixture(scope="module")
def gait():
    return solve_planar(walk(transcription=Collocation(intervals=10)))


def test_a_gait_on_another_ground_counts_although_its_period_differs(gait):
    law, ground = planar_joint_pd(gait, stiffness=8.0, damping=2.0), {**gait.motion.parameters, "slope": 0.01}
    first = gait.motion.segments[0]
    cycle = find_planar_cycle(gait.robot, first.q[:, 0], first.v[:, 0], ground, section=law.section, torque=law)
    assert abs(cycle.period / gait.period - 1) > 0.01
    (matrix,) = PlanarGroundMap(gait, ground).derivatives(law)
    assert np.max(np.abs(np.linalg.eigvals(matrix))) == pytest.approx(cycle.radius, rel=1e-6)


def test_an_objective_receives_a_size_for_each_coordinate(gait):
    shapes, family = [], controller_family_named("joint_pd", gait.robot, gait, torque_limit=20.0)

    def record(derivative, scale):
        shapes.append((derivative.shape, scale.shape))
        return 0.0

    search = GainSearch(gait, gait.robot, family, record, (), None, silent)
    search._on_ground(planar_joint_pd(gait), search._grounds[0])
    ((shape, sizes),) = shapes
    assert shape == 2 * sizes


def test_a_search_is_interrupted_during_an_evaluation(gait, monkeypatch):
    """An evaluation of stiff feedback may take minutes; the first one is completed, so that there are best gains."""
    family = controller_family_named("joint_pd", gait.robot, gait, torque_limit=20.0)
    check, received = GainSearch._check, []

    for first in (True, False):
        search, record = GainSearch(gait, gait.robot, family, SpectralRadius(), (), None, silent), InterruptRecord()

        def interrupt(search, first=first, record=record):
            if bool(search.trials) is not first and not record.received:
                record.receive()
                received.append(len(search.trials))
            check(search)

        monkeypatch.setattr(GainSearch, "_check", interrupt)
        best = search.search(GainSearchOptions(samples=2, evaluations=2), record)
        assert search.interrupted
        assert search.trials == [best]
    assert received == [0, 1]
