"""The feedback law whose gains were optimised together with a gait."""

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.control.reference import reference
from gaitopt.control.state_feedback import state_feedback
from gaitopt.errors import InputError
from gaitopt.motion.gait import Gait, check_gait
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.keys import Unknown


@check_arguments
def planned_gains(gait: Gait) -> Array:
    """Return the gains K that were optimised with a gait, shape (n_u, 2 n_angles + 1).

    The columns are those of x = (angles, foot speed, rates), in N m per rad, m/s and rad/s.

    Raises
    ------
    InputError
        If the problem of the gait has no free gains.

    Examples
    --------
    >>> from gaitopt import load
    >>> planned_gains(load("docs/examples/compass_slip.h5"))
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: The gait has no gains: its problem needs stability=StabilityBound(gain_limit=...).
    """
    check_gait(gait)
    table = None if gait.solution is None else gait.solution.unknowns.get(Unknown.GAIN.value)
    if table is None:
        raise InputError("The gait has no gains: its problem needs stability=StabilityBound(gain_limit=...).")
    gains: Array = table.values.reshape(gait.robot.n_u, -1)
    return gains


@check_arguments
def planned_law(gait: Gait) -> Law:
    """Return the law  u = u_ref(t) - K (x - x_ref(t))  whose constant gains K were optimised with a gait.

    Raises
    ------
    InputError
        If the problem of the gait has no free gains.

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, StabilityBound, assess_stability, compass_biped, solve
    >>> gait = solve(GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.2, speed=0.6, step_length=0.45,
    ...     limits=Limits(torque=6), objective="torque_squared",
    ...     stability=StabilityBound(radius=0.5, gain_limit=20)))
    >>> bool(assess_stability(gait, law=planned_law(gait)).radius < 0.5 + 1e-6)
    True
    """
    gains = planned_gains(gait)
    pieces = reference(gait.robot, gait.motion).breakpoints.size - 1
    return state_feedback(gait.robot, gait.motion, np.tile(gains, (pieces, 2, 1, 1)), name="planned feedback")
