"""Recovery of a saved gait from pushes under a law."""

from gaitopt.control.law import Law
from gaitopt.errors import InputError
from gaitopt.motion.gait import Gait
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.stability.assessment import assess_stability
from gaitopt.stability.recovery import PushTest, Recovery, measure_recovery


def measure_gait_recovery(gait: Gait, law: Law, radius: float, test: PushTest | None = None) -> Recovery | None:
    """Return the recovery of a gait from a ball of pushes under a law, or None without a periodic gait.

    Parameters
    ----------
    gait : Gait
    law : Law
    radius : float [rad/s]
        Radius of the ball of pushes.
    test : PushTest, optional

    Examples
    --------
    >>> from gaitopt import feedforward, load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> measure_gait_recovery(gait, feedforward(gait.robot, gait.motion), 0.01, PushTest(starts=2)).returned
    2
    """
    try:
        cycle = assess_stability(gait, law)
    except InputError:
        return None
    return measure_recovery(make_walker(gait.robot, law, cycle.parameters, period=gait.period), cycle, radius, test)
