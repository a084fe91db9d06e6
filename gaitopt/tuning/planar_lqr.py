"""Discrete linear-quadratic feedback of a planar gait's return map."""

from collections.abc import Sequence

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.planar_laws.planar_feedback import planar_feedforward, planar_step_to_step, select_actuators
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.control.planar_laws.planar_reference import IDLE
from gaitopt.errors import InputError
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.ocp.transcription.method import check_count
from gaitopt.stability.planar_gaits.planar_assessment import assess_planar
from gaitopt.tuning.lqr import LqrWeights
from gaitopt.tuning.riccati import discrete_gains


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

    The gains follow from the exact derivatives of the return map by the state and by the added torques.

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
    base, n = law or planar_feedforward(gait), gait.robot.n_q

    def add_feedback(state: Array, gains: Array) -> PlanarLaw:
        return planar_step_to_step(
            gait.robot, base, state, gains, actuators=actuators, windows=windows, duration=gait.period
        )

    cycle = assess_planar(gait, add_feedback(np.zeros(2 * n), np.zeros((windows * len(actuators), 2 * n))))
    basis = cycle.basis
    sizes = np.repeat([weights.angle, weights.rate], n)
    largest = dict(zip(gait.robot.actuators, np.max(np.abs(gait.motion.channel("torque")), axis=1), strict=True))
    torques = np.tile([largest[name] if largest[name] > IDLE else weights.torque for name in actuators], windows)
    state_cost = basis.T @ np.diag(1 / sizes**2) @ basis
    gain = discrete_gains(cycle.derivative, cycle.latched_effect, state_cost, np.diag(1 / torques**2))
    if gain is None:
        raise InputError(
            f"No step-to-step feedback with {windows} windows of {', '.join(actuators)} stabilises the gait "
            f"'{gait.sequence}' with {weights}."
        )
    return add_feedback(np.array([*cycle.state.values()]), gain @ basis.T)
