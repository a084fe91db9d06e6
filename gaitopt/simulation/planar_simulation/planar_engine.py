"""Engines that integrate the phases of a planar robot, and the reference engine, DOP853.

An engine provides the flow of a contact state, the guards along it and its derivative.  Location and order of events
(:class:`GuardWatch`) and everything that happens at them are the same for all engines.
"""

from typing import Protocol

import numpy as np
from attrs import frozen

from gaitopt.motion.motion import Array
from gaitopt.simulation.dormand_prince import DormandPrince
from gaitopt.simulation.planar_simulation.planar_phase import PlanarPhase, make_integrator

VARIATION_RELATIVE, VARIATION_ABSOLUTE = 1e-11, 1e-12
"""Tolerances of the integration of the variational equations."""


class StepOutput(Protocol):
    """The motion within a step of an integrator; see :class:`gaitopt.simulation.event_location.DenseOutput`."""

    t_old: float
    t: float

    def __call__(self, t: float) -> Array:
        """Return the state at a time, shape (n,)."""

    def at_times(self, times: Array) -> Array:
        """Return the states at several times, shape (K, n)."""


class StepIntegrator(Protocol):
    """An integrator of a phase, step by step; attributes as in :class:`DormandPrince`."""

    t: float
    y: Array
    t_old: float
    y_old: Array
    status: str

    def step(self) -> None:
        """Take one step."""

    def dense_output(self) -> StepOutput:
        """Return the motion within the last step."""


class PlanarEngine(Protocol):
    """Integrator of the phases of planar robots.

    Engines agree to 1e-9; the choice affects speed, not results.

    Attributes
    ----------
    name : str
    spans : int
        Parts of a step at whose middles and ends the guards are evaluated.
    """

    @property
    def name(self) -> str:
        """Name on the command line."""

    @property
    def spans(self) -> int:
        """Number of spans."""

    def begin(self, phase: PlanarPhase, t: float, y: Array, end: float, relative: float) -> StepIntegrator:
        """Return an integrator of a phase from a state y = (q, v, works) with a relative tolerance.

        The torque's piece is that held at this time; the engine may be more accurate than the tolerance.
        """

    def guards(self, phase: PlanarPhase, integrator: StepIntegrator, times: Array, states: Array) -> Array:
        """Return the guards at times of the last step, shape (K,), in the states, shape (K, n_y); shape (K, n_g)."""

    def locate(self, phase: PlanarPhase, integrator: StepIntegrator, t: float) -> Array:
        """Return the state at a time within the last step, to the accuracy of the integrator."""

    def derivative(self, phase: PlanarPhase, span: tuple[float, float], y: Array) -> Array:
        """Return d (q, v, latched) at the end of a time span / d (q, v, latched) at its beginning, at fixed times.

        Entries are nan if the integration fails.
        """


@frozen
class ReferenceEngine:
    """The integrator DOP853, as SciPy has it.

    Examples
    --------
    >>> ReferenceEngine().name
    'scipy'
    """

    name, spans = "scipy", 4

    def begin(self, phase: PlanarPhase, t: float, y: Array, end: float, relative: float) -> StepIntegrator:
        """See :class:`PlanarEngine`."""
        return make_integrator(phase.rates, t, y, end, relative=relative)

    def guards(self, phase: PlanarPhase, integrator: StepIntegrator, times: Array, states: Array) -> Array:
        """See :class:`PlanarEngine`."""
        return np.array([phase.guards(t, y) for t, y in zip(times.tolist(), states, strict=True)])

    def locate(self, phase: PlanarPhase, integrator: StepIntegrator, t: float) -> Array:
        """Return the state at a time within the last step, integrated from its beginning.

        The dense output is less accurate.
        """
        return phase.integrate(integrator.t_old, integrator.y_old, t)

    def derivative(self, phase: PlanarPhase, span: tuple[float, float], y: Array) -> Array:
        """See :class:`PlanarEngine`."""
        n, n_l = 2 * phase.n_q, len(phase.source.latched)
        shape, matrix = (n, n + n_l), np.eye(n + n_l)

        def rate(t: float, y: Array) -> Array:
            rates, slope, _ = phase.linearise(t, y[:n])
            change = slope[:, :n] @ y[n:].reshape(shape)
            change[:, n:] += slope[:, n:]
            return np.concatenate([rates, change.ravel()])

        time, end = span
        y = np.concatenate([y[:n], np.eye(*shape).ravel()])
        while time < end:
            corner = min(end, phase.source.next_corner(time))
            phase.source.hold_piece((time, corner))
            options = {"relative": VARIATION_RELATIVE, "absolute": VARIATION_ABSOLUTE}
            integrator = DormandPrince(rate, time, y, corner, **options)
            while integrator.status == "running":
                integrator.step()
            if integrator.status == "failed":
                return np.full(matrix.shape, np.nan)
            time, y = integrator.t, integrator.y
        phase.source.hold_piece(None)
        matrix[:n] = y[n:].reshape(shape)
        return matrix


REFERENCE = ReferenceEngine()
"""The engine used by default."""
