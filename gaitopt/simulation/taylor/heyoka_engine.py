"""The fast engine: heyoka's Taylor integrator with events, compiled from the Functions that every engine uses."""

from threading import get_ident

import numpy as np
from attrs import field, frozen

from gaitopt.model.contacts.event import HybridEvent
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion import Array
from gaitopt.parameters import positive, whole_number
from gaitopt.simulation.closed_loop import ClosedLoop
from gaitopt.simulation.engine import Arc
from gaitopt.simulation.taylor.compiled_programs import program_with_outputs
from gaitopt.simulation.taylor.mode_integrator import ModeIntegrator, mode_integrator


@frozen(kw_only=True)
class HeyokaEngine:
    """Event-driven integration by Taylor series to machine precision; requires ``pip install 'gaitopt[fast]'``.

    Attributes
    ----------
    tolerance : float
        Relative truncation error of a step.
    compact_mode : bool
        Whether to compile less code: compilation takes 0.4 s per contact mode, once on a machine, instead of 1.5 s
        (much longer for larger robots), but integration is a third slower.
    samples : int
        Points per Taylor step at which a recorded motion is sampled.

    Examples
    --------
    >>> HeyokaEngine().name
    'heyoka'
    """

    tolerance: float = field(default=1e-15, validator=positive())
    compact_mode: bool = True
    samples: int = field(default=8, validator=whole_number())
    name = "heyoka"

    def flow(
        self, loop: ClosedLoop, mode: Mode, clock: float, state: Array, *, until: float, record: bool = False
    ) -> Arc:
        """Integrate one contact mode; see :class:`gaitopt.simulation.engine.Engine`."""
        integrator = mode_integrator(
            loop.robot, loop.law, mode, loop.key, self.tolerance, self.compact_mode, get_ident()
        )
        current = integrator.current
        current[0], current[1:] = clock, state
        if record:
            recorder = _Recorder(integrator, self.tolerance, self.samples)
            return recorder.arc(integrator.walk(until, recorder.add))
        ends = np.empty((2, current.size))
        ends[0] = current
        event = integrator.walk(until)
        ends[1] = current
        return Arc(ends[:, 0], ends[:, 1:].T, event)

    def sensitivity(self, loop: ClosedLoop, mode: Mode, clock: float, state: Array, *, until: float) -> Array:
        """Integrate the variational equations; see :class:`gaitopt.simulation.engine.Engine`."""
        integrator = mode_integrator(
            loop.robot, loop.law, mode, loop.key, self.tolerance, self.compact_mode, get_ident()
        )
        variations, y = integrator.variations, np.array(state, dtype=float)
        variations.begin(y)
        for column, begin, end, jump in integrator.intervals(clock, y, until):
            if jump is not None:
                variations.apply(jump)
            variations.propagate(loop.p, column, y, (begin, end))
        return variations.matrix(max(until - clock, 0))


class _Recorder:
    """Samples of an arc and its energies, computed for each piece when its end is known."""

    def __init__(self, integrator: ModeIntegrator, tolerance: float, samples: int) -> None:
        self._integrator, self._samples, current = integrator, samples, integrator.current
        self._program = program_with_outputs(
            integrator.loop.robot, integrator.equations.mode, integrator.control, tolerance, get_ident()
        )
        self._times, self._states = [current[:1].copy()], [current[1:, None].copy()]
        self._energies = [np.zeros((integrator.loop.robot.n_works, 1))]

    def add(self, column: Array, start: Array, end: Array, steps: int) -> None:
        """Add an interval between two (clock, state) with its data and its number of Taylor steps."""
        program, n, reached = self._program, len(self._program.entries), self._energies[-1][:, -1]
        # The work of very short intervals counts too, but samples between their ends would coincide.
        count = self._samples * steps if end[0] - start[0] > 1e-9 else 1
        grid = np.linspace(start[0], end[0], 1 + count)
        states, energies = (np.tile(part[:, None], grid.size) for part in (start[1:], reached))
        if end[0] > start[0]:
            program.numbers[:] = program.parameters(self._integrator.loop.p, column, start[1:])
            program.state[:n], program.state[n:] = start[1:][program.entries], reached
            program.integrator.time = start[0]
            values = program.integrator.propagate_grid(grid)[-1].T
            grid, states, energies = (part[..., : values.shape[1]] for part in (grid, states, energies))
            states[program.entries], energies[:] = values[:n], values[n:]
        grid[-1], states[:, -1] = end[0], end[1:]
        self._times.append(grid[1:])
        self._states.append(states[:, 1:])
        self._energies.append(energies[:, 1:])

    def arc(self, event: HybridEvent | None) -> Arc:
        """Return the recorded arc, with at least two samples."""
        if len(self._times) == 1:
            self._times, self._states, self._energies = 2 * self._times, 2 * self._states, 2 * self._energies
        return Arc(
            np.concatenate(self._times),
            np.concatenate(self._states, axis=1),
            event,
            np.concatenate(self._energies, axis=1),
        )
