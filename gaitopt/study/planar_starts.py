"""Gaits of robots with several contacts in a study: default starts, the best gait, and its replay."""

from gaitopt.errors import InputError
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.ocp.multicontact.planar_guess import PoseGuess
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.multicontact.planar_solver import solve_planar
from gaitopt.reductions import rank_of
from gaitopt.simulation.planar_verification import verify_planar
from gaitopt.status import Status


def solve_default(problem: PlanarProblem, starts: int) -> PlanarGait:
    """Return the gait of lowest objective from the default starts of a problem, without its certificate.

    A guess whose phases are those of another contact sequence is replaced by the linear guess between poses.
    """
    try:
        return solve_planar_start(problem, starts)
    except InputError:
        return solve_planar_start(problem.replace(guess=PoseGuess()), starts)


def solve_planar_start(problem: PlanarProblem, starts: int = 1) -> PlanarGait:
    """Return the gait of lowest objective from the guess of a problem and random starts, without its certificate.

    Raises
    ------
    KeyboardInterrupt
        If the user interrupts it: the last iterate is not a result of a study.
    """
    gait = solve_planar(problem, starts=starts)
    if gait.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    return gait.without_certificate()


def select_best(gaits: list[PlanarGait]) -> PlanarGait:
    """Return the solved gait of lowest objective, or the failure of least constraint violation."""
    solved = [gait for gait in gaits if gait.status.ok]
    if solved:
        return min(solved, key=planar_objective)
    return min(gaits, key=lambda gait: rank_of(gait.solver.constraint_violation))


def verify_best_planar(gaits: list[PlanarGait]) -> PlanarGait:
    """Return the gait of lowest objective that passes its replay, or the best one with its failed replay."""
    ordered = sorted(gaits, key=planar_objective)
    checked: list[PlanarGait] = []
    for gait in ordered:
        checked.append(verify_planar(gait) if gait.status.ok else gait)
        if checked[-1].status.ok:
            return checked[-1]
    return checked[0]


def planar_objective(gait: PlanarGait) -> float:
    """Return the objective of a gait for comparisons; infinite if it is not a number."""
    return rank_of(gait.solver.objective)
