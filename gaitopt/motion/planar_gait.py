"""PlanarGait: one optimised period of a planar robot with any contacts."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.errors import InputError
from gaitopt.lazy import LazyField, LazyRecord
from gaitopt.motion.energy import Ledger
from gaitopt.motion.gait import SolverReport
from gaitopt.motion.nlp_solution import Solution
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.motion.planar_motion import PlanarMotion
from gaitopt.status import Status

if TYPE_CHECKING:
    from gaitopt.model.planar.planar_robot import PlanarRobot


@dataclass(frozen=True)
class PlanarVerification:
    """Verification of a gait: its torques replayed in the event-driven simulator.

    Attributes
    ----------
    passed : bool
    sequence : str
        Contact sequence of the replay, or of its part until the simulation stopped.
    stop : str
        Reason why the replay ended.
    state_error : float
        Largest difference of the state after the last event from the planned one (SI units).
    period_error : float [s]
    energy_residual : float
        Relative closing error of the replayed energy ledger.
    reasons : tuple of str
        Reasons why it did not pass; empty if it did.
    cost_of_transport : float
        Cost of transport of the replay; nan if it has no phase or no travel.
    cone_margin : float
        Smallest 1 - abs(f_t) / (mu f_n) of the sticking contacts in the replay; nan without any.

    Examples
    --------
    >>> PlanarVerification(True, "foot stick > flight |", "event_reached", 1e-9, 1e-10, 1e-12).passed
    True
    """

    passed: bool
    sequence: str
    stop: str
    state_error: float
    period_error: float
    energy_residual: float
    reasons: tuple[str, ...] = ()
    cost_of_transport: float = float("nan")
    cone_margin: float = float("nan")


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanarGait(LazyRecord):
    """One optimised period of a planar robot with any contacts.

    Attributes
    ----------
    robot : PlanarRobot
    sequence : PhaseSequence
        Planned contact sequence.
    status : Status
        Its ``ok`` states whether the gait is a solution.
    motion : PlanarMotion
        The planned period at nodes and inner points (of a gait that was not solved: the last iterate).
    problem : dict
        The fully resolved problem as plain data.
    solver : SolverReport
        Its `error_between_nodes` is the largest difference of a state at the end of an interval from its integration
        over this interval.
    versions : dict of str to str
    solution : Solution or None
        Unknowns and multipliers of the optimisation.
    verification : PlanarVerification or None
        None until it is replayed.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> from gaitopt.ocp import Collocation, PlanarProblem, solve_planar
    >>> gait = solve_planar(PlanarProblem(
    ...     robot=monopod(), sequence="foot stick > flight |", friction=1.0, speed=1.5, step_length=0.6,
    ...     objective="torque_squared", transcription=Collocation(intervals=(8, 12))))
    >>> gait.status.key, gait.motion.sequence, round(gait.speed, 6)
    ('solved', 'foot stick > flight |', 1.5)
    """

    robot: "PlanarRobot"
    sequence: PhaseSequence
    status: Status
    motion: LazyField[PlanarMotion] = LazyField()
    problem: dict[str, Any]
    solver: SolverReport
    versions: dict[str, str]
    solution: Solution | None = field(default=None, repr=False)
    verification: PlanarVerification | None = None

    def __repr__(self) -> str:
        replay = "not replayed"
        if self.verification is not None:
            replay = "replay passed" if self.verification.passed else "replay failed"
        numbers = f"objective {self.solver.objective:.6g}, {self.speed:.4g} m/s, step {self.step_length:.4g} m"
        return f"PlanarGait({self.robot.name!r}, '{self.sequence}', {self.status.key}, {replay}, {numbers})"

    @property
    def period(self) -> float:
        """Duration of the period [s]."""
        return self.motion.period

    @property
    def step_length(self) -> float:
        """Forward travel in a period [m]; 0 for a robot that does not travel."""
        if self.robot.travel is None:
            return 0.0
        row = self.motion.channel("q")[self.robot.coordinates.index(self.robot.travel)]
        return float(row[-1] - row[0])

    @property
    def speed(self) -> float:
        """Average forward speed [m/s]."""
        return self.step_length / self.period

    @property
    def cost_of_transport(self) -> float:
        """Absolute joint work, summed between samples, over weight times travel; nan without travel."""
        work = sum(float(np.abs(np.diff(segment.work, axis=1)).sum()) for segment in self.motion.segments)
        weight = self.motion.total_mass * self.motion.parameters["gravity"]
        return work / (weight * self.step_length) if self.step_length else float("nan")

    @property
    def energy(self) -> Ledger:
        """Energy ledger of the period [J]."""
        return self.motion.ledger()

    def require(self) -> "PlanarGait":
        """Return the gait itself if it is solved and did not fail its replay; raise InputError otherwise."""
        if not self.status.ok:
            worst = "; ".join(str(reason) for reason in self.solver.violations[:3])
            raise InputError(f"This gait is not a solution ({self.status.key}): {self.status.hint} {worst}".strip())
        return self

    def with_verification(self, verification: PlanarVerification) -> "PlanarGait":
        """Return the gait with its replay attached; a solved gait that fails it is no longer solved."""
        status = self.status
        if status in (Status.SOLVED, Status.NOT_VERIFIED):
            status = Status.SOLVED if verification.passed else Status.NOT_VERIFIED
        return self.replace_fields(verification=verification, status=status)
