"""The fast engine of planar robots: heyoka's Taylor integrator of each contact state, compiled once."""

import functools
from threading import get_ident

import casadi as ca
import numpy as np
from attrs import field, frozen

from gaitopt.model.fast_call import FastCall
from gaitopt.motion.motion import Array
from gaitopt.parameters import positive
from gaitopt.simulation.planar_simulation.planar_engine import REFERENCE, StepIntegrator, StepOutput
from gaitopt.simulation.planar_simulation.planar_phase import RELATIVE, PlanarPhase, make_integrator
from gaitopt.simulation.taylor.compiled_programs import Program
from gaitopt.simulation.taylor.expression_conversion import heyoka_module
from gaitopt.simulation.taylor.mode_integrator import DERIVATIVE_TOLERANCE
from gaitopt.simulation.taylor.planar_programs import (
    PhaseFlow,
    phase_flow,
    planar_program,
    planar_variations,
)

AGREEMENT = 1e-7
"""Largest accepted difference of the rates from those of the reference, relative to the largest rate."""

LIMIT_SAMPLES = 17
"""Number of instants of a step at which a torque is compared with its limits."""


@frozen(kw_only=True)
class PlanarTaylorEngine:
    """Integration of planar robots by Taylor series to machine precision; requires ``pip install 'gaitopt[fast]'``.

    The reference engine integrates what heyoka does not support: torques that are not smooth or reach their limits, and
    phases whose constraints are dependent.

    Attributes
    ----------
    tolerance : float
        Relative truncation error of a step.
    spans : int
        Parts of a Taylor step at whose middles and ends the guards are evaluated.

    Examples
    --------
    >>> PlanarTaylorEngine().name
    'heyoka'
    """

    tolerance: float = field(default=1e-15, validator=positive())
    spans: int = 8
    name = "heyoka"

    def begin(self, phase: PlanarPhase, t: float, y: Array, end: float, relative: float) -> StepIntegrator:
        """See :class:`gaitopt.simulation.planar_simulation.planar_engine.PlanarEngine`."""
        flow = _find_flow(phase)
        if flow is None or not _agrees(flow, phase, t, y):
            return REFERENCE.begin(phase, t, y, end, relative)
        return TaylorSteps(planar_program(flow, self.tolerance, get_ident()), phase, t, y, end)

    def guards(self, phase: PlanarPhase, integrator: StepIntegrator, times: Array, states: Array) -> Array:
        """See :class:`gaitopt.simulation.planar_simulation.planar_engine.PlanarEngine`."""
        flow = _find_flow(phase)
        if flow is None or not _is_taylor_step(integrator):
            return REFERENCE.guards(phase, integrator, times, states)
        n, latched = 2 * phase.n_q, np.array(phase.source.latched)
        y = np.hstack([states[:, :n], np.broadcast_to(latched, (times.size, latched.size))])
        values = _guards(flow, times.size, get_ident())(times, y.ravel(), phase.p, phase.source.data)[0]
        return values.reshape(times.size, -1).copy()

    def locate(self, phase: PlanarPhase, integrator: StepIntegrator, t: float) -> Array:
        """See :class:`gaitopt.simulation.planar_simulation.planar_engine.PlanarEngine`."""
        return integrator.dense_output()(t) if _is_taylor_step(integrator) else REFERENCE.locate(phase, integrator, t)

    def derivative(self, phase: PlanarPhase, span: tuple[float, float], y: Array) -> Array:
        """See :class:`gaitopt.simulation.planar_simulation.planar_engine.PlanarEngine`."""
        flow = _find_flow(phase)
        phase.source.hold_piece((span[0], min(span[1], phase.source.next_corner(span[0]))))
        if flow is None or not _agrees(flow, phase, span[0], y) or not self._stays_within_limits(phase, span, y):
            return REFERENCE.derivative(phase, span, y)
        program = planar_variations(flow, max(self.tolerance, DERIVATIVE_TOLERANCE), get_ident())
        start = np.concatenate([y[: 2 * phase.n_q], phase.source.latched])
        program.begin(start)
        time, end = span
        while time < end:
            corner = min(end, phase.source.next_corner(time))
            phase.source.hold_piece((time, corner))
            program.propagate(phase.p, phase.source.data, start, (time, corner))
            time = corner
        phase.source.hold_piece(None)
        matrix = program.matrix(end - span[0])
        return matrix if np.all(np.isfinite(matrix)) else REFERENCE.derivative(phase, span, y)

    def _stays_within_limits(self, phase: PlanarPhase, span: tuple[float, float], y: Array) -> bool:
        """Return whether Taylor series integrate a time span, in which the torque then does not reach its limits."""
        if phase.source.limits is None:
            return True
        time, end = span
        y = np.concatenate([y[: 2 * phase.n_q], np.zeros(phase.n_works)])
        while time < end:
            corner = min(end, phase.source.next_corner(time))
            phase.source.hold_piece((time, corner))
            integrator = self.begin(phase, time, y, corner, RELATIVE)
            while integrator.status == "running":
                integrator.step()
                if not _is_taylor_step(integrator):
                    return False
            time, y = corner, integrator.y
        phase.source.hold_piece((span[0], min(end, phase.source.next_corner(span[0]))))
        return True


class TaylorSteps:
    """Integrator of a phase by Taylor series, step by step; attributes as in :class:`DormandPrince`.

    Where a Taylor step fails or the torque reaches its limits, the reference engine continues.
    """

    def __init__(self, program: Program, phase: PlanarPhase, t: float, y: Array, end: float) -> None:
        self.t, self.y, self.status = t, y, "running"
        self.t_old, self.y_old = t, y
        self._program, self._phase, self._end = program, phase, end
        start = np.concatenate([y[: 2 * phase.n_q], phase.source.latched])
        self._parameters = program.parameters(phase.p, phase.source.data, start)
        self._coefficients: Array = np.empty(0)
        self._following: StepIntegrator | None = None

    def step(self) -> None:
        """Take one step."""
        if self._following is None and not self._take_taylor_step():
            self._following = make_integrator(self._phase.rates, self.t, self.y, self._end, relative=RELATIVE)
        if self._following is not None:
            following = self._following
            following.step()
            self.t_old, self.y_old, self.t, self.y = following.t_old, following.y_old, following.t, following.y
            self.status = following.status

    def dense_output(self) -> StepOutput:
        """Return the motion within the last step."""
        if self._following is not None:
            return self._following.dense_output()
        return TaylorPolynomial(self.t_old, self.t, self._coefficients)

    @property
    def failed(self) -> bool:
        """Whether a Taylor step has failed."""
        return self._following is not None

    def _take_taylor_step(self) -> bool:
        """Take a step and return True, or return False if its end is not finite."""
        program, integrator = self._program, self._program.integrator
        program.numbers[:], program.state[:], integrator.time = self._parameters, self.y, self.t
        outcome, length = integrator.step(max_delta_t=self._end - self.t, write_tc=True)
        if outcome not in _accepted_outcomes() or length <= 0:
            return False
        end = self._end if outcome == _accepted_outcomes()[1] else self.t + length
        coefficients = integrator.tc.T.copy()
        if _reaches_limits(self._phase, TaylorPolynomial(self.t, end, coefficients)):
            return False
        self.t_old, self.y_old, self._coefficients = self.t, self.y, coefficients
        self.t, self.y = end, program.state.copy()
        if self.t >= self._end:
            self.t, self.status = self._end, "finished"
        return True


class TaylorPolynomial:
    """Taylor polynomial of one step.

    Attributes
    ----------
    t_old, t : float [s]
        Times of the beginning and the end of the step.
    """

    def __init__(self, t_old: float, t: float, coefficients: Array) -> None:
        self.t_old, self.t, self._coefficients = t_old, t, coefficients
        self._exponents = np.arange(len(coefficients))

    def __call__(self, t: float) -> Array:
        """Return the state at a time, shape (n,)."""
        state: Array = (t - self.t_old) ** self._exponents @ self._coefficients
        return state

    def at_times(self, times: Array) -> Array:
        """Return the states at several times, shape (K, n)."""
        states: Array = (times - self.t_old)[:, None] ** self._exponents @ self._coefficients
        return states


@functools.cache
def _accepted_outcomes() -> tuple[object, object]:
    """Return the outcomes of a complete step and of one that ends at the time limit."""
    outcomes = heyoka_module().taylor_outcome
    return outcomes.success, outcomes.time_limit


def _is_taylor_step(integrator: StepIntegrator) -> bool:
    """Return whether the last step of an integrator is one of a Taylor series."""
    return isinstance(integrator, TaylorSteps) and not integrator.failed


def _find_flow(phase: PlanarPhase) -> PhaseFlow | None:
    """Return the explicit equations of a phase; None if heyoka does not support its torque."""
    formula = phase.source.formula
    flow = None if formula is None else phase_flow(phase.equations, formula)
    if flow is None:
        _warn_of_reference()
    return flow


@functools.cache
def _warn_of_reference() -> None:
    """Log once that the reference engine integrates what heyoka does not support."""
    import logging  # whose import takes as long as that of ten other modules

    logging.getLogger("gaitopt").warning(
        "heyoka does not support the torques of this law, or forces of this robot, which contain operations that are "
        "not smooth, such as fabs or if_else. The engine scipy is used, which is slower; tanh and sqrt are supported."
    )


def _agrees(flow: PhaseFlow, phase: PlanarPhase, t: float, y: Array) -> bool:
    """Return whether the elimination solves the equations of motion in a state: constraints may be dependent."""
    n = 2 * phase.n_q
    if not phase.is_regular(t, y):
        return False
    start = np.concatenate([y[:n], phase.source.latched])
    rates = _rates(flow, get_ident())(t, start, phase.p, phase.source.data)[0][:n]
    exact = phase.rates(t, y)[:n]
    return bool(np.max(np.abs(rates - exact)) <= AGREEMENT * (1 + np.max(np.abs(exact))))


def _reaches_limits(phase: PlanarPhase, motion: TaylorPolynomial) -> bool:
    """Return whether the torque of a formula may reach its limits in a step.

    It is sampled; between samples it differs from them by less than their largest second difference.
    """
    source, formula = phase.source, phase.source.formula
    if source.limits is None or formula is None:
        return False
    times, n = np.linspace(motion.t_old, motion.t, LIMIT_SAMPLES), phase.n_q
    states, latched = motion.at_times(times), np.tile(source.latched, LIMIT_SAMPLES)
    inputs = (times, states[:, :n].ravel(), states[:, n : 2 * n].ravel(), latched, source.data)
    torques = _torques(formula, get_ident())(*inputs)[0].reshape(LIMIT_SAMPLES, -1)
    margin = np.max(np.abs(np.diff(torques, 2, axis=0)), axis=0)
    return not bool(np.all(np.max(np.abs(torques), axis=0) + margin < source.limits))


@functools.lru_cache(maxsize=128)
def _torques(formula: ca.Function, thread: int) -> FastCall:
    """Return (times, q, v, latched, data) -> torques at the samples of a step."""
    return FastCall(formula.map("torques", "serial", LIMIT_SAMPLES, [4], []))


@functools.lru_cache(maxsize=128)
def _rates(flow: PhaseFlow, thread: int) -> FastCall:
    return FastCall(flow.rates)


@functools.lru_cache(maxsize=128)
def _guards(flow: PhaseFlow, count: int, thread: int) -> FastCall:
    """Return (times, states, p, data) -> guards at several times."""
    return FastCall(flow.guards.map("guards", "serial", count, [2, 3], []))
