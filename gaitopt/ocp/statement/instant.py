"""Arguments of objectives: one instant of a step, and the boundary of the step."""

import functools
from collections.abc import Iterable, Mapping
from typing import Any

import casadi as ca

from gaitopt.dataclass import dataclass
from gaitopt.lazy import Deferred, LazyField
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.coordinate_entries import angle_entry, count_coordinates


@dataclass(frozen=True, eq=False, kw_only=True)
class Instant:
    """The gait at one instant.  Quantities are CasADi expressions, columns of the stated length.

    Attributes
    ----------
    mode : Mode
        Contact mode of the stance foot.
    phase : int
        Number of the phase, from 0.
    angles, actuators : tuple of str
        Names of the rows of `q` after the two of the foot, and of `torque`.
    q, v : (n_q)
        Stance foot (x, y) [m], x counted from the start of the phase, then the angles [rad]; their rates.
    acceleration : (n_q)
        Rates of `v`.
    torque, torque_rate : (n_u) [N m], [N m/s]
    positive, negative : (n_u) [W]
        Parts of the joint powers, both >= 0, with power = positive - negative; zero unless the objective `uses_power`.
    force : (2) [N]
        Contact force (f_t, f_n).
    slip_speed : scalar [m/s]
        Absolute speed of the stance foot.
    parameters : mapping of str to scalar
        Parameters of robot and ground, SI units.
    time : scalar
        Elapsed fraction of the step, from 0 to 1.

    Examples
    --------
    >>> import casadi as ca
    >>> column = ca.DM([0.0, 0.0, 0.1, -0.2])
    >>> instant = Instant(
    ...     mode=Mode.STICK, phase=0, angles=("th1", "th2"), actuators=("ankle", "hip"), q=column, v=column,
    ...     acceleration=column, torque=ca.DM([1, 2]), torque_rate=ca.DM([0, 0]), positive=ca.DM([0, 0]),
    ...     negative=ca.DM([0, 0]), force=ca.DM([0, 98]), slip_speed=ca.DM(0), parameters={}, time=ca.DM(0.5),
    ... )
    >>> instant.angle("th2"), instant.torque_of("hip")
    (DM(-0.2), DM(2))
    """

    mode: Mode
    phase: int
    angles: tuple[str, ...]
    actuators: tuple[str, ...]
    q: LazyField[Any] = LazyField()
    v: LazyField[Any] = LazyField()
    acceleration: LazyField[Any] = LazyField()
    torque: Any
    torque_rate: LazyField[Any] = LazyField()
    positive: LazyField[Any] = LazyField()
    negative: LazyField[Any] = LazyField()
    force: LazyField[Any] = LazyField()
    slip_speed: Any
    parameters: LazyField[Mapping[str, Any]] = LazyField()
    time: LazyField[Any] = LazyField()

    def angle(self, name: str) -> Any:
        """Return an angle [rad]."""
        return self.q[angle_entry(self.angles.index(name))]

    def rate(self, name: str) -> Any:
        """Return the rate of an angle [rad/s]."""
        return self.v[angle_entry(self.angles.index(name))]

    def torque_of(self, actuator: str) -> Any:
        """Return the torque of an actuator [N m]."""
        return self.torque[self.actuators.index(actuator)]

    @property
    def foot_forces(self) -> Any:
        """Force (f_t, f_n) of each foot on the ground [N], here of the stance foot alone, shape (2, 1)."""
        return self.force


@dataclass(frozen=True, eq=False, kw_only=True)
class StepBoundary:
    """The ends of a step and the touchdown between them.  Quantities are CasADi expressions.

    Attributes
    ----------
    q_first, v_first : (n_q)
        First state of the step, the stance foot at the origin.
    q_last, v_last : (n_q)
        Last state, before the impact.
    velocity_jump : (n_q)
        Rates after the impact minus those before, in the coordinates of the step that ends.
    impulse : (2) [N s]
        (Lambda_t, Lambda_n).
    duration, travel : scalar [s], [m]
    parameters : mapping of str to scalar
        Parameters of robot and ground, SI units.
    energy_lost : scalar [J]
        Kinetic energy before the impact minus that after.

    Examples
    --------
    >>> import casadi as ca
    >>> rest = dict.fromkeys(("q_first", "v_first", "q_last", "v_last", "velocity_jump", "impulse"), ca.DM.zeros(4))
    >>> StepBoundary(**rest, duration=0.7, travel=0.4, parameters={}, energy_lost=0.1).duration
    0.7
    """

    q_first: Any
    v_first: Any
    q_last: Any
    v_last: Any
    velocity_jump: Any
    impulse: Any
    duration: Any
    travel: Any
    parameters: LazyField[Mapping[str, Any]] = LazyField()
    energy_lost: LazyField[Any] = LazyField()


@dataclass(frozen=True, eq=False)
class Peak:
    """Quantities whose largest value over the step is part of an objective.

    Attributes
    ----------
    values : (k) expression
    divisor : scalar or (k) expression
        Positive; the quantities are values / divisor.

    Examples
    --------
    >>> Peak([3.0, -3.0]).divisor
    1.0
    """

    values: Any
    divisor: Any = 1.0


def symbolic_instant(
    angles: tuple[str, ...],
    actuators: tuple[str, ...],
    parameters: Iterable[str],
    mode: Mode = Mode.STICK,
    phase: int = 0,
) -> Instant:
    """Return an instant whose quantities are CasADi symbols, which are made when they are first read."""
    n_q, n_u, names = count_coordinates(len(angles)), len(actuators), tuple(parameters)
    columns = {
        **dict.fromkeys(("q", "v", "acceleration"), n_q),
        **dict.fromkeys(("torque_rate", "positive", "negative"), n_u),
        **{"force": 2, "time": 1},
    }
    return Instant(
        mode=mode,
        phase=phase,
        angles=angles,
        actuators=actuators,
        torque=ca.SX.sym("torque", n_u),
        slip_speed=ca.SX.sym("slip_speed"),
        parameters=Deferred(lambda: {name: ca.SX.sym(name) for name in names}),
        **{name: Deferred(functools.partial(ca.SX.sym, name, size)) for name, size in columns.items()},
    )
