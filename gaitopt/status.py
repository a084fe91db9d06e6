"""Status of an optimisation and of a simulation, each with a sentence that states the remedy."""

from enum import Enum

__all__ = ["Status", "Stop"]


class Status(Enum):
    """Status of a gait optimisation.

    The value is a sentence for readers; files and ``--json`` contain the name in lower case.

    Examples
    --------
    >>> Status.SOLVED.ok, Status.INFEASIBLE.key
    (True, 'infeasible')
    """

    SOLVED = "Solved to the requested tolerance."
    ACCEPTABLE = (
        "Stopped at Ipopt's 'acceptable' tolerance, which is looser than requested; gaitopt does not count the result "
        "as a solution: start from another guess, or specify a larger tolerance of the solver."
    )
    NOT_VERIFIED = (
        "The optimiser converged, but its torques, replayed in the event-driven simulator, do not give the planned "
        "gait. Unless the reported reasons state another remedy, use more intervals or another contact "
        "sequence."
    )
    PLAN_INACCURATE = (
        "The optimiser converged, but the plan is not accurate between the nodes or violates a condition there. The "
        "warnings state where, and the remedies."
    )
    UNCONFIRMED = (
        "The contact sequence proposed in place of 'any' was solved, but its cost differs from that of the relaxed "
        "problem: use another relaxation or, in Python, solve(problem, starts=8), or solve the proposed contact "
        "sequence separately."
    )
    INFEASIBLE = (
        "No gait with this contact sequence satisfies the constraints near the initial guesses: relax the conflicting "
        "limits or, if none are listed, the most violated constraint, or try another contact sequence or initial guess."
    )
    ITERATION_LIMIT = "Stopped at the iteration limit; increase it, or start from a gait closer to the solution."
    TIME_LIMIT = "Stopped at the time limit; increase it, or start from a gait closer to the solution."
    INTERRUPTED = "Interrupted; the result is not a solution."
    DIVERGING = "The iterates diverge; add the bounds that are missing, such as torque or duration limits."
    INVALID_NUMBER = "A function returned nan or inf; start from a guess away from singular configurations."
    INVALID_OPTION = "The solver rejected its options; check the names of the solver and the linear solver."
    FAILED = "The solver stopped without a result; try another guess."

    @property
    def ok(self) -> bool:
        """Whether the result is a solution."""
        return self is Status.SOLVED

    @property
    def key(self) -> str:
        """Name for files and JSON, in lower case."""
        return self.name.lower()

    @property
    def hint(self) -> str:
        """The result and the remedy, as a sentence."""
        return self.value


class Stop(Enum):
    """Reason why a simulation ended.

    Examples
    --------
    >>> Stop.LIFT_OFF.key
    'lift_off'
    """

    STEPS_DONE = "All requested steps were completed."
    FELL = "The walker fell."
    LIFT_OFF = "The stance foot lifted off, which ends the simulation of a robot with one foot on the ground at a time."
    DOUBLE_SUPPORT = (
        "The touchdown has no outcome with an impulse at the landing foot alone: the trailing foot would not separate, "
        "or the landing foot would have to be pulled."
    )
    PAINLEVE = "Slip is not well posed in this state (Painleve's paradox), so the simulation ended."
    SINGULAR = "The integration stopped where the motion or the torque is singular or not finite."
    NO_TOUCHDOWN = "The swing foot did not touch down within the time limit."
    TOO_MANY_EVENTS = "One step has too many contact events or samples: a foot chatters, or the robot spins."
    EVENT_REACHED = "The requested event was reached."
    DURATION_DONE = "The requested duration was simulated."
    INCONSISTENT = (
        "No contact modes and forces satisfy the friction law in this state, so the simulation of rigid bodies ended."
    )
    MUST_SLIP = (
        "A foot on ground of infinite friction would have to slip: its normal force vanishes but not its tangential "
        "force, and it cannot leave the ground. Use a finite coefficient of friction."
    )
    AMBIGUOUS = (
        "Several motions satisfy the friction law in this state (with large friction, for example, one in which a foot "
        "sticks and one in which it leaves the ground), so the simulation ended. Try less friction or, for a planned "
        "gait, larger Margins(cone=..., impact_cone=...), another speed or step length, or a sequence in which the "
        "foot leaves the ground."
    )
    STUMBLED = (
        "A foot hit the vertical face of a step in the ground, or slid onto ground of infinite friction, so "
        "the simulation ended."
    )
    UNEVEN = "A rigid foot would stand on ground of two different heights, so the simulation ended."
    JAM = "The sliding contacts jam: their slip is not well posed, so the simulation ended."
    INTERRUPTED = "The simulation was interrupted; the motion ends with the last event before."

    @property
    def key(self) -> str:
        """Name for files and JSON, in lower case."""
        return self.name.lower()

    @property
    def hint(self) -> str:
        """The reason, as a sentence."""
        return self.value
