"""Multipliers of an optimised planar gait, in open loop or under a law."""

from gaitopt.arguments import check_arguments
from gaitopt.control.law_kinks import require_derivative, require_finite_torques
from gaitopt.control.planar_laws.planar_feedback import planar_feedforward
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.errors import NoGaitError
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_engine import REFERENCE, PlanarEngine
from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle, find_cycle_from

PLANNED = 1e-6
"""Largest change of the state over a period of an optimised gait, as in its verification."""

NEAR = 0.01
"""Largest relative difference of the period from the planned one."""


@check_arguments
def assess_planar(gait: PlanarGait, law: PlanarLaw | None = None, *, engine: PlanarEngine = REFERENCE) -> PlanarCycle:
    """Return the periodic gait of the controlled robot near an optimised gait, with its exact multipliers.

    Parameters
    ----------
    gait : PlanarGait
    law : PlanarLaw, optional
        By default the gait's torques in open loop, with a clock that is reset at the section.
    engine : PlanarEngine
        By default the reference engine.

    Returns
    -------
    PlanarCycle
        Its state may differ slightly from the plan's, and so may its sequence: a foot whose force vanishes at lift-off
        may slip for an instant before.

    Raises
    ------
    InputError
        If the gait is not a solution, no periodic gait is found near it, or the law has a kink along the plan.

    Examples
    --------
    >>> from gaitopt.model import compass_with_two_feet
    >>> from gaitopt.ocp import Collocation, PlanarLimits, PlanarProblem, solve_planar
    >>> gait = solve_planar(PlanarProblem(
    ...     robot=compass_with_two_feet(), sequence="foot A stick |", friction=1.0, speed=0.633, step_length=0.4713,
    ...     objective="torque_squared", limits=PlanarLimits(torque={"ankle B": 0}),
    ...     transcription=Collocation(intervals=10)))
    >>> round(assess_planar(gait).radius, 2)
    0.68
    """
    law = planar_feedforward(gait) if law is None else law
    automaton = PlanarAutomaton(gait.robot, gait.robot.resolve(gait.motion.parameters), law, engine=engine)
    require_finite_torques(gait, law)
    require_derivative(gait, law)
    first = gait.motion.segments[0]
    cycle = find_cycle_from(automaton, first.q[:, 0].copy(), first.v[:, 0].copy(), law.section, tolerance=PLANNED)
    if cycle is None or abs(cycle.period - gait.period) > NEAR * gait.period:
        raise NoGaitError(
            f"No periodic gait of {gait.robot.name!r} under the law {law.name!r} was found near the planned one; check "
            "the gait with verify_planar. If the trailing foot receives no impulse at the landing, such a gait may not "
            "exist: plan the gait with PlanarLimits(impulse=...) above 0."
        )
    return cycle
