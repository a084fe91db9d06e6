"""Scenarios: differences from the plan that a gait must survive, such as another friction coefficient and a push."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import field
from typing import Any

import attrs
import numpy as np

from gaitopt.arguments import check_arguments, check_record
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.ocp.problem import GaitProblem
from gaitopt.parameters import number_within, positive, whole_number

ROUNDING = 1e-9
"""Relative difference up to which a nominal value counts as an end of its range."""


@check_record
@dataclass(frozen=True)
class Scenario:
    """One difference from a plan.

    Attributes
    ----------
    parameters : dict of str to float
        Values of robot and ground that differ from those of the plan (SI units).
    push : int or None
        Number of the push in the seeded sequence of pushes of the ball; None without a push.

    Examples
    --------
    >>> Scenario({"friction": 0.1}).push is None
    True
    """

    parameters: dict[str, float] = field(default_factory=dict)
    push: int | None = None

    def __str__(self) -> str:
        parts = [f"{name} {value:.4g}" for name, value in self.parameters.items()]
        parts += [] if self.push is None else [f"push no. {self.push + 1}"]
        return ", ".join(parts) or "the plan without changes"


def _check_ranges(_: Any, attribute: Any, ranges: Mapping[str, tuple[float, float]]) -> None:
    for name, pair in ranges.items():
        if len(pair) != 2 or not all(map(math.isfinite, pair)) or not pair[0] < pair[1]:
            raise InputError(f"ranges of {name} must be a pair (lower, upper) with lower < upper, got {pair!r}.")


@check_arguments
@attrs.frozen(kw_only=True)
class Scenarios:
    """Ranges of parameters and a ball of pushes, for all of which a gait must remain close to its plan.

    A gait survives a scenario if the walk, which begins in the planned state after touchdown plus the push, is within
    `tolerance` of that state after `steps` steps.

    Attributes
    ----------
    ranges : mapping of str to (float, float)
        Ranges of ``friction``, ``slope`` [rad] or parameters of the robot, by name; each contains the nominal value of
        the problem.
    push : float [rad/s]
        Radius of the ball of pushes, as in :class:`gaitopt.stability.Recovery`; 0 without pushes.
    steps : int
    tolerance : float
        Largest difference of the last state from the planned one (rad, rad/s, m/s).
    values : int
        Number of values of each range among which the worst scenario is sought, both ends included.
    pushes : int
        Number of pushes with which each of these is combined.
    seed : int
        Seed of the pushes.

    Raises
    ------
    InputError
        If a range or a number is invalid.

    Examples
    --------
    >>> scenarios = Scenarios(ranges={"friction": (0.1, 0.2)}, values=2)
    >>> [scenario.parameters["friction"] for scenario in scenarios.candidates()]
    [0.1, 0.2]
    """

    ranges: Mapping[str, tuple[float, float]] = attrs.field(factory=dict, validator=_check_ranges)
    push: float = attrs.field(default=0.0, validator=number_within("rad/s", lower=0.0))
    steps: int = attrs.field(default=20, validator=whole_number())
    tolerance: float = attrs.field(default=1e-4, validator=positive())
    values: int = attrs.field(default=5, validator=whole_number(2))
    pushes: int = attrs.field(default=2, validator=whole_number())
    seed: int = attrs.field(default=0, validator=whole_number(0))

    def candidates(self) -> list[Scenario]:
        """Return the scenarios among which the worst one is sought: a grid over the ranges, each with some pushes."""
        axes = [np.linspace(*pair, self.values).tolist() for pair in self.ranges.values()]
        pushes = [None, *range(self.pushes)] if self.push else [None]
        grid = [dict(zip(self.ranges, values, strict=True)) for values in itertools.product(*axes)]
        return [Scenario(parameters, push) for parameters in grid for push in pushes]

    def draw(self, count: int, seed: int, *, pushed: bool) -> list[Scenario]:
        """Return random scenarios, uniform in the ranges, each with a different push or all without one."""
        rng = np.random.default_rng(seed)
        drawn = []
        for number in range(count):
            parameters = {name: float(rng.uniform(*pair)) for name, pair in self.ranges.items()}
            drawn.append(Scenario(parameters, number if pushed else None))
        return drawn

    def check_problem(self, problem: GaitProblem) -> None:
        """Raise InputError unless every range belongs to a parameter of the problem and contains its nominal value."""
        for name, (lower, upper) in self.ranges.items():
            if name not in problem.values:
                raise InputError(f"Scenarios: there is no parameter {name!r}. {suggest(name, problem.values)}")
            nominal, rounding = problem.values[name], ROUNDING * max(abs(lower), abs(upper))
            if name not in problem.free and not lower - rounding <= nominal <= upper + rounding:
                raise InputError(
                    f"Scenarios: the range of {name} must contain the nominal value of the problem, {nominal:g}, got "
                    f"({lower:g}, {upper:g}): extend the range, or change {name} of the problem."
                )
