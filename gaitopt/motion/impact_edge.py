"""Sticking impacts at the edge of the friction cone, which small disturbances change into slipping ones."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.gait import Gait

if TYPE_CHECKING:
    from gaitopt.motion.planar_gait import PlanarGait

EDGE = 2e-3
"""Largest distance of an impulse ratio from the friction, relative to it, at which an impact is at the edge: twice the
default margin."""

LEAST_IMPULSE = 1e-6
"""Normal impulse below which the ratio is not determined [N s]."""

ADVISED = 0.1
"""Margin that is advised; the cost of the gait increases with it."""


@dataclass(frozen=True)
class ImpactEdge:
    """A sticking impact at the edge of the friction cone.

    Attributes
    ----------
    contacts : str
        Landing contacts of one body.
    ratio, friction : float
        Absolute ratio of the impulses, and its limit.
    """

    contacts: str
    ratio: float
    friction: float

    @property
    def margin(self) -> float:
        """Distance of the ratio from the friction, relative to it."""
        return 1 - self.ratio / self.friction

    def __str__(self) -> str:
        return (
            f"the sticking impact of {self.contacts} is at the edge of the friction cone: its impulse ratio of "
            f"{self.ratio:.4g} is only {100 * max(self.margin, 0.0):.2g} % below the friction of {self.friction:.4g}, "
            "so that small disturbances make it slip, and feedback may not stabilise the gait. For a gait with a "
            f"margin, solve with Margins(impact_cone={ADVISED:g})."
        )


def find_impact_edges(gait: "Gait | PlanarGait") -> list[ImpactEdge]:
    """Return the sticking impacts of a solved gait at the edge of the friction cone.

    Examples
    --------
    >>> from gaitopt import load
    >>> find_impact_edges(load("docs/examples/compass_slip.h5"))  # its impact slips
    []
    """
    if not gait.status.ok:
        return []
    impacts = _list_impacts(gait) if isinstance(gait, Gait) else _list_planar_impacts(gait)
    friction = gait.motion.parameters["friction"]
    edges = [ImpactEdge(name, abs(t) / n, friction) for name, t, n in impacts if n > LEAST_IMPULSE]
    # A custom law may permit more.
    return [edge for edge in edges if 0 < friction < np.inf and abs(edge.margin) <= EDGE]


def _list_impacts(gait: Gait) -> Iterator[tuple[str, float, float]]:
    """Yield the landing foot of each sticking impact, and its impulses."""
    for jump in gait.motion.jumps:
        if jump.mode is Mode.STICK:
            yield "the foot", float(jump.impulse[0]), float(jump.impulse[1])


def _list_planar_impacts(gait: "PlanarGait") -> Iterator[tuple[str, float, float]]:
    """Yield the contacts of each body that sticks after an impact, and the sum of their impulses."""
    entries = gait.motion.contact_entries
    for event in gait.motion.events:
        modes, bodies = (event.outcome or event.after).modes, dict[str, list[int]]()
        for i, entry in enumerate(entries):
            if event.is_impact and entry.slides and modes[i][1] is Mode.STICK:
                bodies.setdefault(entry.body, []).append(i)
        for members in bodies.values():
            tangential, normal = event.impulse[members].sum(axis=0)
            names = [entries[i].name for i in members if event.impulse[i, 1] > LEAST_IMPULSE]
            yield " + ".join(names), float(tangential), float(normal)
