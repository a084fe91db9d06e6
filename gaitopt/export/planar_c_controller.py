"""The law of a robot with several contacts as C: its tables, its state between samples, and the controller."""

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.export.c_controller import initialiser
from gaitopt.export.planar_impulses import write_c_impulse_header, write_c_impulse_source
from gaitopt.export.planar_python import list_endings, list_matrices, list_sections
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array
from gaitopt.motion.printable import comment_line


def write_planar_header(prefix: str, robot: PlanarRobot, law: PlanarLaw) -> str:
    """Return the declarations of the controller."""
    first, other = list_sections(robot, law)
    ends = f'"{first}"' if first == other else f'"{first}" and "{other}" in turn'
    return "\n".join(
        [
            "/* State of the controller between samples; zero before the first period.  The controller exchanges the",
            " * legs in every second period, if the robot has a pair of them: q, v and torque are those of the robot.",
            *(comment_line(f" *   latched[{i}]  {name}") for i, name in enumerate(law.latched)),
            " */",
            f"typedef struct {{ double latched[{_latched_size(law)}]; int part, periods; }} {prefix}_state;",
            "/* Call it with the first state, and with the state after every impact that ends a period,",
            comment_line(f" * of the contact {ends}.") + " */",
            f"{_begin_signature(prefix)};",
            "/* Call it after every other impact of a contact. */",
            f"{_impact_signature(prefix)};",
            *_describe_endings(prefix, robot, law),
            "/* Torque at a sample: clock [s] since the period began. */",
            f"{_step_signature(prefix)};",
            "/* Controller without a structure, for a C Caller block or an S-function: the caller owns all arrays.",
            f" * state and next have {_state_size(prefix)} entries, zero before the first sample.",
            " * event is 1 at the first sample and at the first one after each impact that ends a period,",
            " * 2 at the first one after each other impact,",
            *([" * 3 at the first one after each event of pass_ending,"] if any(law.endings) else []),
            " * otherwise 0. */",
            f"#define {_state_size(prefix)} {3 + _latched_size(law)}",
            f"{_update_signature(prefix)};",
            *write_c_impulse_header(prefix, robot, law),
        ]
    )


def write_planar_source(prefix: str, robot: PlanarRobot, law: PlanarLaw) -> str:
    """Return the tables of the law and the functions of the controller."""
    coordinates, actuators = list_matrices(robot)
    names = {
        "prefix": prefix,
        "n": robot.n_q,
        "m": max(robot.n_u, 1),
        "count": robot.n_u,
        "parts": len(law.parts),
        "legs": int(robot.mirror is not None),
        "values": _latched_size(law),
        "begin": _begin_signature(prefix),
        "impact": _impact_signature(prefix),
        "ending": _ending_signature(prefix) if any(law.endings) else f"static {_ending_signature(prefix)}",
        "step": _step_signature(prefix),
        "update": _update_signature(prefix),
    }
    latch = f"{prefix}_latch(q, v, table_0[0], state->latched);" if law.latched else "(void)q;\n  (void)v;"
    cases = "\n".join(_case(prefix, number, part) for number, part in enumerate(law.parts))
    return "\n".join(
        [
            *(_tables(number, part.breakpoints, part.table.T) for number, part in enumerate(law.parts)),
            f"static const double exchange_q[{robot.n_q**2}] = {initialiser(_rows(coordinates))};",
            f"static const double exchange_u[{max(robot.n_u**2, 1)}] = {initialiser(_rows(actuators))};",
            f"static const int ends_without_impact[{len(law.parts)}] = {{{_list_flags(law)}}};",
            _CONTROLLER.format(**names, latch=latch, cases=cases),
            *write_c_impulse_source(prefix, robot, law),
        ]
    )


def _rows(matrix: ca.DM) -> Array:
    """Return the entries of a matrix row by row; one number for an empty matrix."""
    return np.array(matrix).ravel() if matrix.numel() else np.zeros(1)


def _tables(number: int, breakpoints: Array, table: Array) -> str:
    pieces, rows = table.shape
    columns = ",\n".join(initialiser(row if rows else np.zeros(1)) for row in table)
    return (
        f"static const double breakpoints_{number}[{pieces}] = {initialiser(breakpoints)};\n"
        f"static const double table_{number}[{pieces}][{max(rows, 1)}] = {{\n{columns}\n}};"
    )


def _describe_endings(prefix: str, robot: PlanarRobot, law: PlanarLaw) -> list[str]:
    """Return the declaration of the function that ends a part without impact; empty without such parts."""
    if not any(law.endings):
        return []
    lines = [
        comment_line(f" *   part {part}: {' or, with exchanged legs, '.join(dict.fromkeys(events))}")
        for part, events in enumerate(list_endings(robot, law))
        if events is not None
    ]
    return [
        "/* Call it at the event that ends the current part (state->part) without impact:",
        *lines,
        f" * In these parts {prefix}_impact has no effect. */",
        f"{_ending_signature(prefix)};",
    ]


def _list_flags(law: PlanarLaw) -> str:
    return ", ".join(str(int(law.ending(part) is not None)) for part in range(len(law.parts)))


def _case(prefix: str, number: int, part: Law) -> str:
    measure = "measure = clock;"
    if part.phase_variable is not None:
        measure = f"{prefix}_phase_{number}(q, v, &measure);"
    return f"""    case {number}:
      {measure}
      piece = {prefix}_piece(breakpoints_{number}, {part.table.shape[1]}, measure);
      {prefix}_torque_{number}(&clock, q, v, state->latched, &slide, table_{number}[piece], torque);
      break;"""


_CONTROLLER = """
static void {prefix}_exchange(const double *matrix, int size, const double *from, double *to) {{
  int i, k;
  for (i = 0; i < size; ++i) {{
    to[i] = 0;
    for (k = 0; k < size; ++k) to[i] += matrix[size * i + k] * from[k];
  }}
}}

static int {prefix}_piece(const double *breakpoints, int pieces, double clock) {{
  int low = 0, high = pieces; /* the piece lies in [low, high) */
  while (high - low > 1) {{
    const int middle = (low + high) / 2;
    if (clock < breakpoints[middle]) high = middle;
    else low = middle;
  }}
  return low;
}}

static int {prefix}_exchanged(const {prefix}_state *state) {{
  return {legs} && state->periods % 2 == 0;
}}

{begin} {{
  double planned_q[{n}], planned_v[{n}];
  state->part = 0;
  state->periods = 1 + state->periods % 2;
  if ({prefix}_exchanged(state)) {{
    {prefix}_exchange(exchange_q, {n}, q, planned_q);
    {prefix}_exchange(exchange_q, {n}, v, planned_v);
    q = planned_q;
    v = planned_v;
  }}
  {latch}
}}

{impact} {{
  if (!ends_without_impact[state->part] && state->part < {parts} - 1) ++state->part;
}}

{ending} {{
  if (ends_without_impact[state->part] && state->part < {parts} - 1) ++state->part;
}}

{step} {{
  double planned_q[{n}], planned_v[{n}], planned_torque[{m}];
  const double slide = 0;
  const int exchanged = {prefix}_exchanged(state);
  double measure;
  int piece, i;
  if (exchanged) {{
    {prefix}_exchange(exchange_q, {n}, q, planned_q);
    {prefix}_exchange(exchange_q, {n}, v, planned_v);
    q = planned_q;
    v = planned_v;
  }}
  switch (state->part) {{
{cases}
    default:
      break;
  }}
  if (exchanged) {{
    for (i = 0; i < {count}; ++i) planned_torque[i] = torque[i];
    {prefix}_exchange(exchange_u, {count}, planned_torque, torque);
  }}
}}

{update} {{
  {prefix}_state memory;
  int i;
  memory.part = (int)state[1];
  memory.periods = (int)state[2];
  for (i = 0; i < {values}; ++i) memory.latched[i] = state[i + 3];
  next[0] = event == 1 ? time : state[0];
  if (event == 1) {prefix}_begin(&memory, q, v);
  if (event == 2) {prefix}_impact(&memory);
  if (event == 3) {prefix}_pass_ending(&memory);
  {prefix}_step(&memory, time - next[0], q, v, torque);
  next[1] = memory.part;
  next[2] = memory.periods;
  for (i = 0; i < {values}; ++i) next[i + 3] = memory.latched[i];
}}
"""


def _latched_size(law: PlanarLaw) -> int:
    return max(len(law.latched), 1)


def _state_size(prefix: str) -> str:
    return f"{prefix.upper()}_STATE_SIZE"


def _begin_signature(prefix: str) -> str:
    return f"void {prefix}_begin({prefix}_state *state, const double *q, const double *v)"


def _impact_signature(prefix: str) -> str:
    return f"void {prefix}_impact({prefix}_state *state)"


def _ending_signature(prefix: str) -> str:
    return f"void {prefix}_pass_ending({prefix}_state *state)"


def _step_signature(prefix: str) -> str:
    arguments = "double clock, const double *q, const double *v, double *torque"
    return f"void {prefix}_step(const {prefix}_state *state, {arguments})"


def _update_signature(prefix: str) -> str:
    arguments = "double time, double event, const double *q, const double *v"
    return f"void {prefix}_update(const double *state, {arguments}, double *next, double *torque)"
