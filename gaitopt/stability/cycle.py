"""Periodic gaits of a walker: state, contact sequence, multipliers, energy and critical friction."""

import textwrap
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.lazy import Deferred, LazyField, LazyRecord
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.energy import Ledger, ledger
from gaitopt.motion.motion import Array, Motion
from gaitopt.reductions import worst
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.simulator import record_walk
from gaitopt.stability.critical_friction import CriticalFriction, critical_friction
from gaitopt.stability.fixed_point import FixedPoint
from gaitopt.stability.one_sided import one_sided_derivatives
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section


@dataclass(frozen=True, eq=False, kw_only=True)
class Cycle(LazyRecord):
    """A periodic gait and its stability.

    Attributes
    ----------
    robot : str
    parameters : dict of str to float
        SI units, slope and friction included.
    sequences : tuple of ContactSequence
        Contact sequence of each step of the period.
    section : Section
    z : (n_z,) array
        Point of the gait on the section.
    points : tuple of (n_z,) arrays
        Start of each step of the period, `z` first.
    period : float [s]
    travel : float [m]
        Forward travel over the period, foot slide included.
    derivative : (n_z, n_z) array
        Derivative of the return map over the period.
    multipliers : (n_z,) complex array
        Floquet multipliers: eigenvalues of `derivative`, largest modulus first.
    one_sided : tuple of (m, m) arrays
        Derivatives on the sticking and on the slipping side if the impulse lies on the boundary of the friction cone;
        otherwise empty.
    residual : float
        Largest entry of P(z) - z.
    drift : float [m/s]
        Change of the foot speed over the period: 0 unless the gait slips throughout (relative periodicity).
    critical_friction : CriticalFriction or None
        None if the gait slips; evaluated when it is first read.
    impact_ratio : float
        Impulse ratio of the last touchdown.
    energy : Ledger
        Energy ledger of the period [J].
    engine : str
    motion : Motion
        The period.

    Examples
    --------
    >>> import math
    >>> from gaitopt import find_cycles, rimless_wheel
    >>> gait = find_cycles(rimless_wheel(), {"slope": math.radians(13)}, starts=10)[0]
    >>> gait.sequence, gait.stable, list(gait.state)
    ('stick | stick', True, ['theta_rate'])
    """

    robot: str
    parameters: dict[str, float]
    sequences: tuple[ContactSequence, ...]
    section: Section
    z: Array
    points: tuple[Array, ...]
    period: float
    travel: float
    derivative: Array
    multipliers: NDArray[np.complex128]
    one_sided: tuple[Array, ...]
    residual: float
    drift: float
    critical_friction: LazyField[CriticalFriction | None] = LazyField()
    impact_ratio: float
    energy: Ledger
    engine: str
    motion: Motion = field(repr=False)

    def __repr__(self) -> str:
        sequence = textwrap.shorten(self.sequence, 80, placeholder=" ...")
        verdict = f"{'stable' if self.stable else 'unstable'}, spectral radius {self.radius:.6g}"
        return f"Cycle({self.robot!r}, '{sequence}', {verdict}, period {self.period:.6g} s, travel {self.travel:.6g} m)"

    @property
    def sequence(self) -> str:
        """The contact sequences of the period, joined by ``"; "``."""
        return "; ".join(str(sequence) for sequence in self.sequences)

    @property
    def state(self) -> dict[str, float]:
        """The gait's point on the section by name."""
        values = dict(zip(self.section.names, self.z.tolist(), strict=True))
        return values if self.section.sliding or not self.drift else values | {"foot_speed": self.section.foot_speed}

    @property
    def one_sided_multipliers(self) -> tuple[NDArray[np.complex128], ...]:
        """Multipliers on the sticking and on the slipping side of the cone's boundary; empty in its interior."""
        return tuple(_eigenvalues(matrix) for matrix in self.one_sided)

    @property
    def radius(self) -> float:
        """Spectral radius: the largest modulus of a multiplier, on both sides if one-sided."""
        sides = (self.multipliers, *self.one_sided_multipliers)
        return worst(0.0, *(np.abs(values) for values in sides))

    @property
    def stable(self) -> bool:
        """Whether all multipliers lie inside the unit circle, on both sides if one-sided."""
        return self.radius < 1


def slips_throughout(modes: tuple[Mode, ...], impact: Mode | None) -> bool:
    """Return whether a step slips in one direction from impact to impact (complete slip)."""
    return len(modes) == 1 and modes[0].slips and impact is modes[0]


def _eigenvalues(matrix: Array) -> NDArray[np.complex128]:
    """Return the eigenvalues of a matrix; nan if an entry is not finite."""
    if not np.all(np.isfinite(matrix)):
        return np.full(matrix.shape[0], np.nan, dtype=complex)
    return np.linalg.eigvals(matrix).astype(complex)


def make_cycle(walker: Walker, return_map: ReturnMap, point: FixedPoint) -> Cycle:
    """Return the periodic gait of a fixed point with its derived quantities.

    A gait whose impacts stick, or that slips throughout, is described on the section without foot speed.
    """
    last = point.passage.walk_steps[-1]
    if last.impact is None or last.following is None:
        raise InputError("Every step of a gait must end in a touchdown; the last of these steps has none.")
    section, z, derivative = return_map.section, point.z, point.derivative
    speed = walker.robot.state_entries.slip_velocity
    if section.sliding and all(s.impact is not None and s.impact.mode is Mode.STICK for s in point.passage.walk_steps):
        section, z, derivative = Section(walker.robot, walker.p, sliding=False), z[:-1], derivative[:-1, :-1]
    motion = record_walk(walker, point.passage.states[0], return_map.steps).motion
    sequences = tuple(sequence for step in range(return_map.steps) if (sequence := motion.sequence(step)) is not None)
    eigenvalues = _eigenvalues(derivative)
    sticks = all(mode is Mode.STICK for walk_step in point.passage.walk_steps for mode in walk_step.modes)
    return Cycle(
        robot=walker.robot.name,
        parameters=motion.parameters,
        sequences=sequences,
        section=section,
        z=z,
        points=tuple(section.project(state) for state in point.passage.states),
        period=motion.period,
        travel=motion.travel,
        derivative=derivative,
        multipliers=eigenvalues[np.argsort(-np.abs(eigenvalues))],
        one_sided=one_sided_derivatives(walker, point.passage.states[0], last) if return_map.steps == 1 else (),
        residual=point.residual,
        drift=0.0
        if not slips_throughout(last.modes, last.impact.mode)
        else float(last.following[speed] - point.passage.states[0][speed]),
        critical_friction=Deferred(lambda: critical_friction(walker, point.passage)) if sticks else None,
        impact_ratio=float(last.impact.impulse[0] / last.impact.impulse[1]),
        energy=ledger(motion),
        engine=walker.engine.name,
        motion=motion,
    )
