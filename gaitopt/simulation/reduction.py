"""Closed-loop Functions rewritten so that a Taylor integrator has little to do.

A Taylor integrator pays for every product of two quantities that change with time; numbers cost it next to nothing.
Expressions derived by Lagrange's equations hold many products that cancel and many that depend on parameters only.
Here they are split into coefficients (parameters in, numbers out, evaluated once) and a body (time, state and
coefficients in) in which everything that cancels is gone.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from gaitopt.simulation.form_reader import FormReader
from gaitopt.simulation.form_writer import FormWriter


@dataclass(frozen=True, eq=False)
class Reduced:
    """A Function of (t, y, p, data) in two parts.

    Attributes
    ----------
    coefficients : (p, data, y) -> (n_c)
        Of `y` only entries at rest count.
    body : (t, y[active], coefficients) -> the outputs of the Function
    """

    coefficients: ca.Function
    body: ca.Function


def reduce_function(function: ca.Function, active: Sequence[int]) -> Reduced:
    """Reduce a Function of (t, y, p, data) whose time and entries `active` of y move while all else rests.

    Parameters
    ----------
    function : Function
        Of SX type, inputs and outputs dense.
    active : sequence of int

    Examples
    --------
    >>> t, y, p, data = ca.SX.sym("t"), ca.SX.sym("y", 2), ca.SX.sym("p"), ca.SX.sym("data", 0)
    >>> length = (p * ca.sin(y[0])) ** 2 + (p * ca.cos(y[0])) ** 2
    >>> reduced = reduce_function(ca.Function("length", [t, y, p, data], [length * y[1]]), [0, 1])
    >>> str(reduced.body), reduced.body(0, [0.5, 2.0], reduced.coefficients(3, [], [0, 0]))
    ('length:(i0,i1[2],i2)->(o0) SXFunction', DM(18))
    """
    # What a quantity costs depends on how often it is used, which is known once everything has been written.
    reader = FormReader(function, active, FormReader(function, active, _uses(function)).uses())
    writer = FormWriter(reader.atoms)
    outputs = [ca.vertcat(*[writer.write(form) for form in output]) for output in reader.outputs]
    state = ca.vertcat(ca.SX(0, 1), *[writer.entry(i) for i in active])
    symbols = ca.vertcat(ca.SX(0, 1), *writer.symbols)
    body = ca.Function(function.name(), [writer.clock, state, symbols], ca.cse(outputs))
    values = ca.vertcat(ca.SX(0, 1), *[coefficient.value for coefficient in writer.coefficients])
    return Reduced(ca.Function("coefficients", reader.parameters, ca.cse([values])), body)


def _uses(function: ca.Function) -> list[int]:
    """Return how often the result of each instruction is used."""
    uses, source = [0] * function.n_instructions(), dict[int, int]()
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        if operation != ca.OP_INPUT:
            for slot in set(function.instruction_input(k)):
                uses[source[slot]] += 1
        if operation != ca.OP_OUTPUT:
            source[function.instruction_output(k)[0]] = k
    return uses
