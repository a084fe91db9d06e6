"""One-sided derivatives of gaits whose impulse lies on the boundary of the friction cone.

An arbitrarily small change then decides whether the impact sticks or slips, and the return map has a kink: its
derivative for neighbours whose impact sticks differs from that for neighbours whose impact slips and whose next step
begins with a short slide.  Both are reported, since their average describes no motion.

At the other boundaries of stick-slip modes, where a force touches the cone during a step, the return map is
continuously differentiable: the speed of the slide that appears is of second order in the distance from the boundary.
"""

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion import Array
from gaitopt.simulation.hybrid_automaton import Walker, WalkStep
from gaitopt.stability.linearisation import Linearisation
from gaitopt.stability.section import Section


def one_sided_derivatives(
    walker: Walker, state: Array, walk_step: WalkStep, *, nearness: float = 1e-6
) -> tuple[Array, ...]:
    """Return the derivatives of the return map on the sticking and on the slipping side of the cone's boundary.

    Parameters
    ----------
    walker : Walker
    state : (2 n_q,) array
        The gait's state after touchdown.
    walk_step : WalkStep
        Step of the gait.
    nearness : float
        Largest distance from the boundary: of the impulse ratio relative to friction, or of the foot speed after a
        slipping impact relative to the largest rate.

    Returns
    -------
    tuple of arrays
        Two (n_z, n_z) arrays for the section with foot speed; empty if the impulse is not on the boundary.
    """
    impact, friction = walk_step.impact, walker.contact.friction
    if impact is None or impact.mode is None or walk_step.following is None or not np.isfinite(friction):
        return ()
    ratio = float(impact.impulse[0] / impact.impulse[1])
    if impact.mode.slips:
        # A slipping impulse always lies on the cone; it is near the boundary if the foot is left almost at rest.
        speed = walk_step.following[walker.robot.state_entries.slip_velocity]
        if not abs(speed) <= nearness * np.max(np.abs(impact.v_plus)):
            return ()
    elif not abs(abs(ratio) - friction) <= nearness * friction:
        return ()
    section, linearisation = Section(walker.robot, walker.p, sliding=True), Linearisation(walker)
    slip = Mode.slipping(-ratio)
    sides = []
    for outcome, speed in ((Mode.STICK, 0.0), (slip, 1e-9 * slip.sign)):
        z = section.project(state)
        z[-1] = speed
        beside = section.embed(z)
        walk_step_beside = walker.walk_step(beside)
        if walk_step_beside.following is None:
            return ()
        matrix = linearisation.derivative(beside, walk_step_beside, impact=outcome) @ section.tangent(z)
        sides.append(matrix[section.places])
    return tuple(sides)
