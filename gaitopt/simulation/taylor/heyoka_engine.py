"""The fast engine: heyoka's Taylor integrator with events, compiled from the Functions every engine runs."""

from threading import get_ident

import numpy as np
from attrs import field, frozen

from gaitopt.model.contacts.event import HybridEvent
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion import Array
from gaitopt.parameters import positive, whole_number
from gaitopt.simulation.closed_loop import ClosedLoop
from gaitopt.simulation.engine import Arc
from gaitopt.simulation.taylor.compiled_programs import program_with_outputs, program_with_variations
from gaitopt.simulation.taylor.mode_integrator import ModeIntegrator, mode_integrator


@frozen(kw_only=True)
class HeyokaEngine:
    """Event-driven integration by Taylor series, to the last digits and fast; needs ``pip install 'gaitopt[fast]'``.

    Attributes
    ----------
    tolerance : float
        Relative truncation error of a step.
    compact_mode : bool
        Whether less code is compiled to integrate and watch guards: in 0.4 s per contact mode, once on a machine,
        instead of 1.5 s (much more for larger robots), but running a third slower.
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
        phase = mode_integrator(loop.robot, loop.law, mode, loop.key, self.tolerance, self.compact_mode, get_ident())
        here = phase.here
        here[0], here[1:] = clock, state
        if record:
            tape = _Tape(phase, self.tolerance, self.samples)
            return tape.arc(phase.walk(until, tape.add))
        ends = np.empty((2, here.size))
        ends[0] = here
        event = phase.walk(until)
        ends[1] = here
        return Arc(ends[:, 0], ends[:, 1:].T, event)

    def sensitivity(self, loop: ClosedLoop, mode: Mode, clock: float, state: Array, *, until: float) -> Array:
        """Integrate the variational equations; see :class:`gaitopt.simulation.engine.Engine`."""
        robot = loop.robot
        phase = mode_integrator(robot, loop.law, mode, loop.key, self.tolerance, self.compact_mode, get_ident())
        program = program_with_variations(robot, mode, phase.control, self.tolerance, get_ident())
        n, y = len(program.entries), np.array(state, dtype=float)
        program.state[:n], program.state[n:] = y[program.entries], np.eye(n).ravel()
        within = np.ix_(program.entries, program.entries)
        for column, begin, end, jump in phase.stretches(clock, y, until):
            if jump is not None:
                program.state[n:] = (jump[within] @ program.state[n:].reshape(n, n)).ravel()
            program.numbers[:] = program.row(loop.p, column, y)
            program.integrator.time = begin
            program.integrator.propagate_until(end)
        # Entries at rest drift at their own constant rate, which is zero here but may be varied.
        matrix = np.eye(y.size)
        matrix[: robot.n_q, robot.n_q : 2 * robot.n_q] = max(until - clock, 0) * np.eye(robot.n_q)
        matrix[program.entries] = 0
        matrix[within] = program.state[n:].reshape(n, n)
        return matrix


class _Tape:
    """Samples of an arc and its energies, taken piece by piece once it is known where each ends."""

    def __init__(self, phase: ModeIntegrator, tolerance: float, samples: int) -> None:
        self._phase, self._samples, here = phase, samples, phase.here
        self._program = program_with_outputs(
            phase.loop.robot, phase.equations.mode, phase.control, tolerance, get_ident()
        )
        self._times, self._states = [here[:1].copy()], [here[1:, None].copy()]
        self._energies = [np.zeros((phase.loop.robot.n_u + 1, 1))]

    def add(self, column: Array, start: Array, end: Array, steps: int) -> None:
        """Add a stretch between two (clock, state) with its data, which took some Taylor steps."""
        program, n, reached = self._program, len(self._program.entries), self._energies[-1][:, -1]
        # However short a stretch, its work counts; in a very short one, samples between its ends would coincide.
        count = self._samples * steps if end[0] - start[0] > 1e-9 else 1
        grid = np.linspace(start[0], end[0], 1 + count)
        states, energies = (np.tile(part[:, None], grid.size) for part in (start[1:], reached))
        if end[0] > start[0]:
            program.numbers[:] = program.row(self._phase.loop.p, column, start[1:])
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
        """Return what was recorded, at least two samples."""
        if len(self._times) == 1:
            self._times, self._states, self._energies = 2 * self._times, 2 * self._states, 2 * self._energies
        return Arc(
            np.concatenate(self._times),
            np.concatenate(self._states, axis=1),
            event,
            np.concatenate(self._energies, axis=1),
        )
