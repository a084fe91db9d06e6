"""The engine of commands with many walks, and advice on a faster one."""

import time
from typing import TYPE_CHECKING, Any, cast

from gaitopt.cli.output import err

if TYPE_CHECKING:
    from gaitopt.motion.planar_gait import AnyGait
    from gaitopt.simulation.engine import Engine
    from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine

SLOW = 3.0
"""Processor time of the assessment of a gait after which a faster engine is advised [s]."""


def engine_for_walks(gait: "AnyGait", law: Any, name: str, *, hidden: bool) -> "Engine | PlanarEngine | None":
    """Return the engine of many walks of a gait by name; None for the usual one of a robot with one foot on the ground.

    For robots with several contacts, ``"auto"`` is heyoka if the feedback of the law is stiff, which is printed unless
    it is hidden.

    Parameters
    ----------
    gait : Gait or PlanarGait
    law : Law, PlanarLaw or None
        None if the law is not known yet.
    name : str
    hidden : bool
    """
    from gaitopt.motion.planar_gait import PlanarGait
    from gaitopt.simulation.engine_choice import engine_for

    if name != "auto" or not isinstance(gait, PlanarGait) or law is None:
        return engine_for(gait.robot, name)
    from gaitopt.simulation.stiff_feedback import planar_engine_for_walks

    engine = planar_engine_for_walks(gait, law)
    if engine.name == "heyoka" and not hidden:
        err.print(
            "The feedback is stiff: the heyoka engine simulates the walks, after a compilation that may take from "
            "some seconds to some minutes (--engine scipy selects the other engine).",
            soft_wrap=True,
        )
    return engine


class EngineAdvice:
    """Advice after the assessment of a gait, if that was slow.

    Parameters
    ----------
    hidden : bool
        Whether nothing is printed.

    Examples
    --------
    >>> from gaitopt.simulation import planar_engine_named
    >>> EngineAdvice(hidden=False).give(planar_engine_named("scipy"))
    """

    def __init__(self, *, hidden: bool) -> None:
        self._hidden, self._began = hidden, time.process_time()

    def give(self, engine: "Engine | PlanarEngine") -> None:
        """Print how walks with an engine become faster, if the time since this object was made is long."""
        from gaitopt.simulation.engine_choice import faster_planar_walks, faster_walks

        if self._hidden or time.process_time() - self._began < SLOW:
            return
        planar = hasattr(engine, "begin")
        advice = faster_planar_walks(cast("PlanarEngine", engine)) if planar else faster_walks(cast("Engine", engine))
        if advice:
            err.print(advice, soft_wrap=True)
