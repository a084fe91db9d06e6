"""Advice on a faster engine, printed by commands whose walks are slow."""

import time
from typing import TYPE_CHECKING, cast

from gaitopt.cli.output import err

if TYPE_CHECKING:
    from gaitopt.simulation.engine import Engine
    from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine

SLOW = 3.0
"""Processor time of the assessment of a gait after which a faster engine is advised [s]."""


class EngineAdvice:
    """Advice after the assessment of a gait, if that was slow.

    Parameters
    ----------
    hidden : bool
        Whether nothing is printed.

    Examples
    --------
    >>> from gaitopt.simulation import planar_engine_named
    >>> EngineAdvice(hidden=False).give(planar_engine_named("scipy"))  # at once: nothing is printed
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
