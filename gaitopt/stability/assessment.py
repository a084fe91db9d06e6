"""assess_stability: the Floquet multipliers of an optimised gait under a law."""

from typing import TYPE_CHECKING, overload

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law, check_law, feedforward
from gaitopt.control.law_kinks import require_derivative, require_finite_torques
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.errors import InputError, NoGaitError
from gaitopt.motion.gait import Gait, check_gait
from gaitopt.motion.planar_gait import AnyGait, PlanarGait
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import choose_engine, choose_planar_engine
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.cycle_search import find_cycle
from gaitopt.stability.section import Section

if TYPE_CHECKING:  # the simulation of robots with several contacts imports scipy
    from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine
    from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle


@overload
def assess_stability(gait: Gait, law: Law | None = None, *, engine: "Engine | PlanarEngine | None" = None) -> Cycle: ...
@overload
def assess_stability(
    gait: PlanarGait, law: PlanarLaw | None = None, *, engine: "Engine | PlanarEngine | None" = None
) -> "PlanarCycle": ...
@overload
def assess_stability(
    gait: AnyGait, law: Law | PlanarLaw | None = None, *, engine: "Engine | PlanarEngine | None" = None
) -> "Cycle | PlanarCycle": ...
@check_arguments
def assess_stability(
    gait: AnyGait, law: Law | PlanarLaw | None = None, *, engine: "Engine | PlanarEngine | None" = None
) -> "Cycle | PlanarCycle":
    """Return the periodic gait of the controlled walker near an optimised gait, with its exact Floquet multipliers.

    Parameters
    ----------
    gait : Gait or PlanarGait
    law : Law or PlanarLaw, optional
        By default the gait's torques in open loop, with a clock reset at touchdown.
    engine : Engine or PlanarEngine, optional
        By default the fastest installed engine that supports the law; for robots with several contacts, scipy.  A gait
        is assessed with the engine of the same name if the engine is one of other robots.

    Returns
    -------
    Cycle or PlanarCycle
        Its state may differ slightly from the plan's.

    Raises
    ------
    InputError
        If the gait is not a solution, its robot is not known, no periodic gait is found near it, or the law has a
        kink along the plan.

    Examples
    --------
    >>> from gaitopt import load
    >>> cycle = assess_stability(load("docs/examples/compass_slip.h5"))
    >>> cycle.stable, round(cycle.radius, 2)
    (True, 0.63)
    """
    if isinstance(gait, PlanarGait):
        if isinstance(law, Law):
            raise InputError(f"A gait of a robot with several contacts needs a PlanarLaw, got the Law {law.name!r}.")
        from gaitopt.stability.planar_gaits.planar_assessment import assess_planar

        return assess_planar(gait, law, engine=choose_planar_engine(engine))
    if isinstance(law, PlanarLaw):
        raise InputError(f"A gait with one foot on the ground needs a Law, got the PlanarLaw {law.name!r}.")
    check_gait(gait)
    gait.require()
    robot = gait.robot
    law = feedforward(robot, gait.motion) if law is None else law
    check_law(law)
    chosen = choose_engine(engine, law, robot)
    walker = make_walker(robot, law, gait.motion.parameters, period=gait.period, engine=chosen)
    require_derivative(gait, law)
    first = gait.motion.segments[0]
    state = np.concatenate([first.q[:, 0], first.v[:, 0]])
    cycle = find_cycle(walker, Section(robot, walker.p, sliding=True).project(state))
    if cycle is None:
        require_finite_torques(gait, law)
        raise NoGaitError(
            f"No periodic gait of the walker under the law {walker.law.name!r} was found near the planned one; "
            f"check the gait with verify, or use a law that stabilises it."
        )
    return cycle
