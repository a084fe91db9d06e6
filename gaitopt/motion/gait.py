"""Gait: one optimised step with its problem, the report of the solver and its verification by replay."""

from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, join_reasons
from gaitopt.lazy import LazyField, LazyRecord
from gaitopt.motion.certificate import Certificate
from gaitopt.motion.conflict import Conflict
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.energy import Ledger, cost_of_transport, ledger
from gaitopt.motion.motion import Motion
from gaitopt.motion.nlp_solution import Solution
from gaitopt.motion.proposal import Proposal
from gaitopt.parameters import check_type
from gaitopt.reductions import worst
from gaitopt.status import Status

if TYPE_CHECKING:
    from gaitopt.model.robot import Robot

IMPLAUSIBLE = (
    "sizes, directions or travel of the robot are implausible, see the first warning; its limits were therefore not "
    "examined"
)
"""Message of a failed solve of a robot with implausible sizes, directions or travel, the probable cause."""


NONEXISTENT = "no periodic gait exists"
"""Part of the message of a problem that is refused because friction and gravity exclude every periodic gait."""

BEFORE_REFINEMENT = "the result is the solution before this refinement"
"""End of the message of a solve that was stopped on a finer grid, with the solution on the one before."""

WITHOUT_IMPULSE = "that is without impulse"
"""Part of the first warning of a failed solve whose contact sequence has touchdowns without impulse."""


@dataclass(frozen=True)
class Violation:
    """A violated constraint or bound, by name.

    Attributes
    ----------
    place : str
        Phase and node, such as ``"phase 2 (stick), node 7"``.
    name : str
        Constraint or variable.
    size : float
        Violation in its scaled unit.

    Examples
    --------
    >>> print(Violation("phase 2 (stick), node 7", "forward friction cone", 0.01))
    forward friction cone at phase 2 (stick), node 7 violated by 1.00e-02
    """

    place: str
    name: str
    size: float

    def __str__(self) -> str:
        return f"{self.name} at {self.place} violated by {self.size:.2e}"


@dataclass(frozen=True, kw_only=True)
class SolverReport(LazyRecord):
    """Report of the solver on an optimisation.

    Attributes
    ----------
    iterations : int
    objective : float
        Objective at the last iterate.
    constraint_violation : float
        Largest violation at the last iterate.
    error_between_nodes : float
        Largest difference of a state between the nodes of the plan and its integration from the first node with small
        Runge-Kutta steps of order 8 [rad, rad/s, m, m/s]; inf without a solution.
    build_seconds, solve_seconds : float
        Time to transcribe and compile (0 when an earlier build was reused), and to solve.
    message : str
        Return status of the solver.
    violations : tuple of Violation
        The most violated constraints, in order of decreasing violation; empty for a solution.
    warnings : tuple of str
        Remarks on a solution that need attention, such as a duration at its bound; reasons why a plan is inaccurate.
    conflicts : tuple of Conflict
        Conflicting limits, if the problem was found to be infeasible: each excludes all gaits near the starts.
    cost_error : float
        Estimated relative difference of the objective from its value on an infinitely fine grid; nan if there is no
        coarser grid to compare with.  For a robot with several contacts, the relative difference from the objective on
        half or twice as many intervals; nan unless ``cost_tolerance`` is stated.

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> gait.solver.message, gait.solver.violations
    ('Solve_Succeeded', ())
    """

    iterations: int
    objective: float
    constraint_violation: float
    error_between_nodes: LazyField[float] = LazyField()
    build_seconds: float
    solve_seconds: float
    message: str
    violations: tuple[Violation, ...] = ()
    warnings: LazyField[tuple[str, ...]] = LazyField(())
    conflicts: tuple[Conflict, ...] = ()
    cost_error: float = float("nan")


@dataclass(frozen=True)
class Verification:
    """Verification of a gait: its torques replayed in the event-driven simulator.

    Attributes
    ----------
    passed : bool
    sequence : str
        Contact sequence of the replay, or of its part until the simulation stopped.
    stop : str
        Reason why the replay ended.
    state_error : float
        Largest difference of the post-impact state from the planned one (SI units).
    period_error : float [s]
    cost_of_transport : float
        Cost of transport of the replayed step.
    cone_margin : float
        Smallest 1 - abs(f_t) / (mu f_n) while sticking, between nodes too.
    energy_residual : float
        Relative closing error of the replayed energy ledger.
    reasons : tuple of str
        Reasons why it did not pass; empty if it did.

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> gait.verification.passed, gait.verification.state_error < 1e-6
    (True, True)
    """

    passed: bool
    sequence: str
    stop: str
    state_error: float
    period_error: float
    cost_of_transport: float
    cone_margin: float
    energy_residual: float
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False, kw_only=True)
class Gait(LazyRecord):
    """One step of an optimised gait.

    Attributes
    ----------
    robot : Robot
        For a gait that was read from a file, it is restored at its first use.
    sequence : ContactSequence
        Planned contact sequence.
    status : Status
        Its ``ok`` states whether the gait is a solution.
    motion : Motion
        The planned step (of a gait that was not solved: the last iterate).
    problem : dict
        The fully resolved problem as plain data.
    solver : SolverReport
    solution : Solution or None
        Unknowns and multipliers of the optimisation, for warm starts.
    versions : dict of str to str
    verification : Verification or None
        None until :func:`gaitopt.verify` has replayed it.
    proposal : Proposal or None
        Record of how the contact sequence was determined, for a problem with an open one.
    certificate : Certificate or None
        Second-order conditions and sensitivities of the optimum on its grid; None if the gait is not a solution.

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> gait.status.key, str(gait.sequence), round(gait.speed, 3)
    ('solved', 'slip+ stick | slip+', 0.633)
    """

    robot: "LazyField[Robot]" = LazyField()
    sequence: ContactSequence
    status: Status
    motion: LazyField[Motion] = LazyField()
    problem: "LazyField[dict[str, Any]]" = LazyField()
    solver: SolverReport
    versions: dict[str, str]
    solution: Solution | None = field(default=None, repr=False)
    verification: Verification | None = None
    proposal: Proposal | None = None
    certificate: LazyField[Certificate | None] = LazyField(None)

    def __repr__(self) -> str:
        replay = "not replayed"
        if self.verification is not None:
            replay = "replay passed" if self.verification.passed else "replay failed"
        pace = f"{self.speed:.4g} m/s, step length {self.step_length:.4g} m"
        numbers = f"cost of transport {self.cost_of_transport:.6g}, {pace}"
        return f"Gait({self.robot_name!r}, '{self.sequence}', {self.status.key}, {replay}, {numbers})"

    @property
    def robot_name(self) -> str:
        """Name of the robot; the robot itself is not restored."""
        return str(self.robot_source.name)

    @property
    def robot_source(self) -> Any:
        """The robot, or the record from which it is restored at its first use."""
        return vars(self)["robot"]

    @property
    def objective(self) -> float:
        """Value of the objective that was minimised, in the unit ``problem["objective_unit"]``, or nan."""
        return self.solver.objective

    @property
    def cost_of_transport(self) -> float:
        """Absolute joint work over weight times travel (dimensionless)."""
        return cost_of_transport(self.motion)

    @property
    def period(self) -> float:
        """Duration of the step [s]."""
        return self.motion.period

    @property
    def step_length(self) -> float:
        """Forward travel in a step, foot slide included [m]."""
        return self.motion.travel

    @property
    def speed(self) -> float:
        """Average forward speed [m/s]; nan if the step takes no time."""
        return self.step_length / self.period if self.period else float("nan")

    @property
    def design(self) -> dict[str, float]:
        """Optimised values of the free parameters of the problem by name (SI units); empty without any."""
        return {name: self.motion.parameters[name] for name in self.problem.get("free") or {}}

    @property
    def energy(self) -> Ledger:
        """Energy ledger of the step [J]."""
        return ledger(self.motion)

    @property
    def friction_margin(self) -> float:
        """Smallest 1 - abs(f_t) / (mu f_n) over the sticking samples; nan if the gait never sticks."""
        return cone_margin(self.motion)

    def require(self) -> "Gait":
        """Return the gait itself if it is solved and did not fail its replay.

        Raises
        ------
        InputError
            If it is not; the message states why.
        """
        if not self.status.ok:
            solver = self.solver
            inaccurate = self.status is Status.PLAN_INACCURATE
            reasons = solver.warnings if inaccurate else solver.conflicts or solver.violations
            worst = join_reasons(reasons[:3])
            raise InputError(f"This gait is not a solution ({self.status.key}): {self.status.hint} {worst}".strip())
        return self

    def with_verification(self, verification: Verification) -> "Gait":
        """Return the gait with its replay attached; a solved gait that fails it is no longer solved."""
        status = self.status
        if status in (Status.SOLVED, Status.NOT_VERIFIED):
            status = Status.SOLVED if verification.passed else Status.NOT_VERIFIED
        return self.replace_fields(verification=verification, status=status)

    def without_certificate(self) -> "Gait":
        """Return the gait without its certificate, which is then not evaluated when the gait is saved."""
        return self.replace_fields(certificate=None)

    def postpone_evaluation(self) -> "Gait":
        """Return the gait whose motion and report another process evaluates if it is pickled before they are read."""
        solver = self.solver.postpone_evaluation()
        return super().postpone_evaluation().replace_fields(solver=solver)

    def with_failure(
        self, status: Status, message: str, conflicts: tuple[Conflict, ...] = (), *, seconds: float = 0.0
    ) -> "Gait":
        """Return the gait with the conclusion drawn from its failure.

        Parameters
        ----------
        status : Status
        message : str
            Reason, instead of the return status of the solver.
        conflicts : tuple of Conflict
            Conflicting limits.
        seconds : float
            Time by which `solver.solve_seconds` increases [s].
        """
        total = self.solver.solve_seconds + seconds
        report = self.solver.replace_fields(message=message, conflicts=conflicts, solve_seconds=total)
        return self.replace_fields(status=status, solver=report)

    def with_robot(self, robot: "Robot") -> "Gait":
        """Return the gait with a robot of the same physics instead of the present one.

        Needed for gaits of older files, which only name their robot, and for robots with a custom impact law or
        transition, whose code is not in the file.

        Raises
        ------
        InputError
            If the physics of the robot differ from those of the gait's robot; the message states what differs.

        Examples
        --------
        >>> from gaitopt import compass_biped, load
        >>> load("docs/examples/compass_slip.h5").with_robot(compass_biped()).robot_name
        'compass_biped'
        """
        from gaitopt.motion.robot_check import require_same_physics

        require_same_physics(self.robot_source, self.motion, robot)
        return self.replace_fields(robot=robot)


def cone_margin(motion: Motion) -> float:
    """Return the smallest 1 - abs(f_t) / (mu_s f_n) over the sticking samples of a motion; nan without any.

    It is -inf if a force is nan.
    """
    friction = motion.static_friction
    margins = [
        1 - np.abs(segment.force[0]) / (friction * segment.force[1])
        for segment in motion.segments
        if not segment.mode.slips
    ]
    return -worst(-np.concatenate(margins)) if margins else float("nan")


def check_gait(gait: object, name: str = "gait") -> None:
    """Raise InputError unless an argument is a gait; files and problems are not."""
    check_type(name, gait, Gait, 'a Gait such as load("gait.h5") or solve(problem)')
