"""Gaits of a solved family."""

from typing import Any

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.motion.gait import Gait
from gaitopt.motion.summary import plain
from gaitopt.status import Status


@check_arguments
@dataclass(frozen=True, eq=False, kw_only=True)
class FamilyGaits:
    """Gaits that share parameters of their walker.

    Attributes
    ----------
    gaits : tuple of Gait
        In the order of the problems, with the shared parameters.
    design : dict of str to float
        The shared parameters (SI units).
    weights : tuple of float
        Weights of the objectives, of sum 1.
    objective : float
        Weighted sum of the objectives, or the largest weighted objective.
    status : Status
    message : str
    iterations : int
        Number of iterations of the NLP of all gaits.
    solve_seconds : float

    Examples
    --------
    >>> from gaitopt import Status, load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> result = FamilyGaits(
    ...     gaits=(gait,), design={"hip_mass": 2.0}, weights=(1.0,), objective=gait.solver.objective,
    ...     status=Status.SOLVED, message="converged", iterations=0, solve_seconds=0.0,
    ... )
    >>> result.summarise()["design"], len(result.costs)
    ({'hip_mass': 2.0}, 1)
    """

    gaits: tuple[Gait, ...]
    design: dict[str, float]
    weights: tuple[float, ...]
    objective: float
    status: Status
    message: str
    iterations: int
    solve_seconds: float

    def __repr__(self) -> str:
        design = "".join(f"{name}={value:.6g}, " for name, value in self.design.items())
        return f"FamilyGaits({len(self.gaits)} gaits, {design}objective {self.objective:.6g}, {self.status.key})"

    @property
    def costs(self) -> tuple[float, ...]:
        """Objective of each gait."""
        return tuple(gait.solver.objective for gait in self.gaits)

    def summarise(self) -> dict[str, Any]:
        """Return the results of the family as plain data for JSON."""
        facts: dict[str, Any] = plain(
            {
                "status": self.status.key,
                "hint": self.status.hint,
                "message": self.message,
                "design": self.design,
                "objective": self.objective,
                "iterations": self.iterations,
                "solve_seconds": self.solve_seconds,
                "gaits": [
                    {
                        "name": gait.problem["name"],
                        "status": gait.status.key,
                        "sequence": str(gait.sequence),
                        "weight": weight,
                        "objective": gait.solver.objective,
                        "speed": gait.speed,
                        "step_length": gait.step_length,
                        "friction": gait.motion.parameters["friction"],
                        "slope": gait.motion.parameters["slope"],
                    }
                    for gait, weight in zip(self.gaits, self.weights, strict=True)
                ],
            }
        )
        return facts
