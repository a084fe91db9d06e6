"""Laws of planar gaits: feedforward torques, joint PD feedback, and step-to-step feedback at the section."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.gain_matrix import GainMatrix
from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.control.planar_laws.planar_reference import (
    PlanarReference,
    plan_impulses,
    planar_references,
    used_actuators,
)
from gaitopt.control.signature import control_function, inputs_of, make_memory, torque_function
from gaitopt.control.torque_saturation import limit_torque, torque_limits
from gaitopt.errors import InputError, suggest
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.stated_changes import CLOSES, find_closing
from gaitopt.parameters import Parameter, check_type


@check_arguments
def planar_feedforward(gait: PlanarGait) -> PlanarLaw:
    """Return the law that replays the torques of a planar gait, with a clock that is reset at the section.

    Parameters
    ----------
    gait : PlanarGait

    Raises
    ------
    InputError
        If the gait is not a solution, or does not end with an impact.

    Examples
    --------
    >>> from gaitopt.model import monopod
    >>> from gaitopt.ocp import Collocation, PlanarProblem, solve_planar
    >>> gait = solve_planar(PlanarProblem(
    ...     robot=monopod(), sequence="foot stick > flight |", friction=1.0, speed=1.5, step_length=0.6,
    ...     objective="torque_squared", transcription=Collocation(intervals=(8, 12))))
    >>> planar_feedforward(gait)
    PlanarLaw('feedforward', section 'foot closes', 1 part)
    """
    section, parts = find_section(gait), []
    for plan in planar_references(gait):
        rows = 1 + 2 * gait.robot.n_u
        data = ca.SX.sym("data", rows)
        control = _torque_of(gait.robot, data, plan)
        parts.append(Law("feedforward", control, plan.breakpoints, plan.table[:rows]))
    return PlanarLaw("feedforward", section, tuple(parts), plan_impulses(gait))


@check_arguments
def planar_joint_pd(
    gait: PlanarGait,
    *,
    stiffness: float = 0.0,
    damping: float = 0.0,
    actuators: Sequence[str] | None = None,
    torque_limit: float | Mapping[str, float] = np.inf,
) -> PlanarLaw:
    """Return the law u = u_ref(t) - K (joint position - its reference) - D (joint rate - its reference), within limits.

    A joint position is the angle or length on which an actuator does work; its error is linearised about the current
    state.  With zero gains the law is :func:`planar_feedforward`.

    Parameters
    ----------
    gait : PlanarGait
    stiffness : float [N m/rad or N/m]
    damping : float [N m s/rad or N s/m]
        Gains of all joints with feedback; ``PlanarLaw.with_gains`` sets those of one joint, such as
        ``"hip_stiffness"``.
    actuators : sequence of str, optional
        Joints with feedback; by default those with a planned torque.
    torque_limit : float or mapping of actuator to float [N m or N]

    Raises
    ------
    InputError
        If the gait is not a solution, a gain is not finite, or an actuator is unknown.

    Examples
    --------
    >>> from gaitopt.model import monopod
    >>> from gaitopt.ocp import Collocation, PlanarProblem, solve_planar
    >>> gait = solve_planar(PlanarProblem(
    ...     robot=monopod(), sequence="foot stick > flight |", friction=1.0, speed=1.5, step_length=0.6,
    ...     objective="torque_squared", transcription=Collocation(intervals=(8, 12))))
    >>> planar_joint_pd(gait, stiffness=20, damping=2).gain_values["hip_stiffness"]
    20.0
    """
    section, robot, p = find_section(gait), gait.robot, gait.robot.vector(gait.motion.parameters)
    selected = select_actuators(gait, actuators)
    chosen = np.array([float(name in selected) for name in robot.actuators])
    kinds = (("stiffness", stiffness), ("damping", damping))
    for kind, value in kinds:
        Parameter(kind, 0.0, "1", "").check(value)
    names = [f"{actuator}_{kind}" for kind, _ in kinds for actuator in robot.actuators]
    values = np.concatenate([value * chosen for _, value in kinds])
    parts, n_u = [], robot.n_u
    for plan in planar_references(gait):
        data = ca.SX.sym("data", plan.size + 2 * n_u)
        control = _torque_of(robot, data, plan, p=p)
        table = np.vstack([plan.table, np.tile(values[:, None], plan.breakpoints.size)])
        rows = {name: plan.size + i for i, name in enumerate(names)}
        law = Law("joint_pd", control, plan.breakpoints, table, rows)
        parts.append(limit_torque(law, torque_limits(robot, torque_limit)))
    return PlanarLaw("joint_pd", section, tuple(parts), plan_impulses(gait))


@check_arguments
def planar_step_to_step(
    robot: PlanarRobot,
    law: PlanarLaw,
    state: Array,
    gains: Array,
    *,
    actuators: Sequence[str],
    windows: int,
    duration: float,
) -> PlanarLaw:
    """Return a law with added torques w = -K (y - y*), latched at the section, in equal windows of a period.

    The torque added in a window rises and falls linearly and has the mean w, so that torques have no jumps.

    Parameters
    ----------
    robot : PlanarRobot
    law : PlanarLaw
        Law without limits and without latched values, to which the torques are added.
    state : (2 n_q,) array
        y* = (q, v) right after the section and the exchange of the legs.
    gains : (windows * number of actuators, 2 n_q) array
        K; in each window the rows follow the order of `actuators`.
    actuators : sequence of str
    windows : int
    duration : float [s]
        Duration of the period.

    Raises
    ------
    InputError
        If the law has limits, latched values or a phase variable, or the gains have another shape.

    Examples
    --------
    >>> from gaitopt.control import passive
    >>> from gaitopt.model import monopod
    >>> law = PlanarLaw("passive", "foot closes", (passive(monopod()),))
    >>> added = planar_step_to_step(
    ...     monopod(), law, np.zeros(10), np.zeros((2, 10)), actuators=["hip"], windows=2, duration=0.4
    ... )
    >>> added.latched, added.parts[0].breakpoints.round(2).tolist()
    (('hip_0', 'hip_1'), [0.0, 0.1, 0.2, 0.3, 0.4])
    """
    if any(part.by_state for part in law.parts):
        raise InputError(
            f"Step-to-step feedback adds torques in intervals of time (windows), but the law {law.name!r} has a phase "
            "variable; add them to the law of the time, and apply by_phase_variable to the result."
        )
    state, gains = np.asarray(state, dtype=float), np.asarray(gains, dtype=float)
    names = [f"{actuator}_{window}" for window in range(windows) for actuator in actuators]
    if law.latched or any(part.limited for part in law.parts):
        raise InputError(f"Step-to-step feedback needs a law without limits or latched values, got {law.name!r}.")
    if state.shape != (2 * robot.n_q,) or gains.shape != (len(names), state.size):
        raise InputError(
            f"Step-to-step feedback needs a state of {2 * robot.n_q} entries and gains of shape "
            f"{(len(names), 2 * robot.n_q)}, got {state.shape} and {gains.shape}."
        )
    places = [robot.actuators.index(actuator) for actuator in actuators]
    selection = np.eye(robot.n_u)[:, places]
    parts = [_add_windows(part, state, gains, names, selection, duration) for part in law.parts]
    named = GainMatrix("K", tuple(names), robot.state_names, parts[0].table.shape[0] - gains.size)
    named_parts = tuple(replace(part, gain_matrices=(named,)) for part in parts)
    return PlanarLaw("step_to_step", law.section, named_parts, law.impulses)


def find_section(gait: PlanarGait) -> str:
    """Return the event that ends the period of a gait.

    Raises
    ------
    InputError
        If the gait is not a solution, or does not end with an impact.
    """
    check_type("gait", gait, PlanarGait, "a PlanarGait such as solve_planar(problem)")
    last = gait.require().motion.events[-1]
    closing = find_closing(last.names)
    if not last.is_impact or not closing:
        raise InputError(
            f"The gait '{gait.sequence}' must end with an impact, at which the clock of a law is reset. "
            f"{_name_remedy(gait)}"
        )
    return f"{closing[0]} {CLOSES}"


def _name_remedy(gait: PlanarGait) -> str:
    """Return what to do with a gait whose last event is not an impact."""
    if any(event.is_impact for event in gait.motion.events):
        return "Solve it with a sequence that begins after its impact, so that '|' is the end of the sequence."
    return "It has no impact, so its multipliers and feedback laws are not available; gaitopt verify replays it."


def select_actuators(gait: PlanarGait, actuators: Sequence[str] | None) -> tuple[str, ...]:
    """Return the actuators with feedback, by default those with a planned torque; raise InputError for an unknown one.

    Examples
    --------
    >>> select_actuators.__name__
    'select_actuators'
    """
    chosen = used_actuators(gait) if actuators is None else tuple(actuators)
    for name in chosen:
        if name not in gait.robot.actuators:
            raise InputError(
                f"Robot {gait.robot.name!r} has no actuator {name!r}. {suggest(name, gait.robot.actuators)}"
            )
    if not chosen:
        raise InputError(f"The gait '{gait.sequence}' has no planned torques; name the actuators of the feedback.")
    return chosen


def _torque_of(robot: PlanarRobot, data: ca.SX, plan: PlanarReference, p: Array | None = None) -> ca.Function:
    """Return the control Function of the planned torques, with joint feedback if p is given."""

    def torque(clock: ca.SX, q: ca.SX, v: ca.SX) -> ca.SX:
        planned = plan.torque(clock, data)
        if p is None:
            return planned
        gains, n_u = data[plan.size :], robot.n_u
        planned_q, planned_v = plan.state(clock, data)
        joints = robot.dynamics(q, v, p)[2].T
        return ca.cse(planned - gains[:n_u] * (joints @ (q - planned_q)) - gains[n_u:] * (joints @ (v - planned_v)))

    return torque_function(robot, data, torque)


def _add_windows(law: Law, state: Array, gains: Array, names: Sequence[str], selection: Array, duration: float) -> Law:
    """Return a part of a law with the torques of step-to-step feedback."""
    windows, size = len(names) // selection.shape[1], gains.size
    inputs = inputs_of(law.control, data=1 + 2 * windows + state.size + size, latched=len(names))
    ends = np.cumsum([0, law.table.shape[0], 1, windows, windows, state.size, size]).tolist()
    inner, start, value, slope, nominal, matrix = ca.vertsplit(inputs.data, ends)
    base, _, _ = law.control(*inputs._replace(latched=ca.SX(0, 1), data=inner))
    share = value + slope * (inputs.clock - start)
    torque = base + selection @ ca.reshape(inputs.latched, selection.shape[1], windows) @ share
    latch = -ca.reshape(matrix, len(names), state.size) @ (ca.vertcat(inputs.q, inputs.v) - nominal)
    corners = np.arange(2 * windows + 1) * duration / (2 * windows)
    finer = law.split(corners)
    numbers = np.concatenate([state, gains.T.ravel()])
    added = [finer.table, *_triangles(finer.breakpoints, corners), np.tile(numbers[:, None], finer.breakpoints.size)]
    return replace(
        finer,
        name="step_to_step",
        control=control_function(inputs, torque),
        table=np.vstack(added),
        memory=make_memory(inputs, latch, values=names),
    )


def _triangles(begins: Array, corners: Array) -> tuple[Array, Array, Array]:
    """Return start, values and slopes of the windows in each piece: triangles of height 2 between the corners."""
    windows, half = corners.size // 2, corners[1]
    values, slopes = np.zeros((windows, begins.size)), np.zeros((windows, begins.size))
    piece = np.floor((begins + 1e-12) / half).astype(int)
    for k, (begin, part) in enumerate(zip(begins, piece, strict=True)):
        if 0 <= part < 2 * windows:
            sign = 1 if part % 2 == 0 else -1
            slopes[part // 2, k] = sign * 2 / half
            values[part // 2, k] = (0 if sign > 0 else 2) + sign * 2 * (begin - part * half) / half
    return begins[None], values, slopes
