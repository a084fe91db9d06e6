"""write_c: the dynamics of a robot and its controller as C that needs only a C99 compiler."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import casadi as ca
import numpy as np

from gaitopt import __version__
from gaitopt.control.law import Law, latched_size
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.motion import Array

_TORQUE_INPUTS = ("clock", "q", "v", "data", "held", "slide")


def write_c(robot: Robot, law: Law, parameters: Mapping[str, float], path: str | Path) -> Path:
    """Write dynamics, contact, impact and controller as a C file, and its header beside it.

    The code is generated from the very expressions that gaitopt solves and simulates with.  Every function is named
    after the file: ``gait.c`` has ``gait_acceleration_stick(q, v, u, p, acceleration, force)`` and the like, the
    default parameters ``gait_parameters``, and ``gait_control(clock, q, v, held, slide, torque)`` with the tables of
    the law inside; where the law keeps values over a step, ``gait_after_touchdown(q, v, held)`` gives them.  The
    header says what each argument is.

    Parameters
    ----------
    robot : Robot
    law : Law
        Such as ``feedforward(robot, gait.motion)``.
    parameters : mapping of str to float
        Those not named keep their defaults.
    path : str or Path
        Ends in ``.c``.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the suffix is another one, the file name gives no C name, or the law belongs to another robot.
    ArchiveError
        If a file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from gaitopt import compass_biped, feedforward, load, write_c
    >>> robot, gait = compass_biped(), load("docs/examples/compass_slip.h5")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     law = feedforward(robot, gait.motion)
    ...     path = write_c(robot, law, gait.motion.parameters, f"{folder}/gait.c")
    ...     "void gait_control(" in path.with_suffix(".h").read_text(encoding="utf-8")
    True
    """
    path = Path(path)
    if path.suffix != ".c" or not re.fullmatch(r"[A-Za-z]\w*", path.stem, re.ASCII):
        raise InputError(
            f"Cannot write {path}: C code needs a file such as gait.c, whose name begins with a letter and has only "
            f"letters, digits and underscores, because the names in it are made from it."
        )
    if law.torque.size1_out(0) != robot.n_u or law.torque.size1_in(1) != robot.n_q:
        raise InputError(f"The law {law.name!r} does not belong to the robot {robot.name!r}.")
    prefix, values = path.stem, robot.vector(robot.resolve(parameters))
    functions = _functions(robot, law)
    with write_atomically(path) as source, write_atomically(path.with_suffix(".h")) as header:
        source.write_text(_source(prefix, functions, law, values), encoding="utf-8")
        header.write_text(_header(prefix, functions, robot, law, values), encoding="utf-8")
    return path


def _functions(robot: Robot, law: Law) -> list[ca.Function]:
    """Return what is written: the equations of motion in every mode, contact, impact, and the law."""
    found = [robot.dynamics, *robot.acceleration.values(), robot.energy, robot.joint_rates, robot.wellposed]
    found += [robot.landing, robot.collision, robot.touchdown, robot.swap]
    found.append(_torque(law))
    return found if law.hold is None else [*found, _rename(law.hold, "hold", ["q", "v", "data"], ["held"])]


def _torque(law: Law) -> ca.Function:
    """Return the law's torque alone, without what tells an engine where its pieces end."""
    inputs = law.torque.sx_in()
    return ca.Function("torque", inputs, law.torque.call(inputs)[:1], list(_TORQUE_INPUTS[: len(inputs)]), ["torque"])


def _source(prefix: str, functions: Sequence[ca.Function], law: Law, values: Array) -> str:
    generator = ca.CodeGenerator(f"{prefix}_generate", {"casadi_int": "int"})
    for function in functions:
        name = _generate(prefix, function)
        generator.add(_rename(function, name, function.name_in(), function.name_out()))
    breakpoints, table = law.breakpoints, law.table.T
    pieces, rows = table.shape
    parts = [
        f"/* Written by gaitopt {__version__}. */",
        f'#include "{prefix}.h"',
        generator.dump(),
        f"const double {prefix}_parameters[{values.size}] = {_braced(values)};",
        f"static const double breakpoints[{pieces}] = {_braced(breakpoints)};",
        f"static const double table[{pieces}][{max(rows, 1)}] = {{",
        ",\n".join(_braced(row if rows else np.zeros(1)) for row in table),
        "};",
        *(_call(prefix, function) for function in functions),
        _control(prefix, law),
    ]
    return "\n".join(parts)


def _header(prefix: str, functions: Sequence[ca.Function], robot: Robot, law: Law, values: Array) -> str:
    guard = f"{prefix.upper()}_H"
    order = "\n".join(
        f" *   p[{i}]  {parameter.name} [{parameter.unit}]: {parameter.description}"
        for i, parameter in enumerate(robot.parameters)
    )
    lines = [
        f"/* Robot {robot.name}, law {law.name}.  Written by gaitopt {__version__}.",
        " *",
        f" * q   stance foot x, y [m], then {', '.join(robot.angles)} [rad]; v their rates",
        f" * u   torque of {', '.join(robot.actuators) or 'no actuator'} [N m]",
        order,
        " *",
        " * Matrices are stored column by column.  An output may be NULL.",
        " */",
        f"#ifndef {guard}",
        f"#define {guard}",
        "#ifdef __cplusplus",
        'extern "C" {',
        "#endif",
        f"extern const double {prefix}_parameters[{values.size}];",
        *(f"/* {_shapes(function)} */\n{_signature(prefix, function)};" for function in functions),
        "/* Torque of the law: clock [s] since the last touchdown; held, the values the law keeps over a step (NULL",
        " * where it keeps none); slide, 1, -1 or 0 as the stance foot slides forward, backward or not. */",
        f"{_control_signature(prefix)};",
        *_hold_prototype(prefix, law),
        "#ifdef __cplusplus",
        "}",
        "#endif",
        "#endif",
        "",
    ]
    return "\n".join(lines)


def _signature(prefix: str, function: ca.Function) -> str:
    inputs = [f"const double *{name}" for name in function.name_in()]
    outputs = [f"double *{_output(function, i)}" for i in range(function.n_out())]
    return f"void {prefix}_{function.name()}({', '.join([*inputs, *outputs])})"


def _call(prefix: str, function: ca.Function) -> str:
    """Return a function with plain arguments that calls the generated one."""
    results = [_output(function, i) for i in range(function.n_out())]
    return f"""
{_signature(prefix, function)} {{
  const casadi_real *arg[{function.sz_arg()}] = {{{", ".join(function.name_in())}}};
  casadi_real *res[{function.sz_res()}] = {{{", ".join(results)}}};
  casadi_int iw[{function.sz_iw() + 1}];
  casadi_real w[{function.sz_w() + 1}];
  {_generate(prefix, function)}(arg, res, iw, w, 0);
}}"""


def _generate(prefix: str, function: ca.Function) -> str:
    """Return the name of a generated function, unlike any argument and any other in a program."""
    return f"{prefix}_generated_{function.name()}"


def _rename(function: ca.Function, name: str, inputs: Sequence[str], outputs: Sequence[str]) -> ca.Function:
    symbols = function.sx_in()
    return ca.Function(name, symbols, function.call(symbols), list(inputs), list(outputs))


def _output(function: ca.Function, number: int) -> str:
    """Return the name of an output, unlike that of any input."""
    name = str(function.name_out(number))
    return f"{name}_out" if name in function.name_in() else name


def _shapes(function: ca.Function) -> str:
    outputs = [f"{_output(function, i)} {_size(function.size_out(i))}" for i in range(function.n_out())]
    inputs = [f"{name} {_size(function.size_in(i))}" for i, name in enumerate(function.name_in())]
    return f"{', '.join(inputs)} -> {', '.join(outputs)}"


def _size(shape: tuple[int, int]) -> str:
    return str(shape[0]) if shape[1] == 1 else f"{shape[0]}x{shape[1]}"


def _control_signature(prefix: str) -> str:
    arguments = "double clock, const double *q, const double *v, const double *held, double slide, double *torque"
    return f"void {prefix}_control({arguments})"


def _hold_prototype(prefix: str, law: Law) -> list[str]:
    if law.hold is None:
        return []
    size = latched_size(law.torque)
    return [
        f"/* The {size} values to keep over a step, from the state after the touchdown. */",
        f"{_hold_signature(prefix)};",
    ]


def _hold_signature(prefix: str) -> str:
    return f"void {prefix}_after_touchdown(const double *q, const double *v, double *held)"


def _control(prefix: str, law: Law) -> str:
    """Return the functions that hand the right column of the law's table over."""
    given = ["&clock", "q", "v", "table[low]", "held", "&slide"][: law.torque.n_in()]
    unused = "" if law.torque.n_in() > 4 else "\n  (void)held;\n  (void)slide;"
    place = "clock" if law.index is None else f"q[{law.index}]"
    control = f"""
{_control_signature(prefix)} {{
  int low = 0, high = {law.breakpoints.size}; /* the piece lies in [low, high) */
  while (high - low > 1) {{
    const int middle = (low + high) / 2;
    if ({place} < breakpoints[middle]) high = middle;
    else low = middle;
  }}{unused}
  {prefix}_torque({", ".join(given)}, torque);
}}
"""
    if law.hold is None:
        return control
    return f"{control}\n{_hold_signature(prefix)} {{\n  {prefix}_hold(q, v, table[0], held);\n}}\n"


def _braced(values: Array) -> str:
    return "{" + ", ".join(_write(float(value)) for value in values) + "}"


def _write(value: float) -> str:
    """Return a number as C spells it, every digit kept."""
    if np.isfinite(value):
        return repr(value)
    return "NAN" if np.isnan(value) else "INFINITY" if value > 0 else "-INFINITY"
