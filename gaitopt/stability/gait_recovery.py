"""Recovery of a saved gait from pushes under a law."""

from typing import TYPE_CHECKING

from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.errors import InputError
from gaitopt.motion.gait import Gait
from gaitopt.motion.planar_gait import AnyGait, PlanarGait
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import choose_engine, choose_planar_engine
from gaitopt.simulation.hybrid_automaton import Walker, make_walker
from gaitopt.stability.assessment import assess_stability
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.recovery import PushTest, Recovery, measure_recovery

if TYPE_CHECKING:  # the simulation of robots with several contacts imports scipy
    from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine
    from gaitopt.simulation.planar_simulation.planar_walker import PlanarWalker
    from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle


def measure_gait_recovery(
    gait: AnyGait,
    law: Law | PlanarLaw,
    radius: float,
    test: PushTest | None = None,
    engine: "Engine | PlanarEngine | None" = None,
) -> Recovery | None:
    """Return the recovery of a gait from a ball of pushes under a law, or None without a periodic gait.

    Parameters
    ----------
    gait : Gait or PlanarGait
    law : Law or PlanarLaw
    radius : float [rad/s]
        Radius of the ball of pushes.
    test : PushTest, optional
    engine : Engine or PlanarEngine, optional
        As in :func:`gaitopt.assess_stability`.

    Examples
    --------
    >>> from gaitopt import feedforward, load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> measure_gait_recovery(gait, feedforward(gait.robot, gait.motion), 0.01, PushTest(starts=2)).returned
    2
    """
    _check_law(gait, law)
    try:
        cycle = assess_stability(gait, law, engine=engine)
    except InputError:
        return None
    return measure_recovery(walker_near(gait, law, cycle, engine), cycle, radius, test)


def walker_near(
    gait: AnyGait, law: Law | PlanarLaw, cycle: "Cycle | PlanarCycle", engine: "Engine | PlanarEngine | None" = None
) -> "Walker | PlanarWalker":
    """Return the walker of a gait's robot under a law, which walks near a periodic gait."""
    if isinstance(gait, PlanarGait) and not isinstance(cycle, Cycle) and isinstance(law, PlanarLaw):
        from gaitopt.simulation.planar_simulation.planar_walker import PlanarWalker

        chosen, section = choose_planar_engine(engine), cycle.section
        return PlanarWalker(gait.robot, law, cycle.parameters, section=section, period=cycle.period, engine=chosen)
    if isinstance(gait, Gait) and isinstance(law, Law):
        used = choose_engine(engine, law, gait.robot)
        return make_walker(gait.robot, law, cycle.parameters, period=gait.period, engine=used)
    raise InputError(f"The law {law.name!r} does not belong to the gait of robot {gait.robot_name!r}.")


def _check_law(gait: AnyGait, law: Law | PlanarLaw) -> None:
    """Raise InputError if a law is that of the other kind of robots."""
    if isinstance(gait, PlanarGait) is not isinstance(law, PlanarLaw):
        raise InputError(f"The law {law.name!r} does not belong to the gait of robot {gait.robot_name!r}.")
