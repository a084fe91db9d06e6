"""write_c: the dynamics of a robot and its controller as C99 code without dependencies."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.export.c_controller import (
    controller_header,
    controller_source,
    initialiser,
    law_functions,
    list_law_functions,
)
from gaitopt.export.law_robot import require_law, require_planar_law
from gaitopt.export.planar_c_controller import write_planar_header, write_planar_source
from gaitopt.export.planar_python import join_units
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.motion import Array
from gaitopt.motion.printable import comment_line
from gaitopt.version import __version__


@check_arguments
def write_c(
    robot: Robot | PlanarRobot, law: Law | PlanarLaw, parameters: Mapping[str, float], path: str | Path
) -> Path:
    """Write dynamics, contact, impact and controller as a C file, and its header beside it.

    The code is generated from the same expressions that gaitopt optimises and simulates.  Every function is named
    after the file: ``gait.c`` has ``gait_acceleration_stick(q, v, u, p, acceleration, force)`` and the like, the
    default parameters ``gait_parameters``.  The controller is a step function with an explicit state:
    ``gait_begin(&state, q, v)`` after every touchdown, then ``gait_step(&state, clock, q, v, slide, torque)`` at every
    sample, which also detects the events of the law; ``gait_update(state, time, touchdown, q, v, slide, next, torque)``
    does the same with plain arrays, as a C Caller block of Simulink needs; ``gait_control`` gives the torque for given
    latched values.  The header describes each argument.  The code allocates no memory.

    For a robot with several contacts, the code contains its equations of motion and its contacts
    (``gait_dynamics``, ``gait_gaps``, ``gait_rows``, ``gait_arming``, ``gait_energy``).  The controller accepts the
    state of the robot, regardless of which leg is in front: ``gait_begin`` is called after every impact that ends a
    period, ``gait_impact(&state)`` after every other impact, and ``gait_step(&state, clock, q, v, torque)`` at every
    sample.

    Parameters
    ----------
    robot : Robot or PlanarRobot
    law : Law or PlanarLaw
        Such as ``feedforward(robot, gait.motion)``, or ``planar_feedforward(gait)`` for several contacts.
    parameters : mapping of str to float
        Parameters; those not named keep their defaults.
    path : str or Path
        Ends in ``.c``.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the suffix is not ``.c``, the file name is not a C identifier, or the law belongs to another robot.
    ArchiveError
        If a file is not writable.

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
            f"Cannot write {path}: C code needs a file such as gait.c, whose name begins with a letter and contains "
            "only letters, digits and underscores, because the identifiers in the code are derived from it."
        )
    prefix, values = path.stem, robot.vector(robot.resolve(parameters))
    code = _planar_code(prefix, robot, law) if isinstance(robot, PlanarRobot) else _walker_code(prefix, robot, law)
    with write_atomically(path) as source, write_atomically(path.with_suffix(".h")) as header:
        source.write_text(_source(prefix, code, values), encoding="utf-8")
        header.write_text(_header(prefix, code, robot, values), encoding="utf-8")
    return path


_UNUSED_PARAMETERS = """/* Generated functions have all parameters of their interface, also those without use. */
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif"""


@dataclass(frozen=True)
class _Code:
    """Content of the files: Functions, declarations and definitions of the controller, and its descriptions."""

    functions: Sequence[ca.Function]
    declarations: str
    definitions: str
    law: str
    coordinates: str
    actuators: str


def _walker_code(prefix: str, robot: Robot, law: object) -> _Code:
    """Return the equations of motion in every mode, contact, impact, and the law."""
    law = require_law(robot, law)
    physics = [robot.dynamics, *robot.acceleration.values(), robot.energy, robot.joint_rates, robot.wellposed]
    return _Code(
        functions=[*physics, robot.landing, robot.collision, robot.touchdown, robot.swap, *law_functions(law)],
        declarations=controller_header(prefix, law),
        definitions=controller_source(prefix, law),
        law=law.name,
        coordinates=f"stance foot x, y [m], then {', '.join(robot.angles)} [rad]",
        actuators=f"torque of {', '.join(robot.actuators) or 'no actuator'} [N m]",
    )


def _planar_code(prefix: str, robot: PlanarRobot, law: object) -> _Code:
    """Return the equations of motion, the contacts, and the law."""
    law = require_planar_law(robot, law)
    actuators = join_units(robot.actuators, robot.actuator_units) or "no actuator"
    physics = [robot.dynamics, robot.gaps, robot.rows, robot.arming, robot.energy]
    return _Code(
        functions=[*physics, *list_law_functions(law)],
        declarations=write_planar_header(prefix, robot, law),
        definitions=write_planar_source(prefix, robot, law),
        law=law.name,
        coordinates=f"{join_units(robot.coordinates, robot.units)}; contacts {', '.join(robot.contact_names)}",
        actuators=f"torque or force of {actuators}",
    )


def _source(prefix: str, code: _Code, values: Array) -> str:
    generator = ca.CodeGenerator(f"{prefix}_generate", {"casadi_int": "int"})
    for function in code.functions:
        symbols, name = function.sx_in(), _generate(prefix, function)
        generator.add(ca.Function(name, symbols, function.call(symbols), function.name_in(), function.name_out()))
    parts = [
        f"/* Written by gaitopt {__version__}. */",
        f'#include "{prefix}.h"',
        _UNUSED_PARAMETERS,
        generator.dump(),
        f"const double {prefix}_parameters[{values.size}] = {initialiser(values)};",
        *(_call(prefix, function) for function in code.functions),
        code.definitions,
    ]
    return "\n".join(parts)


def _header(prefix: str, code: _Code, robot: Robot | PlanarRobot, values: Array) -> str:
    guard = f"{prefix.upper()}_H"
    order = "\n".join(
        comment_line(f" *   p[{i}]  {parameter.name} [{parameter.unit}]: {parameter.description}")
        for i, parameter in enumerate(robot.parameters)
    )
    lines = [
        "/*" + comment_line(f" Robot {robot.name}, law {code.law}.  Written by gaitopt {__version__}."),
        " *",
        comment_line(f" * q   {code.coordinates}; v their rates"),
        comment_line(f" * u   {code.actuators}"),
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
        *(f"/* {_shapes(function)} */\n{_signature(prefix, function)};" for function in code.functions),
        code.declarations,
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
    """Return the name of a generated function, distinct from all arguments and names in a program."""
    return f"{prefix}_generated_{function.name()}"


def _output(function: ca.Function, number: int) -> str:
    """Return the name of an output, distinct from those of all inputs."""
    name = str(function.name_out(number))
    return f"{name}_out" if name in function.name_in() else name


def _shapes(function: ca.Function) -> str:
    outputs = [f"{_output(function, i)} {_size(function.size_out(i))}" for i in range(function.n_out())]
    inputs = [f"{name} {_size(function.size_in(i))}" for i, name in enumerate(function.name_in())]
    return f"{', '.join(inputs)} -> {', '.join(outputs)}"


def _size(shape: tuple[int, int]) -> str:
    return str(shape[0]) if shape[1] == 1 else f"{shape[0]}x{shape[1]}"
