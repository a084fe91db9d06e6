"""Derivatives of a law's torque, of its latched values and of its phase variable, as Functions."""

import casadi as ca


def law_slope(control: ca.Function) -> ca.Function:
    """Return (clock, q, v, latched, slide, data) -> slopes of the torque with respect to clock, (q, v), latched values.

    Examples
    --------
    >>> from gaitopt.control import passive
    >>> from gaitopt.model import monopod
    >>> law_slope(passive(monopod()).torque).size_out(1)
    (2, 10)
    """
    inputs = [ca.SX.sym(control.name_in(i), control.sparsity_in(i)) for i in range(control.n_in())]
    torque = control(*inputs)[0]
    by_state = ca.horzcat(ca.jacobian(torque, inputs[1]), ca.jacobian(torque, inputs[2]))
    slopes = [ca.jacobian(torque, inputs[0]), by_state, ca.jacobian(torque, inputs[3])]
    return ca.Function("law_slope", inputs, ca.cse([ca.densify(slope) for slope in slopes]))


def latch_slope(latch: ca.Function) -> ca.Function:
    """Return (q, v, data) -> derivative of the latched values with respect to (q, v), shape (n_l, 2 n_q).

    Examples
    --------
    >>> from gaitopt.control import passive
    >>> from gaitopt.model import monopod
    >>> latch_slope(passive(monopod()).memory.latch).size_out(0)
    (0, 10)
    """
    q, v, data = (ca.SX.sym(latch.name_in(i), latch.sparsity_in(i)) for i in range(3))
    slopes = [ca.jacobian(latch(q, v, data), symbol) for symbol in (q, v)]
    return ca.Function("latch_slope", [q, v, data], [ca.densify(ca.horzcat(*slopes))])


def phase_slope(variable: ca.Function) -> ca.Function:
    """Return (q, v) -> derivative of a phase variable with respect to (q, v), shape (1, 2 n_q).

    Examples
    --------
    >>> q, v = ca.SX.sym("q", 2), ca.SX.sym("v", 2)
    >>> phase_slope(ca.Function("phase", [q, v], [q[0] + 2 * v[1]]))([0, 0], [0, 0])
    DM([[1, 0, 0, 2]])
    """
    inputs = [ca.SX.sym(variable.name_in(i), variable.sparsity_in(i)) for i in range(2)]
    return ca.Function("phase_slope", inputs, [ca.densify(ca.jacobian(variable(*inputs), ca.vertcat(*inputs)))])
