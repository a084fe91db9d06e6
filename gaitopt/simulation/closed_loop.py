"""A robot under a law in one contact mode, as numbers in and numbers out.

The state is y = (q, v, work of each actuator, friction loss); the same Functions the optimiser uses are composed with
the law's Function once per robot, mode and law form.
"""

import functools

import casadi as ca
import numpy as np

from gaitopt.model.modes import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array

SLIP_GUARDS = ("at rest", "lift-off", "painleve", "touchdown", "fall")
STICK_GUARDS = ("lift-off", "slip+", "slip-", "touchdown", "fall")
"""Guards in order; where several fall through zero at once, the first counts."""


def guard_names(mode: Mode) -> tuple[str, ...]:
    """Return the names of a mode's guards."""
    return SLIP_GUARDS if mode.slips else STICK_GUARDS


@functools.lru_cache(maxsize=128)
def closed_loop(robot: Robot, mode: Mode, torque: ca.Function) -> tuple[ca.Function, ca.Function]:
    """Return the flow (t, y, p, data) -> dy/dt and the guards (t, y, p, data) -> values, armed.

    Guards are positive while the mode lasts; `armed` tells whether a touchdown counts.
    """
    n, n_u = robot.n_q, robot.n_u
    t, y = ca.SX.sym("t"), ca.SX.sym("y", 2 * n + n_u + 1)
    p, data = ca.SX.sym("p", len(robot.parameters)), ca.SX.sym("data", torque.size1_in(3))
    q, v = y[:n], y[n : 2 * n]
    u = torque(t, q, v, data)
    acceleration, force = robot.acceleration[mode](q, v, u, p)
    power = u * robot.joint_rates(q, v, p)
    rate = ca.vertcat(v, acceleration, power, -force[0] * v[0] if mode.slips else 0)
    guard, _, armed = robot.touchdown(q, v, p)
    friction = p[[parameter.name for parameter in robot.parameters].index("friction")]
    if mode.slips:
        wellposed = robot.wellposed(q, p)[0 if mode.sign > 0 else 1]
        own = [mode.sign * v[0], force[1], wellposed]
    else:
        # f_t falls to -mu f_n: slip forward; f_t rises to +mu f_n: slip backward (1/mu allows mu = inf).
        own = [force[1], force[1] + force[0] / friction, force[1] - force[0] / friction]
    guards = ca.vertcat(*own, guard, robot.upright(q, p))
    names = ["t", "y", "p", "data"]
    return (
        ca.Function("flow", [t, y, p, data], [rate], names, ["rate"]),
        ca.Function("guards", [t, y, p, data], [guards, armed], names, ["guards", "armed"]),
    )


class Numeric:
    """A fast callable (t, y) -> outputs of a Function with fixed parameters and data.

    The arrays returned are reused by the next call.

    Parameters
    ----------
    function : (t, y, p, data) -> ... Function
    p, data : arrays
    """

    def __init__(self, function: ca.Function, p: Array, data: Array) -> None:
        # CasADi keeps bare pointers into these arrays: they must live as long as the buffer.
        self._buffer, self._evaluate = function.buffer()
        self._clock, self._state = np.zeros(1), np.zeros(function.size1_in(1))
        self._fixed = [np.ascontiguousarray(values, dtype=float) for values in (p, data)]
        self._outputs = tuple(np.zeros(function.size1_out(i)) for i in range(function.n_out()))
        for i, array in enumerate((self._clock, self._state, *self._fixed)):
            if array.size:
                self._buffer.set_arg(i, array.data)
        for i, array in enumerate(self._outputs):
            self._buffer.set_res(i, array.data)

    def __call__(self, t: float, y: Array) -> tuple[Array, ...]:
        """Evaluate."""
        self._clock[0], self._state[:] = t, y
        self._evaluate()
        return self._outputs
