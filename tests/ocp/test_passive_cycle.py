import math

import numpy as np
import pytest

from gaitopt import ContactSequence, InputError, compass_biped, rimless_wheel
from gaitopt.ocp import passive_cycle
from tests.references.storage import reference

# Gait A of Gamus & Or, SIAM J. Appl. Dyn. Syst. 2015 (compass l=1.6, d=0.8, m=4, m_h=2, g=9.8, slope 1 deg), with more
# digits from tests/references/compass_passive.py, which uses nothing of gaitopt.
GAIT_A = reference("compass_passive", "gait_a")
PERIOD, STEP = GAIT_A["period"], GAIT_A["travel"]
SECTION = GAIT_A["z"]  # th1, th1 rate, th2 rate after the leg swap


@pytest.fixture(scope="module")
def cycle():
    return passive_cycle(compass_biped(), math.radians(1), intervals=40)


def test_the_published_period_and_step(cycle):
    assert cycle.period == pytest.approx(PERIOD, abs=5e-8)
    assert cycle.travel == pytest.approx(STEP, abs=5e-8)


def test_the_published_section_state(cycle):
    jump = cycle.jumps[0]
    assert (jump.q_next[2], *jump.v_next[2:]) == pytest.approx(SECTION, abs=1e-7)


def test_it_is_passive_and_periodic(cycle):
    assert not np.any(cycle.channel("torque"))
    assert cycle.sequence() == ContactSequence.parse("stick | stick")
    first, jump = cycle.segments[0], cycle.jumps[0]
    assert jump.q_next[2:] == pytest.approx(first.q[2:, 0], abs=1e-9)
    assert jump.v_next == pytest.approx(first.v[:, 0], abs=1e-9)


def test_the_slope_pays_for_the_impact(cycle):
    # A passive gait loses m g L sin(alpha) in each step: nothing else feeds it.
    paid = 10.0 * 9.8 * STEP * math.sin(math.radians(1))
    assert cycle.jumps[0].energy_lost == pytest.approx(paid, rel=1e-7)


def test_a_coarse_grid_costs_accuracy_not_the_cycle():
    errors = [abs(passive_cycle(compass_biped(), math.radians(1), intervals=n).period - PERIOD) for n in (4, 8)]
    assert 1e-9 < errors[1] < errors[0] / 30 < 1e-3  # order 6: 64 times less with twice the intervals


def test_other_masses_have_other_cycles():
    # Goswami's compass at 3 deg; which of its two cycles is found is open, but each loses m g L sin(alpha).
    parameters = {"leg_mass": 5, "hip_mass": 10, "leg_length": 1, "leg_com": 0.5, "gravity": 9.81}
    cycle = passive_cycle(compass_biped(), math.radians(3), parameters)
    assert cycle.total_mass == 20
    assert cycle.jumps[0].energy_lost == pytest.approx(20 * 9.81 * cycle.travel * math.sin(math.radians(3)), rel=1e-7)


def test_no_cycle_uphill():
    with pytest.raises(InputError, match=r"No passive cycle of robot 'compass_biped' was found at a slope of -2 deg"):
        passive_cycle(compass_biped(), math.radians(-2))


def test_a_robot_without_actuators_is_refused():
    with pytest.raises(InputError, match="no actuators"):
        passive_cycle(rimless_wheel(), 0.2)
