"""measure_library: errors of an interpolated library at the midpoints of its cells."""

from collections.abc import Callable

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law, feedforward
from gaitopt.dataclass import dataclass
from gaitopt.model.coordinate_entries import ANGLES
from gaitopt.model.robot import Robot
from gaitopt.motion.energy import cost_of_transport
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Motion
from gaitopt.motion.printable import format_count
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solver import solve
from gaitopt.ocp.statement.warm_start import FromMotion
from gaitopt.simulation.simulator import simulate
from gaitopt.simulation.step_limits import StepLimits
from gaitopt.status import Status
from gaitopt.study.libraries.gait_library import GaitLibrary, resample_phase

LawMaker = Callable[[Robot, Motion], Law]


@dataclass(frozen=True, kw_only=True)
class CellError:
    """Errors of a library at the midpoint of a cell.

    Attributes
    ----------
    place : dict of str to float
        Value of each axis.
    sequence : str
        Contact sequence of the simulated step; empty if it did not reach its touchdown.
    state : float
        Largest difference of angles and rates after the simulated step from those at its start [rad, rad/s]; inf if it
        did not reach its touchdown.
    angle, torque : float [rad, N m]
        Largest difference from the optimal gait at this place, at equal fractions of the phases; nan if it was not
        solved.
    cost : float
        Difference of the cost of transport from that of the optimal gait; nan if it was not solved.

    Examples
    --------
    >>> CellError(place={"speed": 0.6}, sequence="stick | stick", state=1e-3).angle
    nan
    """

    place: dict[str, float]
    sequence: str
    state: float
    angle: float = float("nan")
    torque: float = float("nan")
    cost: float = float("nan")


@dataclass(frozen=True)
class LibraryErrors:
    """Errors of a library at the midpoints of its cells.

    A linear interpolation of a smooth function has its largest error at the midpoint of a cell, to leading order in the
    size of the cell.  The largest errors at the midpoints are therefore estimates of the bounds over the grid.

    Attributes
    ----------
    cells : tuple of CellError
    sequence : str
        Contact sequence of the library.

    Examples
    --------
    >>> cell = CellError(place={"speed": 0.6}, sequence="stick | stick", state=1e-3)
    >>> LibraryErrors((cell,), "stick | stick").largest("state")
    0.001
    """

    cells: tuple[CellError, ...]
    sequence: str

    def largest(self, name: str) -> float:
        """Return the largest value of ``"state"``, ``"angle"``, ``"torque"`` or ``"cost"`` in absolute terms."""
        return float(np.max(np.abs([getattr(cell, name) for cell in self.cells]), initial=0.0))

    @property
    def changed(self) -> tuple[CellError, ...]:
        """Cells in which the simulated step has another contact sequence."""
        return tuple(cell for cell in self.cells if cell.sequence != self.sequence)

    def __str__(self) -> str:
        lines = [
            f"{format_count(len(self.cells), 'cell')}, {len(self.changed)} of them with another contact sequence than "
            f"'{self.sequence}'"
        ]
        for name, unit, meaning in (
            ("state", "rad, rad/s", "change of the state over a simulated step"),
            ("angle", "rad", "difference of the angles from the optimum"),
            ("torque", "N m", "difference of the torques from the optimum"),
            ("cost", "", "difference of the cost of transport from the optimum"),
        ):
            known = [cell for cell in self.cells if not np.isnan(getattr(cell, name))]
            if known:
                largest, missing = (
                    LibraryErrors(tuple(known), self.sequence).largest(name),
                    len(self.cells) - len(known),
                )
                where = f"; {format_count(missing, 'cell')} without an optimum" if missing else ""
                lines.append(f"largest {meaning}: {largest:.3g}{unit and f' {unit}'}{where}")
        return "\n".join(lines)


@check_arguments
def measure_library(
    library: GaitLibrary, *, problem: GaitProblem | None = None, law: LawMaker = feedforward
) -> LibraryErrors:
    """Simulate the interpolated step at the midpoint of every cell, and compare it with the optimal gait there.

    Parameters
    ----------
    library : GaitLibrary
    problem : GaitProblem, optional
        Problem of the sweep.  It is solved at every midpoint, from the interpolated step; without it, steps are only
        simulated.
    law : callable
        (robot, motion) -> Law under which steps are simulated; the torques of the library by default.

    Returns
    -------
    LibraryErrors

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped, sweep
    >>> from gaitopt.study import load_library
    >>> import tempfile
    >>> problem = GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.2, step_length=0.45, limits=Limits(torque=6),
    ...     objective="torque_squared", transcription=MultipleShooting(intervals=10))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     table = sweep(problem, {"speed": [0.6, 0.62]}, starts=1, path=f"{folder}/speeds.nc")
    ...     errors = measure_library(load_library(f"{folder}/speeds.nc"), problem=problem)
    >>> len(errors.cells), errors.largest("angle") < 1e-3
    (1, True)
    """
    cells = []
    for place in library.midpoints():
        motion = library.motion_at(**place)
        sequence, state = _simulate_step(library.robot, motion, law)
        compared = {} if problem is None else _compare(motion, _solve_at(problem, library.sequence, place, motion))
        cells.append(CellError(place=place, sequence=sequence, state=state, **compared))
    return LibraryErrors(tuple(cells), library.sequence)


def _simulate_step(robot: Robot, motion: Motion, law: LawMaker) -> tuple[str, float]:
    """Return the contact sequence of a simulated step and the change of its state."""
    first = motion.segments[0]
    q, v = first.q[:, 0], first.v[:, 0]
    limits = StepLimits(duration=3 * motion.period)
    walk = simulate(robot, q, v, motion.parameters, law=law(robot, motion), step_limits=limits).motion
    if not walk.jumps:
        return "", float("inf")
    jump = walk.jumps[0]
    change = np.concatenate([jump.q_next[ANGLES] - q[ANGLES], jump.v_next[ANGLES] - v[ANGLES]])
    return str(walk.sequence()), float(np.max(np.abs(change)))


def _solve_at(problem: GaitProblem, sequence: str, place: dict[str, float], motion: Motion) -> Gait:
    """Return the optimal gait at a place of the grid; raise KeyboardInterrupt if the solve was interrupted."""
    fields = {name: value for name, value in place.items() if name in ("speed", "step_length")}
    others = {name: value for name, value in place.items() if name not in fields}
    guess = FromMotion(motion, label="interpolated gait")
    gait = solve(problem.replace(sequence=sequence, guess=guess, **fields).fix_parameters(others))
    if gait.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    return gait


def _compare(motion: Motion, gait: Gait) -> dict[str, float]:
    """Return the largest differences of a motion from a gait; nan if the gait is not solved."""
    if not gait.status.ok:
        return {}
    pairs = zip(motion.segments, gait.motion.segments, strict=True)
    difference = np.hstack([np.abs(resample_phase(one) - resample_phase(other)) for one, other in pairs])
    n_q = gait.robot.n_q
    return {
        "angle": float(np.max(difference[:n_q][ANGLES])),
        "torque": float(np.max(difference[2 * n_q :])),
        "cost": cost_of_transport(motion) - gait.cost_of_transport,
    }
