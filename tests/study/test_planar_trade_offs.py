"""Trade-offs of robots with several contacts: the front of the hopping monopod."""

import numpy as np
import pytest

from gaitopt import Execution, InputError
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.ocp.multicontact.planar_solver import solve_planar
from gaitopt.study import Pareto, load_front, load_front_gait
from gaitopt.study.trade_offs.quantity import quantity_named, restrict_torque
from tests.ocp.multicontact_examples import drag, hop

TORQUE = Pareto(objectives=("cost", "peak_torque", "spectral_radius"), points=3, bounds={"peak_torque": (60.0, 240.0)})


@pytest.fixture(scope="module")
def front(tmp_path_factory):
    path = tmp_path_factory.mktemp("front") / "hop.nc"
    return path, TORQUE.trace(hop(clearance=1e-3), execution=Execution(workers=1), path=path)


@pytest.mark.slow
def test_every_point_is_replayed_and_not_dominated(front):
    _, table = front
    assert (table.status == "solved").all()
    assert (table.verified == 1).all()
    assert (table.front == 1).all()
    assert np.abs(table.forward_cost.values / table.backward_cost.values - 1).max() < 1e-5
    assert np.all(table.peak_torque.values <= table.bound_peak_torque.values * (1 + 1e-6))


@pytest.mark.slow
def test_a_point_is_the_gait_of_lowest_cost_under_its_limit(front):
    path, table = front
    gait = load_front_gait(path, 1)
    assert isinstance(gait, PlanarGait)
    cold = solve_planar(restrict_torque(hop(clearance=1e-3), 150.0))
    assert gait.solver.objective <= cold.solver.objective * (1 + 1e-5)
    assert np.abs(gait.motion.channel("torque")).max() == pytest.approx(150.0, rel=1e-5)
    assert load_front(path).equals(table)


@pytest.mark.slow
def test_the_best_value_of_the_peak_torque_is_found():
    table = Pareto(objectives=("cost", "peak_torque"), points=2).trace(hop(clearance=1e-3))
    assert table.status.values[0] == "solved"
    assert table.bound_peak_torque.values[1] < 30 < 200 < table.bound_peak_torque.values[0]


def test_the_speed_of_a_monopod_is_bounded_from_below():
    quantity = quantity_named("speed")
    problem = quantity.restrict(hop().replace(speed=(1.0, 2.0)), 1.6)
    assert problem.speed == (1.6, 2.0)


def test_a_bound_of_the_spectral_radius_is_refused():
    pareto = Pareto(objectives=("cost", "spectral_radius"), points=2, bounds={"spectral_radius": (0.5, 0.9)})
    with pytest.raises(InputError, match="for a PlanarProblem it is measured"):
        pareto.trace(hop())


def test_a_friction_demand_of_a_slipping_foot_is_refused():
    with pytest.raises(InputError, match="requires a sequence without slip"):
        Pareto(objectives=("cost", "peak_friction_demand"), points=2).trace(drag())
