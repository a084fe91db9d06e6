"""A law as C: its tables, its state between samples, and the step function of the controller."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.motion.motion import Array
from gaitopt.motion.printable import comment_line

MOST_EVENTS = 20
"""Maximum number of events of the law that are processed in one sample."""


def law_functions(law: Law) -> list[ca.Function]:
    """Return the Functions of a law to write: torque and guards, and its memory if it has one."""
    inputs = law.torque.sx_in()
    torque, _, guards = law.torque.call(inputs)
    names = law.torque.name_in()
    if not law.memory.values:
        return [ca.Function("torque", inputs, [torque], names, ["torque"])]
    functions = [ca.Function("torque", inputs, [torque, ca.densify(guards)], names, ["torque", "guards"])]
    return [*functions, law.memory.latch, *([law.memory.reset] if law.memory.events else [])]


def list_law_functions(law: PlanarLaw) -> list[ca.Function]:
    """Return the Functions of a law to write: torque and phase variable of each part, and the latch of its values."""
    functions = []
    for number, part in enumerate(law.parts):
        inputs = part.torque.sx_in()
        torque = ca.densify(part.torque.call(inputs)[0])
        functions.append(ca.Function(f"torque_{number}", inputs, [torque], part.torque.name_in(), ["torque"]))
        if part.phase_variable is not None:
            q, v = part.phase_variable.sx_in()
            value = ca.densify(part.phase_variable(q, v))
            functions.append(ca.Function(f"phase_{number}", [q, v], [value], ["q", "v"], ["phase"]))
    return [*functions, law.parts[0].memory.latch] if law.latched else functions


def controller_header(prefix: str, law: Law) -> str:
    """Return the declarations of the controller."""
    values, events = law.memory.values, law.memory.events
    return "\n".join(
        [
            "/* State of the controller between samples: the latched values of the law.",
            *(comment_line(f" *   latched[{i}]  {name}") for i, name in enumerate(values)),
            *([f" * Events of the law: {', '.join(events)}."] if events else []),
            " */",
            f"typedef struct {{ double latched[{max(len(values), 1)}]; }} {prefix}_state;",
            "/* Call it with the state of the robot after every touchdown and leg exchange. */",
            f"{_begin_signature(prefix)};",
            "/* Torque at a sample: clock [s] since the last touchdown; slide, 1, -1 or 0 as the stance foot slides",
            " * forward, backward or not.  Events of the law since the last sample change the state first. */",
            f"{_step_signature(prefix)};",
            "/* Controller without a structure, for a C Caller block or an S-function: the caller owns all arrays.",
            f" * state and next have {_state_size(prefix)} entries: the time of the last touchdown, then the latched",
            " * values.  touchdown is 1 at the first sample and at the first one after each touchdown, otherwise 0. */",
            f"#define {_state_size(prefix)} {1 + max(len(values), 1)}",
            f"{_update_signature(prefix)};",
            "/* The same for given latched values (NULL if the law has none), without events. */",
            f"{_control_signature(prefix)};",
        ]
    )


def controller_source(prefix: str, law: Law) -> str:
    """Return the tables of the law and the functions of the controller."""
    table = law.table.T
    pieces, rows = table.shape
    n_q = law.control.size1_in(1)
    place = "clock" if law.index is None else f"q[{law.index}]" if law.index < n_q else f"v[{law.index - n_q}]"
    return "\n".join(
        [
            f"static const double breakpoints[{pieces}] = {initialiser(law.breakpoints)};",
            f"static const double table[{pieces}][{max(rows, 1)}] = {{",
            ",\n".join(initialiser(row if rows else np.zeros(1)) for row in table),
            "};",
            _CONTROL.format(prefix=prefix, signature=_control_signature(prefix), pieces=pieces, place=place)
            + _control_call(prefix, law),
            _begin(prefix, law),
            _step(prefix, law),
            _update(prefix, law),
        ]
    )


_CONTROL = """
static const double *{prefix}_data(double clock, const double *q, const double *v) {{
  int low = 0, high = {pieces}; /* the piece lies in [low, high) */
  (void)clock;
  (void)q;
  (void)v;
  while (high - low > 1) {{
    const int middle = (low + high) / 2;
    if ({place} < breakpoints[middle]) high = middle;
    else low = middle;
  }}
  return table[low];
}}

{signature} {{
"""


def _control_call(prefix: str, law: Law) -> str:
    outputs = ", torque, 0" if law.memory.values else ", torque"
    return f"  {prefix}_torque(&clock, q, v, latched, &slide, {prefix}_data(clock, q, v){outputs});\n}}\n"


def _begin(prefix: str, law: Law) -> str:
    body = "  (void)q;\n  (void)v;\n  state->latched[0] = 0;"
    if law.memory.values:
        body = f"  {prefix}_latch(q, v, table[0], state->latched);"
    return f"{_begin_signature(prefix)} {{\n{body}\n}}\n"


def _step(prefix: str, law: Law) -> str:
    values, events = len(law.memory.values), len(law.memory.events)
    loop = ""
    if events:
        loop = f"""  int round, event, i;
  double guards[{events}], after[{values * events}];
  for (round = 0; round < {MOST_EVENTS}; ++round) {{
    const double *data = {prefix}_data(clock, q, v);
    {prefix}_torque(&clock, q, v, state->latched, &slide, data, 0, guards);
    for (event = 0; event < {events} && guards[event] >= 0; ++event) {{
    }}
    if (event == {events}) break;
    {prefix}_reset(&clock, q, v, state->latched, data, after);
    for (i = 0; i < {values}; ++i) state->latched[i] = after[{values} * event + i];
  }}
"""
    return f"{_step_signature(prefix)} {{\n{loop}  {prefix}_control(clock, q, v, state->latched, slide, torque);\n}}\n"


def _update(prefix: str, law: Law) -> str:
    return f"""{_update_signature(prefix)} {{
  {prefix}_state memory;
  int i;
  next[0] = touchdown != 0 ? time : state[0];
  if (touchdown != 0) {prefix}_begin(&memory, q, v);
  else for (i = 0; i < {max(len(law.memory.values), 1)}; ++i) memory.latched[i] = state[i + 1];
  {prefix}_step(&memory, time - next[0], q, v, slide, torque);
  for (i = 0; i < {max(len(law.memory.values), 1)}; ++i) next[i + 1] = memory.latched[i];
}}
"""


def _state_size(prefix: str) -> str:
    return f"{prefix.upper()}_STATE_SIZE"


def _update_signature(prefix: str) -> str:
    arguments = "double time, double touchdown, const double *q, const double *v, double slide"
    return f"void {prefix}_update(const double *state, {arguments}, double *next, double *torque)"


def _control_signature(prefix: str) -> str:
    arguments = "double clock, const double *q, const double *v, const double *latched, double slide, double *torque"
    return f"void {prefix}_control({arguments})"


def _begin_signature(prefix: str) -> str:
    return f"void {prefix}_begin({prefix}_state *state, const double *q, const double *v)"


def _step_signature(prefix: str) -> str:
    arguments = "double clock, const double *q, const double *v, double slide, double *torque"
    return f"void {prefix}_step({prefix}_state *state, {arguments})"


def initialiser(values: Array | Sequence[float]) -> str:
    """Return numbers as a C initialiser with all digits."""
    return "{" + ", ".join(_number(float(value)) for value in values) + "}"


def _number(value: float) -> str:
    if np.isfinite(value):
        return repr(value)
    return "NAN" if np.isnan(value) else "INFINITY" if value > 0 else "-INFINITY"
