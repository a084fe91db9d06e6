"""Sensitivity of a periodic gait and its multipliers to the gains of its law."""

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.control.signature import control_function, inputs_of, make_memory
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, NoGaitError
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.fixed_point import FixedPoint, find_fixed_point
from gaitopt.stability.linearisation import Linearisation
from gaitopt.stability.return_map import ReturnMap

RELATIVE_STEP = 1e-3
"""Change of a gain, relative to max(abs(gain), 1), in differences of the return map's derivative."""


@dataclass(frozen=True, eq=False)
class GainSensitivity:
    """Derivatives of a periodic gait with respect to the gains of its law.

    Attributes
    ----------
    gains : tuple of str
    return_map : (n_z, n_gains) array
        Exact derivatives of the return map at the gait, from variational equations that include the gains.
    state : (n_z, n_gains) array
        Exact derivatives of the gait's state.
    multipliers : (n_z, n_gains) complex array
        Derivatives of the multipliers, which must be distinct, in the order of ``Cycle.multipliers``, by central
        differences of the return map's exact derivative at the periodic gaits of neighbouring gains.
    radius : (n_gains,) array
        Derivatives of the spectral radius.

    Examples
    --------
    >>> GainSensitivity(("a",), np.ones((1, 1)), np.ones((1, 1)), np.ones((1, 1), complex), np.ones(1)).gains
    ('a',)
    """

    gains: tuple[str, ...]
    return_map: Array
    state: Array
    multipliers: NDArray[np.complex128]
    radius: Array


@check_arguments
def gain_sensitivity(
    cycle: Cycle,
    law: Law,
    *,
    gains: Sequence[str] | None = None,
    engine: Engine | None = None,
) -> GainSensitivity:
    """Return the sensitivity of a periodic gait of one step and its multipliers to the gains of its law.

    Parameters
    ----------
    cycle : Cycle
        Result of ``assess_stability(gait, law)``.
    law : Law
    gains : sequence of str, optional
        All gains of the law by default.
    engine : Engine, optional

    Raises
    ------
    InputError
        If the law has no such gain, or no periodic gait is found for a neighbouring gain.

    Examples
    --------
    >>> from gaitopt import assess_stability, compass_biped, gain_sensitivity, joint_pd, load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> law = joint_pd(compass_biped(), gait.motion, stiffness=20, damping=2)
    >>> sensitivity = gain_sensitivity(assess_stability(gait, law), law, gains=["hip_damping"])
    >>> sensitivity.multipliers.shape, bool(abs(sensitivity.state).max() < 1e-6)  # the gait does not depend on the gain
    ((4, 1), True)
    """
    robot, names = cycle.section.robot, tuple(gains if gains is not None else law.gains)
    if not names:
        raise InputError(f"The sensitivity to gains needs a law with gains, got the law {law.name!r} without gains.")
    for name in names:
        law.with_gains({name: law.gain_values.get(name, 0.0)})  # raises InputError with the gains of the law
    point = _find_neighbour(cycle, law, robot, engine)
    extended = return_map_with(cycle, latch_gains(law, names), robot, engine)
    passage = extended(point.z)
    effect = Linearisation(extended.walker).latched_effect(passage.states[0], passage.walk_steps[0])
    by_gain = effect[cycle.section.places][:, -len(names) :]
    state: Array = np.asarray(np.linalg.solve(np.eye(point.z.size) - point.derivative, by_gain), dtype=float)
    values, vectors = np.linalg.eig(point.derivative.astype(complex))
    order = np.argsort(-np.abs(values))
    values, vectors = values[order], vectors[:, order]
    left = np.linalg.inv(vectors)
    columns = []
    for name in names:
        gain = law.gain_values[name]
        step = RELATIVE_STEP * max(abs(gain), 1.0)
        sides = [_find_neighbour(cycle, law.with_gains({name: gain + sign * step}), robot, engine) for sign in (1, -1)]
        slope = (sides[0].derivative - sides[1].derivative) / (2 * step)
        columns.append(np.einsum("ij,jk,ki->i", left, slope, vectors))
    multiplier_slopes = np.array(columns).T
    largest = values[0]
    radius = (np.conj(largest) * multiplier_slopes[0]).real / max(abs(largest), 1e-300)
    return GainSensitivity(names, by_gain, state, multiplier_slopes, radius)


def latch_gains(law: Law, names: Sequence[str]) -> Law:
    """Return the same law with some gains as its last latched values, for derivatives with respect to them."""
    rows, known = [law.gains[name] for name in names], law.memory
    inputs, count = inputs_of(law.control, latched=len(rows)), len(known.values)
    entries, varied = ca.vertsplit(inputs.data), inputs.latched[count:]
    for k, row in enumerate(rows):
        entries[row] = varied[k]
    inner_inputs = inputs._replace(latched=inputs.latched[:count], data=ca.vertcat(*entries))
    torque, bounds, guards = law.control(*inner_inputs)
    latch = ca.vertcat(known.latch(inputs.q, inputs.v, inputs.data), inputs.data[rows])
    reset = ca.vertcat(known.reset(*inner_inputs[:4], inner_inputs.data), ca.repmat(varied, 1, len(known.events)))
    memory = make_memory(inputs, latch, values=[*known.values, *names], events=known.events, reset=reset)
    return replace(law, control=control_function(inputs, torque, bounds=bounds, guards=guards), memory=memory)


def return_map_with(cycle: Cycle, law: Law, robot: Robot, engine: Engine | None) -> ReturnMap:
    """Return the return map of a cycle's section under another law."""
    return ReturnMap(make_walker(robot, law, cycle.parameters, period=cycle.period, engine=engine), cycle.section)


def _find_neighbour(cycle: Cycle, law: Law, robot: Robot, engine: Engine | None) -> FixedPoint:
    """Return the fixed point of a cycle's return map under another law."""
    point = find_fixed_point(return_map_with(cycle, law, robot, engine), cycle.z)
    if point is None:
        raise NoGaitError(
            f"No periodic gait was found under the law {law.name!r} with gains near {law.gain_values}; the sensitivity "
            "needs one for neighbouring gains."
        )
    return point
