"""Results of feedback tuning."""

import textwrap
from collections.abc import Mapping
from dataclasses import field
from typing import Any

from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.dataclass import dataclass
from gaitopt.motion.printable import format_count
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
from gaitopt.stability.recovery import NEGLIGIBLE_PUSH, Recovery
from gaitopt.tuning.controller_family import FamilySettings

AT_BOUND = 1e-3
"""Distance from a bound, relative to the range of a gain, at which the gain is at its bound."""


@dataclass(frozen=True)
class Trial:
    """One evaluation of a search for gains.

    Attributes
    ----------
    gains : dict of str to float
    objective : float
        Objective at the worst friction.

    Examples
    --------
    >>> Trial({"hip_stiffness": 20.0}, 0.4).objective
    0.4
    """

    gains: dict[str, float]
    objective: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Tuning:
    """A tuned law with the record of its search.

    Attributes
    ----------
    law : Law, PlanarLaw or None
        None if no trial gave a law, for example because a Riccati equation has no solution.
    family : str
        Name of the controller family.
    gains : dict of str to float
    objective : str
    radius_before : float
        Spectral radius in open loop; inf if the open loop has no periodic gait near the plan.
    radius_after : float
        Spectral radius with the tuned law, also if it is not below 1; inf if no trial has a periodic gait near the
        plan.
    cycle : Cycle, PlanarCycle or None
        The periodic gait of the walker under the tuned law.
    fixed_point_shift : float
        Largest difference of the state after touchdown of the periodic gait from the planned one; nan without a gait.
    verified : Recovery
        Recovery from random states in the nonlinear simulator.
    trials : tuple of Trial
        Evaluations of the search in order.
    evaluations : int
    seconds : float
        Duration of the search.
    settings : FamilySettings
        Torque limit and fixed gains of the law.
    planned_sequence : str
        Contact sequence of the gait.
    bounds : mapping of str to (float, float)
        Bounds of the search for each tuned gain.
    search_interrupted : bool
        Whether Ctrl-C ended the search; the gains are then the best ones so far and are not verified.
    actuator_units : mapping of str to str
        Unit of the torque or force of each actuator.
    gait : mapping
        Quantities that identify the gait, such as its speed.

    Examples
    --------
    Created by :func:`gaitopt.tune_feedback`:

    >>> "radius_after" in Tuning.__dataclass_fields__
    True
    """

    law: Law | PlanarLaw | None
    family: str
    gains: dict[str, float]
    objective: str
    radius_before: float
    radius_after: float
    cycle: Cycle | PlanarCycle | None
    fixed_point_shift: float
    verified: Recovery
    trials: tuple[Trial, ...] = field(repr=False)
    evaluations: int
    seconds: float
    settings: FamilySettings = field(default=FamilySettings(), repr=False)
    planned_sequence: str = field(default="", repr=False)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict, repr=False)
    search_interrupted: bool = field(default=False, repr=False)
    actuator_units: Mapping[str, str] = field(default_factory=dict, repr=False)
    gait: Mapping[str, Any] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        gains = textwrap.shorten(", ".join(f"{name}={gain:.4g}" for name, gain in self.gains.items()), 120)
        radii = f"spectral radius {self.radius_before:.4g} to {self.radius_after:.4g}"
        push = f"recovers from {self.verified.radius:.3g} rad/s"
        return f"Tuning({self.family!r}, {radii}, {push}, {gains}, {format_count(self.evaluations, 'evaluation')})"

    @property
    def stable(self) -> bool:
        """Whether the law stabilises the gait."""
        return self.radius_after < 1

    @property
    def at_bounds(self) -> dict[str, str]:
        """Gains at a bound of the search, with ``"lower"`` or ``"upper"``: wider bounds may improve the law."""
        sides = {}
        for name, (lower, upper) in self.bounds.items():
            value, margin = self.gains[name], AT_BOUND * (upper - lower)
            if value <= lower + margin or value >= upper - margin:
                sides[name] = "lower" if value <= lower + margin else "upper"
        return sides

    @property
    def worse_than_open_loop(self) -> bool:
        """Whether the spectral radius under the law is larger than in open loop."""
        return self.radius_after > self.radius_before

    @property
    def sequence(self) -> str:
        """Contact sequence of the periodic gait under the law; empty without a gait."""
        return "" if self.cycle is None else self.cycle.sequence

    @property
    def changes_sequence(self) -> bool:
        """Whether the walker under the law has another contact sequence than the planned gait."""
        return self.cycle is not None and self.sequence != self.planned_sequence

    @property
    def hardly_recovers(self) -> bool:
        """Whether a law stabilises the gait, but all walks of the verification return after negligible pushes only.

        `verified.failure` states whether walks after larger pushes end, leave the gait, or need more steps.
        """
        is_verified = bool(self.verified.starts) and not (self.search_interrupted or self.verified.interrupted)
        return self.stable and is_verified and self.verified.radius < NEGLIGIBLE_PUSH

    @property
    def multipliers(self) -> tuple[complex, ...]:
        """Multipliers of the gait under the tuned law; empty without a gait."""
        return () if self.cycle is None else tuple(self.cycle.multipliers.tolist())
