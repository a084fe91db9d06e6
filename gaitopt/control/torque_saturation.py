"""Torque limits of a law.

A torque has a kink where it reaches its limit, which an integrator should not step over.  A law with limits therefore
has a second form with the *side* of each actuator as a number: 0 while the actuator applies the demanded torque, 1 or
-1 while it is at a limit.
"""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.control.signature import LawInputs, control_function, inputs_of, rewrite_memory
from gaitopt.errors import InputError, suggest
from gaitopt.locks import one_at_a_time
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.parameters import Parameter

UNLIMITED = 1e9
"""Limit [N m] of an unlimited actuator of a robot with other, limited actuators."""


@check_arguments
def torque_limits(robot: Robot | PlanarRobot, limits: float | Mapping[str, float]) -> Array:
    """Return the limit of each actuator [N m], shape (n_u,); empty if none is limited.

    Raises
    ------
    InputError
        If a limit is not positive or its name is not that of an actuator.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> torque_limits(compass_biped(), {"ankle": 5.0, "hip": 8.0}).tolist()
    [5.0, 8.0]
    """
    by_name = dict(limits) if isinstance(limits, Mapping) else dict.fromkeys(robot.actuators, limits)
    for name in by_name:
        if name not in robot.actuators:
            raise InputError(f"torque_limit: there is no actuator {name!r}. {suggest(name, robot.actuators)}")
    values = [
        Parameter(f"torque_limit of {name}", np.inf, "N m", "", lower=0.0, lower_open=True, infinite=True).check(
            by_name.get(name, np.inf)
        )
        for name in robot.actuators
    ]
    return np.minimum(values, UNLIMITED) if np.any(np.isfinite(values)) else np.zeros(0)


@check_arguments
def limit_torque(law: Law, limits: Array) -> Law:
    """Return the law with torque limits [N m], shape (n_u,), or the law itself if `limits` is empty.

    Raises
    ------
    InputError
        If the law already has limits, or the limits are not one positive number for each actuator.

    Examples
    --------
    >>> from gaitopt import compass_biped, push_off
    >>> robot = compass_biped()
    >>> limit_torque(push_off(robot, torque=-9.0, duration=0.1), torque_limits(robot, 6.0)).limited
    True
    """
    limits = np.asarray(limits, dtype=float)
    if not limits.size:
        return law
    if law.limited:
        raise InputError(f"The law {law.name!r} already has torque limits; use a law without limits.")
    if limits.shape != (law.control.size1_out(0),) or not np.all(limits > 0):
        count = law.control.size1_out(0)
        raise InputError(
            f"limits must be {count} positive numbers [N m], one for each actuator, got {limits.tolist()}."
        )
    inputs = inputs_of(law.control, data=limits.size)
    table = np.vstack([law.table, np.tile(limits[:, None], law.breakpoints.size)])
    return _rewrite_law(law, inputs, inputs.data[: law.table.shape[0]], table, limited=True)


def remove_limits(law: Law) -> tuple[Law, Array]:
    """Return the law without its limits, and the limits [N m], shape (n_u,), empty for a law without limits."""
    if not law.limited:
        return law, np.zeros(0)
    count = law.control.size1_out(0)
    rows, inputs = law.table.shape[0] - count, inputs_of(law.control, data=-count)
    data = ca.vertcat(inputs.data, ca.SX.zeros(count))
    return _rewrite_law(law, inputs, data, law.table[:rows], limited=False), law.table[rows:, 0]


def name_limits(law: Law | PlanarLaw, actuators: Sequence[str]) -> dict[str, float]:
    """Return the torque limits of a law [N m, or N for a force] by actuator, without unlimited actuators.

    Examples
    --------
    >>> from gaitopt import compass_biped, push_off
    >>> robot = compass_biped()
    >>> name_limits(push_off(robot, torque=-9.0, duration=0.1, torque_limit={"hip": 8.0}), robot.actuators)
    {'hip': 8.0}
    """
    part = law.parts[0] if isinstance(law, PlanarLaw) else law
    if not part.limited:
        return {}
    values = part.table[-len(actuators) :, 0].tolist()
    return {name: value for name, value in zip(actuators, values, strict=True) if value < UNLIMITED}


def _rewrite_law(law: Law, inputs: LawInputs, data: ca.SX, table: Array, limited: bool) -> Law:
    """Return a law in new symbols, with its data as an expression of them and a new table."""
    inner_inputs = inputs._replace(data=data)
    torque, bounds, guards = law.control(*inner_inputs)
    control = control_function(inputs, torque, bounds=bounds, guards=guards)
    return replace(
        law, control=control, memory=rewrite_memory(law.memory, inputs, inner_inputs), table=table, limited=limited
    )


@functools.lru_cache(maxsize=128)
@one_at_a_time
def split_at_limits(control: ca.Function) -> ca.Function:
    """Return the Function of a law with limits in which the side of each actuator is a number.

    Its bounds stay positive while no actuator changes its side; those of `control` come last.  Its data are those of
    `control` followed by the side of each actuator.

    Parameters
    ----------
    control : Function
        As in :class:`gaitopt.Law`, of a law with limits.
    """
    n_u = control.size1_out(0)
    inputs = inputs_of(control, data=n_u)
    inner, side = inputs.data[:-n_u], inputs.data[-n_u:]
    demand, bounds, guards = control(*inputs._replace(data=inner))
    limits, free, at_limit = inner[-n_u:], 1 - side**2, side**2
    torque = free * demand + side * limits
    beyond = free * (limits - demand) + at_limit * (side * demand - limits)
    below = free * (limits + demand) + at_limit
    return control_function(inputs, torque, bounds=ca.vertcat(beyond, below, bounds), guards=guards)
