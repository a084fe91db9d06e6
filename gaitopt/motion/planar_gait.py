"""PlanarGait: one optimised period of a planar robot with any contacts."""

from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, join_reasons
from gaitopt.lazy import LazyField, LazyRecord
from gaitopt.motion.certificate import Certificate
from gaitopt.motion.energy import Ledger
from gaitopt.motion.gait import Gait, SolverReport, check_gait
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
        For a gait that was read from a file, it is restored at its first use.
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
    certificate : Certificate or None
        Certificate of the optimum on its grid; None if the gait is not solved.

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

    robot: "LazyField[PlanarRobot]" = LazyField()
    sequence: PhaseSequence
    status: Status
    motion: LazyField[PlanarMotion] = LazyField()
    problem: dict[str, Any]
    solver: SolverReport
    versions: dict[str, str]
    solution: Solution | None = field(default=None, repr=False)
    verification: PlanarVerification | None = None
    certificate: LazyField[Certificate | None] = LazyField(None)

    def __repr__(self) -> str:
        replay = "not replayed"
        if self.verification is not None:
            replay = "replay passed" if self.verification.passed else "replay failed"
        numbers = f"objective {self.solver.objective:.6g}, {self.speed:.4g} m/s, step length {self.step_length:.4g} m"
        return f"PlanarGait({self.robot_name!r}, '{self.sequence}', {self.status.key}, {replay}, {numbers})"

    @property
    def robot_name(self) -> str:
        """Name of the robot; the robot itself is not restored."""
        return str(self.robot_source.name)

    @property
    def robot_source(self) -> Any:
        """The robot, or the record from which it is restored at its first use."""
        return vars(self)["robot"]

    @property
    def period(self) -> float:
        """Duration of the period [s]."""
        return self.motion.period

    @property
    def step_length(self) -> float:
        """Forward travel in a period [m]; 0 for a robot that does not travel."""
        return self.motion.distance

    @property
    def speed(self) -> float:
        """Average forward speed [m/s]; nan if the period takes no time."""
        return self.step_length / self.period if self.period else float("nan")

    @property
    def objective(self) -> float:
        """Value of the objective that was minimised, in the unit ``problem["objective_unit"]``, or nan."""
        return self.solver.objective

    @property
    def absolute_work(self) -> float:
        """Absolute joint work of the period, summed between samples and with that of impulses [J]."""
        work = sum(float(np.abs(np.diff(segment.work, axis=1)).sum()) for segment in self.motion.segments)
        return work + sum(self.motion.impulse_work)

    @property
    def cost_of_transport(self) -> float:
        """Absolute joint work over weight times travel, or nan."""
        weight = self.motion.total_mass * self.motion.parameters["gravity"]
        return self.absolute_work / (weight * self.step_length) if self.step_length else float("nan")

    @property
    def design(self) -> dict[str, float]:
        """Optimised values of the free parameters of the problem by name (SI units); empty if there are none."""
        return {name: self.motion.parameters[name] for name in self.problem.get("free") or {}}

    @property
    def energy(self) -> Ledger:
        """Energy ledger of the period [J]."""
        return self.motion.ledger()

    def require(self) -> "PlanarGait":
        """Return the gait itself if it is solved and did not fail its replay; raise InputError otherwise."""
        if not self.status.ok:
            solver = self.solver
            inaccurate = self.status is Status.PLAN_INACCURATE
            reasons = solver.warnings if inaccurate else solver.conflicts or solver.violations
            worst = join_reasons(reasons[:3])
            raise InputError(f"This gait is not a solution ({self.status.key}): {self.status.hint} {worst}".strip())
        return self

    def with_robot(self, robot: "PlanarRobot") -> "PlanarGait":
        """Return the gait with a robot of the same physics instead of the present one.

        Raises
        ------
        InputError
            If the physics of the robot differ from those of the gait's robot; the message states what differs.
        """
        from gaitopt.motion.robot_check import require_same_physics

        require_same_physics(self.robot_source, self.motion, robot)
        return self.replace_fields(robot=robot)

    def with_verification(self, verification: PlanarVerification) -> "PlanarGait":
        """Return the gait with its replay attached; a solved gait that fails it is no longer solved."""
        status = self.status
        if status in (Status.SOLVED, Status.NOT_VERIFIED):
            status = Status.SOLVED if verification.passed else Status.NOT_VERIFIED
        return self.replace_fields(verification=verification, status=status)

    def without_certificate(self) -> "PlanarGait":
        """Return the gait without its certificate, which is then not evaluated when the gait is saved."""
        return self.replace_fields(certificate=None)


AnyGait = Gait | PlanarGait


def check_any_gait(gait: object, name: str = "gait") -> None:
    """Raise InputError unless an argument is a gait of any robot."""
    if not isinstance(gait, PlanarGait):
        check_gait(gait, name)
