"""How the gains of a law move its periodic gait and its multipliers."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from gaitopt.control.law import Law
from gaitopt.control.signature import control_function, inputs_of, make_memory
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.fixed_point import FixedPoint, find_fixed_point
from gaitopt.stability.linearisation import Linearisation
from gaitopt.stability.return_map import ReturnMap

STEP = 1e-3
"""Change of a gain, relative to it or to one, for differences of the return map's derivative."""


@dataclass(frozen=True, eq=False)
class GainSensitivity:
    """Derivatives of a periodic gait by the gains of its law.

    Attributes
    ----------
    gains : tuple of str
    return_map : (n_z, n_gains) array
        Of the return map at the gait, exact: gains are varied along with the state.
    state : (n_z, n_gains) array
        Of the gait's state, exact.
    multipliers : (n_z, n_gains) complex array
        Of the multipliers in the order of ``Cycle.multipliers``, which must differ from each other; by central
        differences of the return map's exact derivative at the periodic gaits of neighbouring gains.
    radius : (n_gains,) array
        Of the spectral radius.

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


def gain_sensitivity(
    cycle: Cycle,
    law: Law,
    *,
    gains: Sequence[str] | None = None,
    engine: Engine | None = None,
) -> GainSensitivity:
    """Return how the gains of a law move its periodic gait of one step and its multipliers.

    Parameters
    ----------
    cycle : Cycle
        As ``assess_stability(gait, law)`` returns it.
    law : Law
    gains : sequence of str, optional
        All of the law's by default.
    engine : Engine, optional

    Raises
    ------
    InputError
        If the law has no such gain, or no periodic gait is found for a neighbouring one.

    Examples
    --------
    >>> from gaitopt import assess_stability, compass_biped, gain_sensitivity, joint_pd, load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> law = joint_pd(compass_biped(), gait.motion, stiffness=20, damping=2)
    >>> found = gain_sensitivity(assess_stability(gait, law), law, gains=["hip_damping"])
    >>> found.multipliers.shape, bool(abs(found.state).max() < 1e-6)  # the plan stays the gait whatever the gains
    ((4, 1), True)
    """
    robot, names = cycle.section.robot, tuple(gains if gains is not None else law.gains)
    for name in names:
        law.with_gains({name: law.gain_values.get(name, 0.0)})  # raises, naming the gains of the law
    _, point = _at(cycle, law, robot, engine)
    lifted = return_map_with(cycle, as_latched(law, names), robot, engine)
    passage = lifted(point.z)
    effect = Linearisation(lifted.walker).effect_of_latched(passage.states[0], passage.strides[0])
    by_gain = effect[cycle.section.places][:, -len(names) :]
    state: Array = np.asarray(np.linalg.solve(np.eye(point.z.size) - point.derivative, by_gain), dtype=float)
    values, vectors = np.linalg.eig(point.derivative.astype(complex))
    order = np.argsort(-np.abs(values))
    values, vectors = values[order], vectors[:, order]
    left = np.linalg.inv(vectors)
    columns = []
    for name in names:
        gain = law.gain_values[name]
        step = STEP * max(abs(gain), 1.0)
        sides = [_at(cycle, law.with_gains({name: gain + sign * step}), robot, engine)[1] for sign in (1, -1)]
        slope = (sides[0].derivative - sides[1].derivative) / (2 * step)
        columns.append(np.einsum("ij,jk,ki->i", left, slope, vectors))
    moved = np.array(columns).T
    largest = values[0]
    radius = (np.conj(largest) * moved[0]).real / max(abs(largest), 1e-300)
    return GainSensitivity(names, by_gain, state, moved, radius)


def as_latched(law: Law, names: Sequence[str]) -> Law:
    """Return the same law with some gains among its latched values, last, so that they can be varied."""
    rows, known = [law.gains[name] for name in names], law.memory
    inputs, count = inputs_of(law.control, latched=len(rows)), len(known.values)
    entries, varied = ca.vertsplit(inputs.data), inputs.latched[count:]
    for k, row in enumerate(rows):
        entries[row] = varied[k]
    seen = inputs._replace(latched=inputs.latched[:count], data=ca.vertcat(*entries))
    torque, bounds, guards = law.control(*seen)
    latch = ca.vertcat(known.latch(inputs.q, inputs.v, inputs.data), inputs.data[rows])
    reset = ca.vertcat(known.reset(*seen[:4], seen.data), ca.repmat(varied, 1, len(known.events)))
    changed = make_memory(inputs, latch, values=[*known.values, *names], events=known.events, reset=reset)
    return replace(law, control=control_function(inputs, torque, bounds=bounds, guards=guards), memory=changed)


def return_map_with(cycle: Cycle, law: Law, robot: Robot, engine: Engine | None) -> ReturnMap:
    """Return the return map of a cycle's section under another law."""
    return ReturnMap(make_walker(robot, law, cycle.parameters, period=cycle.period, engine=engine), cycle.section)


def _at(cycle: Cycle, law: Law, robot: Robot, engine: Engine | None) -> tuple[ReturnMap, FixedPoint]:
    returning = return_map_with(cycle, law, robot, engine)
    point = find_fixed_point(returning, cycle.z)
    if point is None:
        raise InputError("No periodic gait was found for gains next to these.")
    return returning, point
