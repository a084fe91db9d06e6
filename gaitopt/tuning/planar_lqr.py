"""Linear-quadratic feedback of planar gaits: along the gait through its events, and of its return map."""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.planar_laws.planar_feedback import planar_feedforward, planar_step_to_step, select_actuators
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.control.planar_laws.planar_reference import IDLE, planar_references
from gaitopt.control.planar_laws.planar_state_feedback import planar_state_feedback
from gaitopt.errors import InputError
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.printable import format_count
from gaitopt.ocp.transcription.method import check_count
from gaitopt.stability.planar_gaits.planar_assessment import assess_planar
from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
from gaitopt.tuning.lqr import LqrWeights
from gaitopt.tuning.planar_intervals import LinearPhase, linearise_planar
from gaitopt.tuning.riccati import discrete_gains, periodic_gains

SHARE = 0.1
"""Torque that costs 1 in time-varying feedback, as a share of the largest planned one: light feet need small gains."""


@check_arguments
def planar_lqr(
    gait: PlanarGait,
    *,
    actuators: Sequence[str] | None = None,
    weights: LqrWeights | None = None,
    torque_limit: float | Mapping[str, float] = np.inf,
) -> PlanarLaw:
    """Return the time-varying linear-quadratic law of a planar gait, designed through all of its events.

    The design uses the linearised dynamics of each contact state and the saltation matrix, which includes the change of
    the event time, at each event; the cost-to-go is periodic over the period and the exchange of the legs.

    Parameters
    ----------
    gait : PlanarGait
    actuators : sequence of str, optional
        Actuators with feedback; by default those with a planned torque.
    weights : LqrWeights, optional
        As in :func:`planar_step_lqr`, over time; a torque costs 1 if it is a tenth as large as there.
    torque_limit : float or mapping of actuator to float [N m or N]

    Raises
    ------
    InputError
        If no periodic gait is found near the planned one in open loop, or no feedback stabilises it.

    Examples
    --------
    >>> from gaitopt.model import compass_with_two_feet
    >>> from gaitopt.ocp import Collocation, PlanarLimits, PlanarProblem, solve_planar
    >>> from gaitopt.stability import assess_planar
    >>> gait = solve_planar(PlanarProblem(
    ...     robot=compass_with_two_feet(), sequence="foot A stick |", friction=1.0, speed=0.633, step_length=0.4713,
    ...     objective="torque_squared", limits=PlanarLimits(torque={"ankle B": 0}),
    ...     transcription=Collocation(intervals=10)))
    >>> assess_planar(gait, planar_lqr(gait)).radius < 0.6 < assess_planar(gait).radius
    True
    """
    weights, chosen = weights or LqrWeights(), select_actuators(gait, actuators)
    robot, phases = gait.robot, linearise_planar(gait)
    columns = [robot.actuators.index(name) for name in chosen]
    sizes = np.repeat([weights.angle, weights.rate], robot.n_q)
    cost = np.diag(1 / sizes**2)
    if robot.travel is not None:
        cost[robot.coordinates.index(robot.travel)] = 0.0
    intervals = [replace(each, b=each.b[:, columns]) for phase in phases for each in phase.intervals]
    solution = periodic_gains(intervals, cost, np.diag(1 / (SHARE * _torque_sizes(gait, chosen, weights)) ** 2))
    if solution is None:
        raise InputError(
            f"No linear-quadratic feedback stabilises the gait '{gait.sequence}' with {weights}; try other weights."
        )
    gains = np.zeros((len(intervals), 2, robot.n_u, 2 * robot.n_q))
    gains[:, :, columns] = solution[0]
    if robot.travel is not None:
        gains[..., robot.coordinates.index(robot.travel)] = 0.0
    return planar_state_feedback(gait, _gains_of_pieces(gait, phases, gains), torque_limit=torque_limit, name="lqr")


@check_arguments
def planar_step_lqr(
    gait: PlanarGait,
    *,
    law: PlanarLaw | None = None,
    actuators: Sequence[str] | None = None,
    windows: int = 3,
    weights: LqrWeights | None = None,
) -> PlanarLaw:
    """Return the linear-quadratic law of a planar gait's return map: torques added in equal windows of each period.

    The gains follow from the exact derivatives of the return map with respect to the state and the added torques.

    Parameters
    ----------
    gait : PlanarGait
    law : PlanarLaw, optional
        Law without limits to which the torques are added, such as ``planar_joint_pd(gait, ...)``; by default the
        planned torques.
    actuators : sequence of str, optional
        Actuators of the added torques; by default those with a planned torque.
    windows : int
        Number of equal parts of the period.
    weights : LqrWeights, optional
        `angle` and `rate` scale all coordinates and rates.  A torque costs 1 if it is as large as the largest planned
        torque of its actuator, or as `torque` if the actuator is idle in the plan.

    Raises
    ------
    InputError
        If no periodic gait is found near the planned one, or no feedback stabilises it.

    Examples
    --------
    >>> from gaitopt.model import monopod
    >>> from gaitopt.ocp import Collocation, PlanarProblem, solve_planar
    >>> from gaitopt.stability import assess_planar
    >>> gait = solve_planar(PlanarProblem(
    ...     robot=monopod(), sequence="foot stick > flight |", friction=1.0, speed=1.5, step_length=0.6,
    ...     objective="torque_squared", transcription=Collocation(intervals=(8, 12))))
    >>> assess_planar(gait).stable, assess_planar(gait, planar_step_lqr(gait)).stable
    (False, True)
    """
    check_count("windows", windows, 1, 20)
    weights, actuators = weights or LqrWeights(), select_actuators(gait, actuators)
    cycle, n = _assess_windows(gait, law, actuators, windows), gait.robot.n_q
    basis = cycle.basis
    sizes = np.repeat([weights.angle, weights.rate], n)
    torques = np.tile(_torque_sizes(gait, actuators, weights), windows)
    state_cost = basis.T @ np.diag(1 / sizes**2) @ basis
    gain = discrete_gains(cycle.derivative, cycle.latched_effect, state_cost, np.diag(1 / torques**2))
    if gain is None:
        raise InputError(
            f"No step-to-step feedback of {', '.join(actuators)} with {format_count(windows, 'interval')} per period "
            f"(windows) stabilises the gait '{gait.sequence}' with {weights}; try other weights, another number of "
            "windows, or other actuators."
        )
    return _add_feedback(gait, law, actuators, np.array([*cycle.state.values()]), gain @ basis.T)


@functools.lru_cache(maxsize=4)
def _assess_windows(gait: PlanarGait, law: PlanarLaw | None, actuators: tuple[str, ...], windows: int) -> PlanarCycle:
    """Return the gait with zero added torques, and the derivatives of its return map with respect to them."""
    n = 2 * gait.robot.n_q
    return assess_planar(
        gait, _add_feedback(gait, law, actuators, np.zeros(n), np.zeros((windows * len(actuators), n)))
    )


def _add_feedback(
    gait: PlanarGait, law: PlanarLaw | None, actuators: Sequence[str], state: Array, gains: Array
) -> PlanarLaw:
    """Return a law with added torques; by default they are added to the planned ones."""
    base, windows = law or planar_feedforward(gait), len(gains) // len(actuators)
    return planar_step_to_step(
        gait.robot, base, state, gains, actuators=actuators, windows=windows, duration=gait.period
    )


def _torque_sizes(gait: PlanarGait, actuators: Sequence[str], weights: LqrWeights) -> Array:
    """Return the torque of each actuator that costs 1."""
    largest = dict(zip(gait.robot.actuators, np.max(np.abs(gait.motion.channel("torque")), axis=1), strict=True))
    return np.array([largest[name] if largest[name] > IDLE else weights.torque for name in actuators])


def _gains_of_pieces(gait: PlanarGait, phases: Sequence[LinearPhase], gains: Array) -> list[Array]:
    """Return the gains at the start and the end of each piece of the law, from those of the intervals of all phases."""
    ends, parts = np.cumsum([0, *(len(phase.intervals) for phase in phases)]), []
    for number, plan in enumerate(planar_references(gait)):
        members = [k for k, phase in enumerate(phases) if phase.part == number]
        corners, pieces = plan.breakpoints, []
        for begin, end in zip(corners, [*corners[1:], corners[-1]], strict=True):
            late = [k for k in members if phases[k].time[-1] >= (begin + end) / 2]
            k = late[0] if late and end > begin else members[-1]
            pieces.append([_interpolate(phases[k].time, gains[ends[k] : ends[k + 1]], at) for at in (begin, end)])
        parts.append(np.array(pieces))
    return parts


def _interpolate(time: Array, gains: Array, at: float) -> Array:
    """Return the gains of a phase at a time, linear between its samples."""
    samples = np.unique(time)
    values = np.concatenate([gains[:, 0], gains[-1:, 1]])
    place = int(np.clip(np.searchsorted(samples, at) - 1, 0, samples.size - 2))
    share = np.clip((at - samples[place]) / (samples[place + 1] - samples[place]), 0.0, 1.0)
    return np.asarray((1 - share) * values[place] + share * values[place + 1])
