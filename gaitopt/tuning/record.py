"""Results of tuning."""

import textwrap
from dataclasses import dataclass, field

from gaitopt.control.law import Law
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.recovery import Recovery
from gaitopt.tuning.controller_family import DesignSettings


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
        None if none of the gains tried make one, for example because a Riccati equation has no solution.
    design : str
    gains : dict of str to float
    objective : str
    radius_before : float
        Spectral radius in open loop; inf if the open loop has no periodic gait near the plan.
    radius_after : float
        Spectral radius with the tuned law, the best found even if it is not below 1; inf if there is no periodic gait
        near the plan for any gains tried.
    cycle : Cycle or None
        The periodic gait of the walker under the tuned law.
    fixed_point_shift : float
        Largest difference of its state after touchdown from the planned one; nan if there is none.
    verified : Recovery
        Random states from which walks return to the gait in the nonlinear simulator.
    trials : tuple of Trial
        The search, in order.
    evaluations : int
    seconds : float
        Duration of the search.
    settings : DesignSettings
        Torque limit and fixed gains of the law.

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
    settings: DesignSettings = field(default=DesignSettings(), repr=False)

    def __repr__(self) -> str:
        gains = textwrap.shorten(", ".join(f"{name}={gain:.4g}" for name, gain in self.gains.items()), 120)
        radii = f"spectral radius {self.radius_before:.4g} to {self.radius_after:.4g}"
        push = f"recovers from {self.verified.radius:.3g} rad/s"
        return f"Tuning({self.design!r}, {radii}, {push}, {gains}, {self.evaluations} evaluations)"

    @property
    def stable(self) -> bool:
        """Whether the law stabilises the gait; if not, the best result is reported."""
        return self.radius_after < 1
