"""The reference engine: the integrator DOP853, as SciPy has it, with event location on its dense output."""

import functools
from collections.abc import Iterator

import casadi as ca
import numpy as np
from attrs import field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.locks import one_at_a_time
from gaitopt.model.contacts.event import SINGULAR
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.fast_call import FastCall
from gaitopt.motion.motion import Array
from gaitopt.parameters import positive, whole_number
from gaitopt.simulation.active_piece import ActivePiece
from gaitopt.simulation.closed_loop import ClosedLoop
from gaitopt.simulation.dormand_prince import DormandPrince, StepPolynomial
from gaitopt.simulation.engine import Arc
from gaitopt.simulation.event_location import DenseOutput, EventWatch, middle_of, spans_of


@check_arguments
@frozen(kw_only=True)
class ScipyEngine:
    """Event-driven integration by DOP853 (order 8), as in SciPy, with guards monitored inside every integrator step.

    Attributes
    ----------
    relative, absolute : float
        Integration tolerances.
    samples : int
        Points per integrator step at which guards are checked and the motion is sampled.

    Examples
    --------
    >>> ScipyEngine().name
    'scipy'
    """

    relative: float = field(default=1e-12, validator=positive())
    absolute: float = field(default=1e-14, validator=positive())
    samples: int = field(default=4, validator=whole_number())
    name = "scipy"

    def flow(
        self, loop: ClosedLoop, mode: Mode, clock: float, state: Array, *, until: float, record: bool = False
    ) -> Arc:
        """Integrate one contact mode; see :class:`gaitopt.simulation.engine.Engine`."""
        equations, p = loop.equations(mode), loop.p
        n_y, event = loop.size, None
        start = np.concatenate([state, np.zeros(loop.robot.n_works)]) if record else np.array(state, dtype=float)
        times, states, current = [clock], [start], np.concatenate(([clock], start[:n_y]))
        active = ActivePiece(loop.law, current)
        active.begin()
        functions, memory = (equations.flow, equations.energy) if record else (equations.flow,), np.zeros(1 + n_y)
        rates = [FastCall(function, p, active.data, shared=memory) for function in functions]
        watch = EventWatch(equations, p, active.data, clock, start)
        while times[-1] < until and event is None:
            end = active.end(until)
            watch.restart(active.data, times[-1], states[-1])
            for call in rates:
                call.fix(p, active.data)
            for dense, span in self._spans(rates, memory, times[-1], end, states[-1]):
                event, at = watch.first(dense, span)
                times.append(at)
                states.append(dense(at) if at > span[0] else states[-1])
                if event is not None:
                    break
            if event is None and times[-1] < end:
                event = SINGULAR  # the integrator cannot continue
            current[0], current[1:] = times[-1], states[-1][:n_y]
            event = active.advance(event)
        time, path = np.array(times), np.array(states).T
        if not record:
            return Arc(time[[0, -1]], path[:, [0, -1]], event)
        return Arc(time, path[:n_y], event, path[n_y:])

    def sensitivity(self, loop: ClosedLoop, mode: Mode, clock: float, state: Array, *, until: float) -> Array:
        """Integrate the variational equations along exactly the path that :meth:`flow` follows.

        Near the Painleve paradox the derivative is so large that a path with other steps, within the tolerance of this
        one, would be too inaccurate.  See :class:`gaitopt.simulation.engine.Engine`.
        """
        equations, p, n_y = loop.equations(mode), loop.p, loop.size
        y, matrix = np.array(state, dtype=float), np.eye(n_y)
        current, before, event, reached = np.concatenate(([clock], y)), None, None, clock
        active = ActivePiece(loop.law, current)
        active.begin()
        while reached < until and event is None:
            end, data = active.end(until), active.data
            memory = np.zeros(1 + n_y)
            flow = FastCall(equations.flow, p, data, shared=memory)
            slope = FastCall(_slope(equations.flow), p, data)
            if before is not None:
                matrix += np.outer(before - flow(reached, y)[0], loop.piece_shift(before) @ matrix)
            watch = EventWatch(equations, p, data, reached, y, law_only=True)
            for dense in self._steps([flow], memory, reached, end, y):
                event, reached = watch.first_in_step(dense, self.samples)
                matrix, y = self._integrate_variations(slope, dense, reached, matrix), dense(reached)
                if event is not None or not np.all(np.isfinite(matrix)):
                    break
            if event is None and (reached < end or not np.all(np.isfinite(matrix))):
                return np.full((n_y, n_y), np.nan)
            before = flow(reached, y)[0].copy()
            current[0], current[1:] = reached, y
            event = active.advance(event)
        return matrix

    def _integrate_variations(self, slope: FastCall, dense: DenseOutput, end: float, matrix: Array) -> Array:
        """Return the solution of the variational equations at a time in a step of the path; nan if it diverges."""
        shape, begin = matrix.shape, dense.t_old
        if end <= begin:
            return matrix

        def rate(t: float, flat: Array) -> Array:
            return (slope(t, dense(t))[0].reshape(shape).T @ flat.reshape(shape)).ravel()  # CasADi stores by column

        options = {"relative": self.relative, "absolute": self.absolute}
        integrator = DormandPrince(rate, begin, matrix.ravel(), end, first_step=end - begin, **options)
        while integrator.status == "running":
            integrator.step()
        return integrator.y.reshape(shape) if integrator.status == "finished" else np.full(shape, np.nan)

    def _spans(
        self, rates: list[FastCall], memory: Array, begin: float, end: float, start: Array
    ) -> Iterator[tuple[StepPolynomial, tuple[float, float]]]:
        """Yield the dense output of the integrator with each of the spans into which its steps are divided."""
        for dense in self._steps(rates, memory, begin, end, start):
            spans = spans_of(dense, self.samples)
            dense.tabulate([t for span in spans for t in (middle_of(span), span[1])])
            for span in spans:
                yield dense, span

    def _steps(
        self, rates: list[FastCall], memory: Array, begin: float, end: float, start: Array
    ) -> Iterator[StepPolynomial]:
        """Yield the dense output of each step of the integrator, until the end or until the integrator fails.

        `memory` is that of the inputs of all rates: time and state, without the works.
        """
        n_y = memory.size - 1

        def rate(t: float, y: Array) -> Array:
            memory[0], memory[1:] = t, y[:n_y]
            return np.concatenate([function.evaluate() for function in rates])

        if not np.all(np.isfinite(rate(begin, start))):
            return
        integrator = DormandPrince(rate, begin, start, end, relative=self.relative, absolute=self.absolute)
        while integrator.status == "running":
            integrator.step()
            if integrator.status == "failed":
                return
            yield integrator.dense_output()


@functools.lru_cache(maxsize=128)
@one_at_a_time
def _slope(flow: ca.Function) -> ca.Function:
    """Return (t, y, p, data) -> derivative of a flow by y."""
    t, y, p, data = flow.sx_in()
    return ca.Function("slope", [t, y, p, data], [ca.densify(ca.jacobian(flow(t, y, p, data), y))])
