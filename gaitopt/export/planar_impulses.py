"""Impulses of actuators in exported controllers: a table, and a function that returns those of the next impact."""

import numpy as np

from gaitopt.control.planar_laws.planar_law import PlanarLaw, PlannedImpulses
from gaitopt.export.c_controller import initialiser
from gaitopt.export.python_code import write_array
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.actuator_impulses import MOMENTS
from gaitopt.motion.printable import comment_line


def tabulate_impulses(robot: PlanarRobot, law: PlanarLaw) -> list[str]:
    """Return a line for each impulse: part of the period, event, actuator, moment and value.

    Examples
    --------
    >>> from gaitopt.control import passive
    >>> from gaitopt.model import monopod
    >>> tabulate_impulses(monopod(), PlanarLaw("passive", "foot closes", (passive(monopod()),)))
    []
    """
    return [
        f"part {part}, {planned.contact} closes, {name}, {moment}: {value:.17g} {unit} s"
        for part, planned in enumerate(law.impulses)
        if planned is not None
        for moment, values in zip(MOMENTS, planned.values, strict=True)
        for name, unit, value in zip(robot.actuators, robot.actuator_units, values.tolist(), strict=True)
        if value
    ]


def write_python_impulses(robot: PlanarRobot, law: PlanarLaw) -> tuple[str, str]:
    """Return the table of the impulses as Python and the method of the controller; empty without impulses."""
    if not any(law.impulses):
        return "", ""
    rows = "\n".join(f"    {_python_row(robot, planned)}," for planned in law.impulses)
    lines = "\n".join(f"# {line}" for line in tabulate_impulses(robot, law))
    return f"{lines}\nIMPULSES = [\n{rows}\n]\n", _METHOD.format(count=robot.n_u)


def _python_row(robot: PlanarRobot, planned: PlannedImpulses | None) -> str:
    if planned is None:
        return "None"
    contacts = tuple(robot.contact_names[number] for number in _list_contacts(robot, planned))
    return f"({contacts!r}, {write_array(np.array(planned.values))}.reshape(2, {robot.n_u}))"


def _list_contacts(robot: PlanarRobot, planned: PlannedImpulses | None) -> tuple[int, int]:
    """Return the contact at whose impact impulses act: with the legs of the plan, and with exchanged legs."""
    if planned is None:
        return -1, -1
    contact = robot.contact_names.index(planned.contact)
    return contact, contact if robot.mirror is None else robot.mirror.contacts[contact]


def write_c_impulse_header(prefix: str, robot: PlanarRobot, law: PlanarLaw) -> list[str]:
    """Return the declarations of the impulses; empty without impulses."""
    if not any(law.impulses):
        return []
    return [
        "/* Impulses of the actuators with the legs of the plan: part, event, actuator, moment, value.",
        *(comment_line(f" *   {line}") for line in tabulate_impulses(robot, law)),
        " * The function returns the number of the contact at whose impact the next impulses act, in the order of the",
        " * gaps, or -1 if there are none, and writes the impulses just before and just after this impact, or zeros.",
        " * Call it before the functions that pass the impact. */",
        f"{_signature(prefix)};",
        "/* The same for a C Caller block or an S-function, with the array state. */",
        f"{_plain_signature(prefix)};",
    ]


def write_c_impulse_source(prefix: str, robot: PlanarRobot, law: PlanarLaw) -> list[str]:
    """Return the table of the impulses and the functions that read it; empty without impulses."""
    if not any(law.impulses):
        return []
    contacts = [number for planned in law.impulses for number in _list_contacts(robot, planned)]
    zero = np.zeros((2, robot.n_u))
    values = np.array([zero if planned is None else np.array(planned.values) for planned in law.impulses])
    parts = len(law.impulses)
    names = {
        "prefix": prefix,
        "count": robot.n_u,
        "signature": _signature(prefix),
        "plain": _plain_signature(prefix),
    }
    return [
        f"static const int impulse_contacts[{2 * parts}] = {{{', '.join(map(str, contacts))}}};",
        f"static const double impulse_table[{values.size}] = {initialiser(values.ravel())};",
        _SOURCE.format(**names),
    ]


def _signature(prefix: str) -> str:
    return f"int {prefix}_impulses(const {prefix}_state *state, double *before, double *after)"


def _plain_signature(prefix: str) -> str:
    return f"void {prefix}_next_impulses(const double *state, double *contact, double *before, double *after)"


_METHOD = '''
    def impulses(self, contact):
        """Return the impulses of the actuators just before and just after the impact of a contact, shape (2, n_u).

        They are zero at an impact without impulses.  Call it before `begin` or `impact`, which pass the impact.
        """
        planned = IMPULSES[self.part]
        if planned is None or contact != planned[0][bool(self.exchanged)]:
            return np.zeros((2, {count}))
        return planned[1] @ EXCHANGE_U.T if self.exchanged else planned[1].copy()
'''

_SOURCE = """
{signature} {{
  const int exchanged = {prefix}_exchanged(state);
  const double *planned = impulse_table + 2 * {count} * state->part;
  int i;
  if (exchanged) {{
    {prefix}_exchange(exchange_u, {count}, planned, before);
    {prefix}_exchange(exchange_u, {count}, planned + {count}, after);
  }} else {{
    for (i = 0; i < {count}; ++i) {{
      before[i] = planned[i];
      after[i] = planned[{count} + i];
    }}
  }}
  return impulse_contacts[2 * state->part + exchanged];
}}

{plain} {{
  {prefix}_state memory;
  memory.part = (int)state[1];
  memory.periods = (int)state[2];
  *contact = {prefix}_impulses(&memory, before, after);
}}
"""
