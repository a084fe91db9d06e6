"""Walking problems of planar robots with any contacts: periodic gaits that are computed, not optimised."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.errors import InputError
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot_formulation import formulate_planar_robot
from gaitopt.model.robot_type import check_robot_type
from gaitopt.simulation.planar_simulation.placement import place_planar

if TYPE_CHECKING:
    from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine
    from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle

SPREAD, SAME = 0.2, 1e-6
"""Relative standard deviation of random starts, and largest difference of the states of one gait."""


@check_arguments
@dataclass(frozen=True, kw_only=True, eq=False)
class PlanarWalkProblem:
    """A planar robot, and a state near which its periodic gaits are sought.

    Attributes
    ----------
    robot : PlanarRobot
    section : str
        Event right after which a gait is periodic, such as ``"foot B closes"``.
    coordinates, rates : mapping of str to float
        Start of the search by the names of the coordinates; those not named follow from the contacts `on`.
    on : tuple of str
        Contacts that are closed at the start.
    parameters : mapping of str to float
        Parameters of robot and ground in SI units, slope in rad; those not named keep their defaults.
    torque : Function, PlanarLaw or None
        (t, q, v) -> u, or a law; None for a passive robot.
    sequence : str or None
        Contact sequence of the gaits; None for all gaits.
    name : str
        Name of the problem in messages.

    Raises
    ------
    InputError
        At construction, if a parameter is invalid, or the robot fails its check.

    Examples
    --------
    >>> from gaitopt.model.robots.vertical_hopper import vertical_hopper
    >>> problem = PlanarWalkProblem(
    ...     robot=vertical_hopper(), section="sole closes", coordinates={"body": 0.7, "foot": 0.2}, rates={}, on=()
    ... )
    >>> problem.parameters["body_mass"]
    8.0
    """

    robot: PlanarRobot
    section: str
    coordinates: Mapping[str, float]
    rates: Mapping[str, float]
    on: tuple[str, ...]
    parameters: Mapping[str, float] = field(default_factory=dict)
    torque: ca.Function | PlanarLaw | None = None
    sequence: str | None = None
    name: str = "walk"

    def __post_init__(self) -> None:
        check_robot_type(self.robot, PlanarRobot, "a PlanarRobot such as kneed_walker()", "WalkProblem")
        object.__setattr__(self, "parameters", self.robot.resolve(self.parameters))
        from gaitopt.model.planar.planar_check import require_planar

        require_planar(self.robot, self.parameters)

    def __str__(self) -> str:
        return str(formulate_planar_robot(self.robot, self.parameters))

    def _repr_latex_(self) -> str:
        return formulate_planar_robot(self.robot, self.parameters).latex

    def search(
        self, starts: int = 8, *, seed: int = 0, engine: "PlanarEngine | None" = None
    ) -> "Iterator[PlanarCycle]":
        """Yield the different periodic gaits to which Newton's method converges, from the given state and random ones.

        Parameters
        ----------
        starts : int
            Number of starts.
        seed : int
        engine : PlanarEngine, optional
            By default the reference engine.
        """
        rng = np.random.default_rng(seed)
        known: list[PlanarCycle] = []
        for start in range(starts):
            spread = SPREAD if start else 0.0
            coordinates, rates = (_perturb(values, spread, rng) for values in (self.coordinates, self.rates))
            cycle = self._find(coordinates, rates, engine)
            if (
                cycle is None
                or self.sequence not in (None, cycle.sequence)
                or any(self._are_same(cycle, other) for other in known)
            ):
                continue
            known.append(cycle)
            yield cycle

    def _find(
        self, coordinates: Mapping[str, float], rates: Mapping[str, float], engine: "PlanarEngine | None"
    ) -> "PlanarCycle | None":
        """Return the gait to which Newton's method converges from a start, or None."""
        from gaitopt.stability.planar_gaits.planar_cycle import find_planar_cycle

        try:
            q, v = place_planar(self.robot, coordinates, rates, self.parameters, on=self.on)
            options: dict[str, Any] = {"section": self.section, "torque": self.torque}
            options |= {} if engine is None else {"engine": engine}
            return find_planar_cycle(self.robot, q, v, self.parameters, **options)
        except InputError:  # the robot falls, or does not stand on its contacts
            return None

    def _are_same(self, one: "PlanarCycle", other: "PlanarCycle") -> bool:
        """Return whether two gaits have the same state, apart from the place along the ground."""
        names = [name for name in one.state if name != self.robot.travel]
        return all(abs(one.state[name] - other.state[name]) <= SAME for name in names)


def _perturb(values: Mapping[str, float], spread: float, rng: np.random.Generator) -> dict[str, float]:
    """Return values with random relative changes; a zero stays zero, and equal sizes stay equal."""
    factors = {size: 1 + spread * rng.normal() for size in dict.fromkeys(abs(value) for value in values.values())}
    return {name: value * factors[abs(value)] for name, value in values.items()}
