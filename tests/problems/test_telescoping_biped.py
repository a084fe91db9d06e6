"""The telescoping biped in the limit of strong legs and light feet: impulsive gaits with closed forms.

Source: Kuo (Journal of Biomechanical Engineering 124, 2002), Srinivasan & Ruina (Nature 439, 2006).  A unit point mass
on massless legs of length 1 walks as an inverted pendulum with a push-off P = w tan(al) just before touchdown, w its
speed at touchdown and 2 al the angle between the legs, or runs with P = D / (2 U); the work is P^2 / 2.
"""

import functools
import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from gaitopt.cli.script import call_script
from gaitopt.model import check_planar, telescoping_biped
from gaitopt.ocp import solve_planar
from gaitopt.simulation import verify_planar
from tests.conftest import ROOT

LEGS, EVERY = ("leg A", "leg B"), ("leg A", "leg B", "hip")
RUN = ("sequence=foot A stick > flight |", "speed=1.2", "step_length=1")
WALK = 0.00584888056662
"""Work of the impulsive walk at speed 0.5 and step length 0.4, which a test derives."""


SCRIPT = ROOT / "problems" / "telescoping_biped.py"


@functools.cache
def gait_of(*changes):
    gait = verify_planar(solve_planar(call_script(SCRIPT, ["intervals=8", *changes])))
    assert gait.status.ok, gait.solver.violations
    assert gait.verification.passed, gait.verification.reasons
    return gait


def positive_work(gait, actuators):
    """Return the positive work of some actuators in a step."""
    rows = [gait.robot.actuators.index(name) for name in actuators]
    return sum(np.maximum(np.diff(segment.work[rows], axis=1), 0).sum() for segment in gait.motion.segments)


def walking_work(speed, step):
    """Return the work of the impulsive walk; the speed at touchdown follows from the duration of the vault."""
    angle = math.asin(step / 2)

    def vault(touchdown_speed):
        def pace(th):
            return 1 / math.sqrt(touchdown_speed**2 - 2 * (math.cos(th) - math.cos(angle)))

        return 2 * quad(pace, 0, angle)[0] - step / speed

    slowest = math.sqrt(2 * (1 - math.cos(angle)))
    return (brentq(vault, slowest * (1 + 1e-9), 3) * math.tan(angle)) ** 2 / 2


def test_the_robot_passes_its_check():
    assert check_planar(telescoping_biped()).passed


def test_the_closed_form_has_the_published_values():
    """The numbers were computed independently of this package."""
    assert walking_work(0.5, 0.4) == pytest.approx(WALK, abs=5e-15)
    assert walking_work(0.8, 0.5) == pytest.approx(0.0232165285480, abs=5e-14)


@pytest.mark.slow
def test_the_work_of_the_walk_tends_to_the_impulsive_one():
    limits = (f"force_limit={limit}" for limit in (4, 8))
    weaker, stronger = (positive_work(gait_of(limit, "intervals=12"), LEGS) / WALK for limit in limits)
    assert 1 < stronger < weaker < 1.3
    assert 2 * stronger - weaker == pytest.approx(1, abs=0.03)  # the excess is about proportional to 1 / force_limit


@pytest.mark.slow
def test_the_work_of_the_run_tends_to_the_impulsive_one():
    impulsive = 1 / (8 * 1.2**2)
    weaker, stronger = (positive_work(gait_of(*RUN, f"force_limit={limit}"), LEGS) / impulsive for limit in (4, 8))
    assert 1 < stronger < weaker < 1.2
    assert 2 * stronger - weaker == pytest.approx(1, abs=0.04)


@pytest.mark.slow
def test_the_actuators_of_the_run_replace_what_the_impact_takes():
    gait = gait_of(*RUN, "force_limit=4")
    assert str(gait.sequence) == "foot A stick > flight |"
    assert gait.energy.actuator == pytest.approx(gait.energy.impact_loss, rel=1e-6)
    assert sum(segment.time[-1] - segment.time[0] for segment in gait.motion.segments) == pytest.approx(1 / 1.2)


@pytest.mark.slow
def test_a_hip_that_works_in_double_support_lowers_the_work():
    """The impulsive gait is the best one of telescoping legs without hip torque only."""
    work = {
        limit: positive_work(gait_of("speed=0.8", "step_length=0.5", "force_limit=8", f"torque_limit={limit}"), EVERY)
        for limit in (0.02, 1)
    }
    assert 1 < work[0.02] / walking_work(0.8, 0.5) < 1.15
    assert work[1] < 0.95 * work[0.02]
