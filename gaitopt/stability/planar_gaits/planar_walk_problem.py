"""Walking problems of planar robots with any contacts: periodic gaits that are computed, not optimised."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any, Self

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.planar_laws.planar_feedback import planar_feedforward
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.planar.undeclared_travel import state_undeclared_travel
from gaitopt.model.robot_formulation import formulate_planar_robot
from gaitopt.model.robot_type import check_robot_type
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.simulation.planar_simulation.placement import place_planar

if TYPE_CHECKING:
    from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine
    from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle

INDEPENDENT = 1e-6
"""Singular value below which an entry of the state depends on others."""

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
        At construction, if a name or a parameter is invalid, or the robot fails its check.

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
        from gaitopt.simulation.planar_simulation.planar_simulator import check_event  # which imports scipy

        require_planar(self.robot, self.parameters)
        if undeclared := state_undeclared_travel(self.robot, self.parameters):
            raise InputError(f"{undeclared}.")
        check_event(self.robot, self.section)
        for what, names, known in (
            ("coordinates: there is no coordinate", self.coordinates, self.robot.coordinates),
            ("rates: there is no coordinate", self.rates, self.robot.coordinates),
            ("on: there is no contact", self.on, self.robot.contact_names),
        ):
            for name in names:
                if name not in known:
                    raise InputError(f"{what} {name!r} of {self.robot.name!r}. {suggest(name, known)}")

    @classmethod
    def from_gait(cls, gait: PlanarGait, law: PlanarLaw | None = None) -> Self:
        """Return the walk of an optimal gait, under a law or with its planned torques, near the planned state.

        Parameters
        ----------
        gait : PlanarGait
            Gait that ends with an impact.
        law : PlanarLaw, optional
            By default the torques of the gait in open loop, with a clock that is reset at the section.

        Raises
        ------
        InputError
            If the gait is not a solution, or does not end with an impact.

        Examples
        --------
        >>> from gaitopt import load
        >>> walk = PlanarWalkProblem.from_gait(load("docs/examples/heel_toe.h5"))
        >>> walk.section, walk.on, sorted(walk.coordinates)
        ('heel b closes', ('heel a',), ['a', 'b', 'x'])
        """
        robot, first, law = gait.require().robot, gait.motion.segments[0], law or planar_feedforward(gait)
        on = tuple(name for name, mode in first.state.modes if mode is not Mode.FREE and not mode.slips)
        q, v, closed = first.q[:, 0], first.v[:, 0], [robot.contact_index(name) for name in on]
        rows = [np.array(part)[closed] for part in robot.rows(q, v, robot.vector(gait.motion.parameters))[:2]]
        values = [
            {robot.coordinates[i]: float(values[i]) for i in _choose_independent(constrained, robot.units)}
            for values, constrained in ((q, rows[0]), (v, np.vstack(rows)))
        ]
        return cls(
            robot=robot,
            section=law.section,
            coordinates=values[0],
            rates=values[1],
            on=on,
            parameters=gait.motion.parameters,
            torque=law,
            name=robot.name,
        )

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

    def explain_failure(self, engine: "PlanarEngine | None" = None) -> str:
        """Return a sentence that states why no gait is found from the given state.

        Parameters
        ----------
        engine : PlanarEngine, optional
            By default the reference engine.
        """
        try:
            cycle = self._converge(self.coordinates, self.rates, engine)
        except InputError as error:
            return str(error)
        if cycle is None:
            return "From the given state, Newton's method does not converge to a periodic gait."
        return f"The gait that is found from the given state has the sequence {cycle.sequence!r}."

    def _find(
        self, coordinates: Mapping[str, float], rates: Mapping[str, float], engine: "PlanarEngine | None"
    ) -> "PlanarCycle | None":
        """Return the gait to which Newton's method converges from a start, or None."""
        try:
            return self._converge(coordinates, rates, engine)
        except InputError:  # the robot falls, or does not stand on its contacts
            return None

    def _converge(
        self, coordinates: Mapping[str, float], rates: Mapping[str, float], engine: "PlanarEngine | None"
    ) -> "PlanarCycle | None":
        """Return the gait near a start, or None; InputError if the motion does not begin, or not reach its end."""
        from gaitopt.stability.planar_gaits.planar_cycle import find_planar_cycle

        q, v = place_planar(self.robot, coordinates, rates, self.parameters, on=self.on)
        options: dict[str, Any] = {"section": self.section, "torque": self.torque}
        options |= {} if engine is None else {"engine": engine}
        return find_planar_cycle(self.robot, q, v, self.parameters, **options)

    def _are_same(self, one: "PlanarCycle", other: "PlanarCycle") -> bool:
        """Return whether two gaits have the same state, apart from the place along the ground."""
        names = [name for name in one.state if name != self.robot.travel]
        return all(abs(one.state[name] - other.state[name]) <= SAME for name in names)


def _choose_independent(rows: Array, units: Sequence[str]) -> list[int]:
    """Return entries that determine all others by constraints of these rows, angles first."""
    chosen, rank = list[int](), int(np.linalg.matrix_rank(rows, tol=INDEPENDENT)) if rows.size else 0
    for i in sorted(range(len(units)), key=lambda i: units[i] != "rad"):
        larger = np.vstack([rows, np.eye(1, len(units), i)])
        if int(np.linalg.matrix_rank(larger, tol=INDEPENDENT)) > rank:
            chosen, rows, rank = [*chosen, i], larger, rank + 1
    return chosen


def _perturb(values: Mapping[str, float], spread: float, rng: np.random.Generator) -> dict[str, float]:
    """Return values with random relative changes; a zero stays zero, and equal sizes stay equal."""
    factors = {size: 1 + spread * rng.normal() for size in dict.fromkeys(abs(value) for value in values.values())}
    return {name: value * factors[abs(value)] for name, value in values.items()}
