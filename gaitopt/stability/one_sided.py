"""One-sided derivatives of gaits whose impact rests on the edge of its friction cone.

There an arbitrarily small change decides whether the impact sticks or slips, and the return map has a kink: its
derivative among neighbours whose impact sticks differs from that among neighbours whose impact slips (whose next step
begins with a short slide).  Both are reported; an average of them would describe no motion.

The other edges of the stick-slip modes, where a force just touches the cone during a step, leave the return map
continuously differentiable: the slide that appears there has a speed of second order in the distance from the edge.
"""

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion import Array
from gaitopt.simulation.hybrid_automaton import Stride, Walker
from gaitopt.stability.linearisation import Linearisation
from gaitopt.stability.section import Section


def one_sided_derivatives(walker: Walker, state: Array, stride: Stride, *, nearness: float = 1e-6) -> tuple[Array, ...]:
    """Return the return map's derivatives on the sticking and on the slipping side of an impact's edge.

    Parameters
    ----------
    walker : Walker
    state : (2 n_q,) array
        The gait's state after touchdown.
    stride : Stride
        Its step.
    nearness : float
        How near to the edge an impact must be: its impulse ratio relative to friction, or its foot speed relative to
        the largest rate.

    Returns
    -------
    tuple of arrays
        Empty away from the edge; else two (n_z, n_z) arrays for the section with foot speed.
    """
    impact, friction = stride.impact, walker.contact.friction
    if impact is None or impact.mode is None or stride.following is None or not np.isfinite(friction):
        return ()
    ratio, n = float(impact.impulse[0] / impact.impulse[1]), walker.robot.n_q
    if impact.mode.slips:
        # A slipping impulse always lies on the cone; it is near the edge when the foot is left almost at rest.
        if not abs(stride.following[n]) <= nearness * np.max(np.abs(impact.v_plus)):
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
        taken = walker.stride(beside)
        if taken.following is None:
            return ()
        matrix = linearisation.derivative(beside, taken, impact=outcome) @ section.tangent(z)
        sides.append(matrix[section.places])
    return tuple(sides)
