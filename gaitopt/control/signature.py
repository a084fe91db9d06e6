"""Signature of control laws: their inputs, outputs and memory.

Every law is a Function (clock, q, v, latched, slide, data) -> (torque, bounds, guards).  A law without memory ignores
`latched`, a law that does not depend on the contact mode ignores `slide`, and most laws return neither bounds nor
guards; the builders of this module supply the unused inputs and outputs.
"""

import functools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.locks import one_at_a_time
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.parameters import Parameter

MOST_ROWS = 1_000_000
"""Largest number of rows of data and of latched values of a law."""

INPUTS = ("clock", "q", "v", "latched", "slide", "data")
OUTPUTS = ("torque", "bounds", "guards")


class LawInputs(NamedTuple):
    """Symbols of the inputs of a law.

    Attributes
    ----------
    clock : SX [s]
        Time since the last touchdown.
    q, v : SX, shape (n_q, 1)
    latched : SX, shape (n_l, 1)
        Values latched at the touchdown or at an event of the law, and constant in between.
    slide : SX
        Sign of the stance foot's velocity by the contact mode: 1, -1, or 0 while it sticks.
    data : SX, shape (n_d, 1)
        Active column of the law's table.
    """

    clock: ca.SX
    q: ca.SX
    v: ca.SX
    latched: ca.SX
    slide: ca.SX
    data: ca.SX


@check_arguments
def law_inputs(robot: Robot | PlanarRobot, *, data: int = 0, latched: int = 0) -> LawInputs:
    """Return new symbols for a law of a robot with `data` rows in its table and `latched` values.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> law_inputs(compass_biped(), data=2).q.shape
    (4, 1)
    """
    for name, size in (("data", data), ("latched", latched)):
        Parameter(name, 0, "1", "", lower=0, upper=MOST_ROWS, whole=True).check(size)
    return _symbols(robot.n_q, latched, data)


def inputs_of(control: ca.Function, *, data: int = 0, latched: int = 0) -> LawInputs:
    """Return new symbols like the inputs of a law's Function, with more rows of data and more latched values."""
    return _symbols(control.size1_in(1), control.size1_in(3) + latched, control.size1_in(5) + data)


def _symbols(n_q: int, latched: int, data: int) -> LawInputs:
    sizes = (1, n_q, n_q, latched, 1, data)
    return LawInputs(*(ca.SX.sym(name, size) for name, size in zip(INPUTS, sizes, strict=True)))


@check_arguments
def control_function(
    inputs: LawInputs, torque: ca.SX, *, bounds: ca.SX | None = None, guards: ca.SX | None = None
) -> ca.Function:
    """Return the Function of a law from its expressions.

    Parameters
    ----------
    inputs : LawInputs
    torque : SX, shape (n_u, 1) [N m]
    bounds : SX, shape (2, 1), optional
        Positive within a piece if an entry of the state decides the piece; see ``Law.index``.
    guards : SX, shape (n_e, 1), optional
        Each guard falls through zero at an event of the law.  Guards are functions of clock, q, v, latched and data,
        not of `slide`; :class:`Memory` names their events.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> inputs = law_inputs(compass_biped(), data=1)
    >>> control_function(inputs, ca.vertcat(inputs.data, -2 * inputs.v[3])).size1_out(0)
    2
    """
    outputs = [torque, *(ca.SX(0, 1) if each is None else each for each in (bounds, guards))]
    return ca.Function("control", [*inputs], outputs, [*INPUTS], [*OUTPUTS])


@one_at_a_time
def torque_function(
    robot: Robot | PlanarRobot, data: ca.SX, torque: Callable[[ca.SX, ca.SX, ca.SX], ca.SX]
) -> ca.Function:
    """Return the Function of a law without memory from its torque in terms of clock, q and v.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> data = ca.SX.sym("data", 2)
    >>> torque_function(compass_biped(), data, lambda clock, q, v: data * clock).name_in()
    ['clock', 'q', 'v', 'latched', 'slide', 'data']
    """
    inputs = law_inputs(robot)._replace(data=data)
    return control_function(inputs, torque(inputs.clock, inputs.q, inputs.v))


@dataclass(frozen=True)
class Memory:
    """The memory of a law: values latched at each touchdown and at the events of the law.

    New values are latched at every touchdown.  Discrete states of a law are latched values too, such as 0 while an
    actuator waits and 1 while it pushes.

    Attributes
    ----------
    latch : (q, v, data) -> latched (n_l) Function
        Values at the start of a step, from the state after the touchdown and the first column of the table.
    reset : (clock, q, v, latched, data) -> (n_l, n_e) Function
        Values after each event.
    values : tuple of str
        Names of the values.
    events : tuple of str
        Names of the events, in the order of the guards.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> inputs = law_inputs(compass_biped(), latched=1)
    >>> make_memory(inputs, inputs.v[2], values=["rate after touchdown"]).values
    ('rate after touchdown',)
    """

    latch: ca.Function
    reset: ca.Function
    values: tuple[str, ...]
    events: tuple[str, ...] = ()


@check_arguments
def make_memory(
    inputs: LawInputs,
    latch: ca.SX,
    *,
    values: Sequence[str],
    events: Sequence[str] = (),
    reset: ca.SX | None = None,
) -> Memory:
    """Return the memory of a law from its expressions.

    Parameters
    ----------
    inputs : LawInputs
    latch : SX, shape (n_l, 1)
        Latched values as functions of q, v and data only.
    values : sequence of str
        Names of the latched values.
    events : sequence of str
        Names of the law's events.
    reset : SX, shape (n_l, n_e), optional
        Values after each event as functions of all inputs except `slide`.

    Raises
    ------
    InputError
        If a shape does not match the number of names.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> inputs = law_inputs(compass_biped(), latched=1)
    >>> make_memory(inputs, ca.SX(0), values=["pushing"], events=["release"], reset=ca.SX(1)).events
    ('release',)
    """
    reset = ca.SX(len(values), 0) if reset is None else reset
    for name, matrix, shape in (("latch", latch, (len(values), 1)), ("reset", reset, (len(values), len(events)))):
        if ca.SX(matrix).shape != shape:
            raise InputError(f"{name} must have the shape {shape} of the named values, got {ca.SX(matrix).shape}.")
    clock, q, v, latched, _, data = inputs
    return Memory(
        ca.Function("latch", [q, v, data], [ca.densify(latch)], ["q", "v", "data"], ["latched"]),
        ca.Function(
            "reset",
            [clock, q, v, latched, data],
            [ca.densify(reset)],
            ["clock", "q", "v", "latched", "data"],
            ["after"],
        ),
        tuple(values),
        tuple(events),
    )


@functools.lru_cache(maxsize=128)
@one_at_a_time
def no_memory(n_q: int, data: int) -> Memory:
    """Return the memory of a law without latched values."""
    return make_memory(_symbols(n_q, 0, data), ca.SX(0, 1), values=())


def rewrite_memory(memory: Memory, inputs: LawInputs, inner_inputs: LawInputs) -> Memory:
    """Return the memory of a law in other symbols.

    Parameters
    ----------
    memory : Memory
    inputs : LawInputs
        Symbols of the changed law.
    inner_inputs : LawInputs
        Inputs of the original law as expressions of these symbols.
    """
    return make_memory(
        inputs,
        memory.latch(inputs.q, inputs.v, inner_inputs.data),
        values=memory.values,
        events=memory.events,
        reset=memory.reset(*inner_inputs[:4], inner_inputs.data),
    )


def saturate(torque: ca.SX, limits: ca.SX) -> ca.SX:
    """Return torques saturated at limits, shape (n_u, 1)."""
    return ca.fmin(ca.fmax(torque, -limits), limits)


@functools.lru_cache(maxsize=128)
@one_at_a_time
def saturate_control(control: ca.Function) -> ca.Function:
    """Return the Function of a law with its torque limited by the last rows of its data."""
    inputs = inputs_of(control)
    torque, bounds, guards = control(*inputs)
    return control_function(inputs, saturate(torque, inputs.data[-torque.numel() :]), bounds=bounds, guards=guards)


def control_slope(control: ca.Function, slide: int) -> ca.Function:
    """Return (clock, y, data) -> derivative of a law's torque without limits with respect to the state, (n_u, n_y)."""
    torque, clock, y, data = torque_in_state(control, slide)
    return ca.Function("slope", [clock, y, data], [ca.jacobian(torque, y)])


def torque_in_state(control: ca.Function, slide: int) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """Return the torque of a law's Function and its symbols: clock, state y = (q, v, latched) and data."""
    n = control.size1_in(1)
    clock, y = ca.SX.sym("clock"), ca.SX.sym("y", 2 * n + control.size1_in(3))
    data = ca.SX.sym("data", control.size1_in(5))
    return control(clock, y[:n], y[n : 2 * n], y[2 * n :], slide, data)[0], clock, y, data
