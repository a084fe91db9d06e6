"""Contact sequences that no periodic gait can have: slip in one direction only, and slip on infinite friction."""

import math

from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.ocp.problem import GaitProblem

BALANCED = 1e-6
"""Difference of friction and tangent of the slope up to which gravity may balance the friction of a one-way slip."""


def explain_impossibility(sequence: ContactSequence, problem: GaitProblem) -> str:
    """Return why no periodic gait of a problem can have a contact sequence, or "" if no known reason applies.

    Over a periodic step the tangential contact impulse balances the impulse of gravity along the slope, and the normal
    one that across it: their ratio is -tan(slope).  If the foot slips in one direction in every phase and at the
    impact, the ratio is the friction coefficient instead.

    Parameters
    ----------
    sequence : ContactSequence
    problem : GaitProblem
        Its own sequence is ignored.

    Examples
    --------
    >>> from gaitopt import GaitProblem, compass_biped
    >>> problem = GaitProblem(robot=compass_biped(), sequence="slip+ | slip+", friction=0.14, speed=0.6)
    >>> print(explain_impossibility(problem.sequence, problem))
    all contacts slip forward all the time: friction 0.14 then changes the momentum along the ground in every step, \
and no periodic gait exists unless friction is tan(slope) = 0
    """
    modes = {*sequence.phases, sequence.impact}
    if any(mode.slips for mode in modes) and math.isinf(problem.friction):
        return "a foot cannot slip on infinite friction"
    if len(modes) > 1 or not sequence.impact.slips or {"friction", "slope"} & {*problem.free_ranges}:
        return ""
    return describe_one_way_slip(sequence.impact.sign, problem.friction, problem.values["slope"])


def describe_one_way_slip(sign: int, friction: float, slope: float) -> str:
    """Return why contacts cannot slip in one direction all the time; empty if gravity balances their friction.

    Parameters
    ----------
    sign : int
        1 for slip forward, -1 for slip backward.
    friction : float
    slope : float [rad]

    Examples
    --------
    >>> describe_one_way_slip(1, 0.1, 0.0996687)
    ''
    """
    grade = math.tan(slope)
    if abs(sign * friction - grade) <= BALANCED:
        return ""
    return (
        f"all contacts slip {'forward' if sign > 0 else 'backward'} all the time: friction {friction:g} then "
        "changes the momentum along the ground in every step, and no periodic gait exists unless friction is "
        f"{'' if sign > 0 else '-'}tan(slope) = {sign * grade + 0.0:.4g}"
    )
