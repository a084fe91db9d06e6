"""Periodic gaits of planar robots by Newton's method with exact derivatives."""

from collections.abc import Mapping
from dataclasses import field, replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from gaitopt.arguments import check_arguments
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.energy import Ledger
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_motion import PlanarMotion
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_engine import REFERENCE, PlanarEngine
from gaitopt.simulation.planar_simulation.planar_simulator import PlanarRollout, check_event, follow
from gaitopt.simulation.planar_simulation.planar_state import PlanarState
from gaitopt.simulation.planar_simulation.planar_walker import exchange_legs, simulate_period
from gaitopt.stability.critical_friction import CriticalFriction
from gaitopt.stability.planar_gaits.planar_friction import planar_critical_friction
from gaitopt.stability.planar_gaits.planar_linearisation import planar_derivative
from gaitopt.stability.planar_gaits.planar_section import PlanarSection, section_of
from gaitopt.status import Stop

TOLERANCE = 1e-10
"""Largest change of the state over the period that is accepted."""

MAX_ITERATIONS, SMALLEST_STEP = 30, 1 / 16
"""Largest number of Newton iterations, and smallest damping."""

SINGULAR = 1e-9
"""Singular values relative to the largest that count as zero: the state is not corrected in these directions."""

LONGEST, PERIODS = 20.0, 3.0
"""Longest motion from the given state to the section [s]; later ones take at most this number of its periods."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanarCycle:
    """A periodic gait of a planar robot, modulo leg exchange and travel, and its stability.

    Attributes
    ----------
    robot : str
    parameters : dict of str to float
    section : str
        Event right after which the state is periodic.
    state : dict of str to float
        State on the section after the leg exchange, by the names of coordinates and rates; the coordinate of travel has
        an arbitrary value, since it does not repeat.
    period : float [s]
    travel : float
        Forward travel over the period [m].
    derivative : (n_z, n_z) array
        Derivative of the return map in an orthonormal basis of the section.
    multipliers : (n_z,) complex array
        Its eigenvalues, largest modulus first.
    basis : (2 n_q, n_z) array
        The basis of the section: a deviation z of the state (q, v) is basis @ z.
    latched_effect : (n_z, n_l) array
        Derivative of the return map with respect to the latched values of the law.
    critical_friction : CriticalFriction or None
        None if a contact slips or none sticks.
    residual : float
        Largest change of the state over the period.
    motion : PlanarMotion
        The period.
    start : PlanarState
        The state at the start of the gait, with its contact modes.

    Examples
    --------
    >>> from gaitopt.model.robots.vertical_hopper import vertical_hopper
    >>> hop = find_planar_cycle(vertical_hopper(), [0.7, 0.2], [0, 0], {"gravity": 9.81}, section="sole closes")
    >>> hop.stable, hop.sequence
    (True, 'sole closed > sole closed | full length latched |')
    """

    robot: str
    parameters: dict[str, float]
    section: str
    state: dict[str, float]
    period: float
    travel: float
    derivative: Array
    multipliers: NDArray[np.complex128]
    basis: Array = field(repr=False)
    latched_effect: Array = field(repr=False)
    critical_friction: CriticalFriction | None
    residual: float
    motion: PlanarMotion
    start: PlanarState = field(repr=False)

    def __repr__(self) -> str:
        verdict = "stable" if self.stable else "unstable"
        return f"PlanarCycle({self.robot!r}, {verdict}, spectral radius {self.radius:.6g}, period {self.period:.6g} s)"

    @property
    def sequence(self) -> str:
        """Contact modes of the period; see :attr:`PlanarMotion.sequence`."""
        return self.motion.sequence

    @property
    def periodic_state(self) -> dict[str, float]:
        """State without the coordinate of travel, which does not repeat: a gait may begin anywhere along the ground."""
        return {name: value for name, value in self.state.items() if name != self.motion.travel}

    @property
    def radius(self) -> float:
        """Spectral radius: the largest modulus of a multiplier."""
        return float(np.max(np.abs(self.multipliers), initial=0.0))

    @property
    def stable(self) -> bool:
        """Whether all multipliers lie inside the unit circle."""
        return self.radius < 1

    @property
    def energy(self) -> Ledger:
        """Energy ledger of the period [J]."""
        return self.motion.ledger()


@check_arguments
def find_planar_cycle(
    robot: PlanarRobot,
    q: Array,
    v: Array,
    parameters: Mapping[str, float],
    *,
    section: str,
    torque: ca.Function | PlanarLaw | None = None,
    engine: PlanarEngine = REFERENCE,
) -> PlanarCycle | None:
    """Return the periodic gait to which Newton's method converges from a state, or None.

    The period is the motion from right after an event to right after the same event, with exchanged legs if the robot
    has a mirror; the coordinate of travel is not repeated.

    Parameters
    ----------
    robot : PlanarRobot
    q, v : (n_q,) arrays
        State from which the first period is simulated; it need not be on the section.
    parameters : mapping of str to float
    section : str
        Event that ends a period by an impact, such as ``"foot B closes"``.
    torque : Function or PlanarLaw, optional
        (t, q, v) -> u, with the time since the section, or a law; zero by default.
    engine : PlanarEngine
        By default the reference engine.

    Raises
    ------
    InputError
        If the event is invalid, or the motion from the state does not reach it.

    Examples
    --------
    >>> from gaitopt.model.robots.vertical_hopper import vertical_hopper
    >>> hop = find_planar_cycle(vertical_hopper(), [0.7, 0.2], [0, 0], {"gravity": 9.81}, section="sole closes")
    >>> hop
    PlanarCycle('vertical_hopper', stable, spectral radius 0.781076, period 0.553925 s)
    """
    check_event(robot, section)
    automaton = PlanarAutomaton(robot, robot.resolve(parameters), torque, engine=engine)
    return find_cycle_from(automaton, np.array(q, dtype=float), np.array(v, dtype=float), section)


def find_cycle_from(
    automaton: PlanarAutomaton, q: Array, v: Array, section: str, *, tolerance: float = TOLERANCE
) -> PlanarCycle | None:
    """Return the periodic gait near a state of an automaton; see :func:`find_planar_cycle`.

    If Newton's method makes no further progress, a motion whose change over the period is below the tolerance is
    returned: a gait under torques that depend on time only may have multipliers of exactly 1, and then no isolated
    periodic state.
    """
    state = automaton.begin(q, v)
    first = follow(automaton, state, duration=LONGEST, until=section)
    if first.stop is not Stop.EVENT_REACHED or first.end is None:
        raise InputError(f"The motion from this state does not reach the event {section!r}: {first.stop.hint}")
    trial = _choose_first(automaton, first, np.concatenate([q, v]), section)
    for _ in range(MAX_ITERATIONS):
        if trial is None:
            return None
        linear = _linearise(automaton, trial)
        residual = float(np.max(np.abs(linear.change)))
        improved = _improve(automaton, trial, linear, section) if residual > TOLERANCE / 1e4 else None
        if improved is None:
            return _cycle(automaton, trial, section, linear) if residual <= tolerance else None
        trial = improved
    return None


def _choose_first(automaton: PlanarAutomaton, first: PlanarRollout, y: Array, section: str) -> PlanarRollout | None:
    """Return the period with the smaller change: from the section near a state y, or from the end of its motion."""
    if first.end is None:
        return None
    following, n = exchange_legs(first.end, automaton.robot, automaton.robot.mirror), automaton.robot.n_q
    near = PlanarSection(automaton, first.arcs[-1], first.motion.events[-1], automaton.robot.mirror).correct(y)
    starts = replace(following, q=near[:n], v=near[n:]), following
    trials = [trial for start in starts if (trial := _simulate(automaton, start, section, LONGEST)) is not None]
    return min(trials, key=lambda trial: float(np.max(np.abs(_find_change(automaton, trial)))), default=None)


def _simulate(automaton: PlanarAutomaton, state: PlanarState, section: str, longest: float) -> PlanarRollout | None:
    """Return one period from a state with the contacts of another one near it, or None if it does not end."""
    rollout = simulate_period(automaton, state, section, longest)
    return rollout if rollout.stop is Stop.EVENT_REACHED else None


class _LinearPeriod(NamedTuple):
    """A period linearised on its section.

    Attributes
    ----------
    section : PlanarSection
    basis : (2 n_q, n_z) array
    derivative : (n_z, n_z) array
        Derivative of the return map, feedback at the section included.
    latched_effect : (n_z, n_l) array
    change : (2 n_q,) array
        Change of the state over the period, travel excluded.
    """

    section: PlanarSection
    basis: Array
    derivative: Array
    latched_effect: Array
    change: Array


def _linearise(automaton: PlanarAutomaton, rollout: PlanarRollout) -> _LinearPeriod:
    """Return the derivative of the return map of a period, and the change of the state."""
    if rollout.start is None or rollout.end is None:
        raise ValueError("a period has a start and an end")
    section, start, n = section_of(automaton, rollout), rollout.start, 2 * automaton.robot.n_q
    basis = section.tangent(start.y)
    matrix = section.matrix() @ planar_derivative(automaton, rollout)
    project = basis.T @ np.diag(section.project(np.ones(n)))
    effect = project @ matrix[:, n:]
    latched = automaton.torque.latched_slope(start.q, start.v) @ basis
    change = section.project(section.exchange(rollout.end).y - start.y)
    return _LinearPeriod(section, basis, project @ matrix[:, :n] @ basis + effect @ latched, effect, change)


def _improve(
    automaton: PlanarAutomaton, rollout: PlanarRollout, linear: _LinearPeriod, section: str
) -> PlanarRollout | None:
    """Return the period after a damped Newton step that reduces the change of the state, or None."""
    map_section, basis, derivative, _, change = linear
    start = rollout.start
    if start is None or not np.all(np.isfinite(derivative)):
        return None
    matrix = np.eye(derivative.shape[0]) - derivative
    direction = basis @ np.linalg.lstsq(matrix, basis.T @ change, rcond=SINGULAR)[0]
    step, n, size = 1.0, automaton.robot.n_q, np.max(np.abs(change))
    while step >= SMALLEST_STEP:
        y = map_section.correct(start.y + step * direction)
        trial = _simulate(automaton, replace(start, q=y[:n], v=y[n:]), section, PERIODS * rollout.motion.period)
        if trial is not None and np.max(np.abs(_find_change(automaton, trial))) < (1 - step / 4) * size:
            return trial
        if size <= TOLERANCE:
            return None
        step /= 2
    return None


def _find_change(automaton: PlanarAutomaton, rollout: PlanarRollout) -> Array:
    """Return the change of the state over a period, travel excluded."""
    if rollout.start is None or rollout.end is None:
        raise ValueError("a period has a start and an end")
    section = section_of(automaton, rollout)
    return section.project(section.exchange(rollout.end).y - rollout.start.y)


def _cycle(automaton: PlanarAutomaton, rollout: PlanarRollout, section: str, linear: _LinearPeriod) -> PlanarCycle:
    robot, start, end = automaton.robot, rollout.start, rollout.end
    if start is None or end is None:
        raise ValueError("a period has a start and an end")
    if not np.all(np.isfinite(linear.derivative)):
        raise InputError(
            "The derivative of the return map is not finite: a torque of the law is undefined in a state of the gait. "
            "Check the law for divisions by zero, also by a gain that is zero."
        )
    eigenvalues = np.linalg.eigvals(linear.derivative).astype(complex)
    along = None if robot.travel is None else robot.coordinates.index(robot.travel)
    return PlanarCycle(
        robot=robot.name,
        parameters=dict(automaton.values),
        section=section,
        state=dict(zip(robot.state_names, start.y.tolist(), strict=True)),
        period=rollout.motion.period,
        travel=0.0 if along is None else float(end.q[along] - start.q[along]),
        derivative=linear.derivative,
        multipliers=eigenvalues[np.argsort(-np.abs(eigenvalues))],
        basis=linear.basis,
        latched_effect=linear.latched_effect,
        critical_friction=planar_critical_friction(automaton, rollout),
        residual=float(np.max(np.abs(linear.change))),
        motion=rollout.motion,
        start=start,
    )
