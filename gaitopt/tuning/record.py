"""What tuning found, and how."""

import textwrap
from dataclasses import dataclass, field

from gaitopt.control.law import Law
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.recovery import Recovery


@dataclass(frozen=True)
class Trial:
    """One evaluation of a search.

    Attributes
    ----------
    gains : dict of str to float
    objective : float
        At the worst friction.

    Examples
    --------
    >>> Trial({"hip_stiffness": 20.0}, 0.4).objective
    0.4
    """

    gains: dict[str, float]
    objective: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Tuning:
    """A tuned law and how it was found.

    Attributes
    ----------
    law : Law or None
        None where none of the gains tried make one, as when a Riccati equation has no solution.
    design : str
    gains : dict of str to float
    objective : str
    radius_before : float
        Spectral radius in open loop; inf where the open loop has no periodic gait near the plan.
    radius_after : float
        Spectral radius with the tuned law, the best found even if it is not below 1; inf where no gains tried leave a
        periodic gait near the plan.
    cycle : Cycle or None
        The periodic gait of the walker under the tuned law.
    fixed_point_shift : float
        Largest difference of its state after touchdown from the planned one; nan where there is none.
    verified : Recovery
        From which starts walks return in the nonlinear simulator.
    trials : tuple of Trial
        The search, in order.
    evaluations : int
    seconds : float
        Of the search.

    Examples
    --------
    Made by :func:`gaitopt.tune_feedback`:

    >>> "radius_after" in Tuning.__dataclass_fields__
    True
    """

    law: Law | None
    design: str
    gains: dict[str, float]
    objective: str
    radius_before: float
    radius_after: float
    cycle: Cycle | None
    fixed_point_shift: float
    verified: Recovery
    trials: tuple[Trial, ...] = field(repr=False)
    evaluations: int
    seconds: float

    def __repr__(self) -> str:
        gains = textwrap.shorten(", ".join(f"{name}={gain:.4g}" for name, gain in self.gains.items()), 120)
        radii = f"spectral radius {self.radius_before:.4g} to {self.radius_after:.4g}"
        push = f"recovers from {self.verified.radius:.3g} rad/s"
        return f"Tuning({self.design!r}, {radii}, {push}, {gains}, {self.evaluations} evaluations)"

    @property
    def stable(self) -> bool:
        """Whether the gait is held; if not, the best that was found is reported."""
        return self.radius_after < 1
