"""The equations of motion of robots as mathematics."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import casadi as ca

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.formulation import Formula, Formulation, assign, collect, escape_latex, latex_name
from gaitopt.parameters import Parameter

if TYPE_CHECKING:
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.model.robot import Robot

FRICTION = {
    Mode.STICK: ("v_t = 0, |f_t| ≤ μ_s f_n", r"v_t = 0,\ |f_t| \le \mu_s f_n"),
    Mode.SLIP_FORWARD: ("v_t > 0, f_t = -μ f_n", r"v_t > 0,\ f_t = -\mu f_n"),
    Mode.SLIP_BACKWARD: ("v_t < 0, f_t = μ f_n", r"v_t < 0,\ f_t = \mu f_n"),
}
"""Coulomb's law in each mode of a closed contact, as text and as LaTeX."""

LONGEST_EXPRESSION = 80
"""Number of characters up to which the arming condition of a contact is stated as an expression."""


def formulate_robot(robot: "Robot", values: Mapping[str, float] | None = None) -> Formulation:
    """Return the coordinates, equations of motion, contact law and parameters of a walker.

    Parameters
    ----------
    robot : Robot
    values : mapping of str to float, optional
        Values of all parameters; by default those of the robot.

    Returns
    -------
    Formulation
        Printed as text, and displayed as LaTeX in a notebook.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> print(formulate_robot(compass_biped()))  # doctest: +ELLIPSIS, +NORMALIZE_WHITESPACE
    Robot compass_biped
      coordinates  q = (x, y, th1, th2), x and y of the stance foot; v = dq/dt
      torques      u = (ankle, hip)
      motion       M(q) dv/dt + h(q, v) = E(q) u + (f_t, f_n, 0, ...)
      ...
    """
    coordinates = _coordinates(("x", "y", *robot.angles), ", x and y of the stance foot")
    return _formulate(robot, (coordinates, *list_actuators(robot), motion_of_walker(robot)), values)


def formulate_planar_robot(robot: "PlanarRobot", values: Mapping[str, float] | None = None) -> Formulation:
    """Return the coordinates, equations of motion, contacts and parameters of a robot with several contacts.

    Examples
    --------
    >>> from gaitopt.model.robots.vertical_hopper import vertical_hopper
    >>> [line.text for line in formulate_planar_robot(vertical_hopper()).formulas][:1]
    ['q = (body, foot); v = dq/dt']
    """
    lines = (_coordinates(robot.coordinates, ""), *list_actuators(robot), *motion_of_planar_robot(robot))
    return _formulate(robot, lines, values)


def _formulate(
    robot: "Robot | PlanarRobot", lines: tuple[Formula, ...], values: Mapping[str, float] | None
) -> Formulation:
    known = {each.name: each.default for each in robot.parameters} if values is None else values
    laws = (Formula(mode.value, *FRICTION[mode]) for mode in FRICTION)
    return Formulation(f"Robot {robot.name}", (*lines, *laws, *list_parameters("parameters", robot.parameters, known)))


def _coordinates(names: Sequence[str], remark: str) -> Formula:
    symbols = r",\ ".join(map(latex_name, names))
    latex = rf"q = ({symbols})" + (rf"\ \text{{{remark}}}" if remark else "") + r",\quad v = \dot q"
    return Formula("coordinates", f"q = ({', '.join(names)}){remark}; v = dq/dt", latex)


def list_actuators(robot: "Robot | PlanarRobot") -> tuple[Formula, ...]:
    """Return the vector of torques and forces of a robot's actuators; none without actuators."""
    if not robot.actuators:
        return ()
    symbols = r",\ ".join(map(latex_name, robot.actuators))
    return (Formula("torques", f"u = ({', '.join(robot.actuators)})", f"u = ({symbols})"),)


def motion_of_walker(robot: "Robot") -> Formula:
    """Return the equations of motion of a walker in the coordinates of its stance foot."""
    drive, latex = ("E(q) u + ", r"E(q)\, u + ") if robot.actuators else ("", "")
    return Formula(
        "motion",
        f"M(q) dv/dt + h(q, v) = {drive}(f_t, f_n, 0, ...)",
        rf"M(q)\, \dot v + h(q, v) = {latex}(f_t, f_n, 0, \dots)^\mathsf{{T}}",
    )


def motion_of_planar_robot(robot: "PlanarRobot") -> tuple[Formula, ...]:
    """Return the equations of motion of a robot with several contacts, and these contacts."""
    drive, latex = ("E(q) u + ", r"E(q)\, u + ") if robot.actuators else ("", "")
    motion = Formula(
        "motion",
        f"M(q) dv/dt + h(q, v) = {drive}Σ (∂n_c/∂q)ᵀ f_n + (∂t_c/∂q)ᵀ f_t over the closed contacts c "
        "with gap n_c and slide coordinate t_c",
        rf"M(q)\, \dot v + h(q, v) = {latex}\sum_c \left(\partial n_c / \partial q\right)^\mathsf{{T}} f_{{n,c}}"
        r" + \left(\partial t_c / \partial q\right)^\mathsf{T} f_{t,c}",
    )
    contacts = [
        (f"{each.name} ({each.kind})", rf"{latex_name(each.name)}\ (\text{{{each.kind}}})") for each in robot.contacts
    ]
    return motion, *collect("contacts", contacts), *_list_arming_conditions(robot)


def _list_arming_conditions(robot: "PlanarRobot") -> tuple[Formula, ...]:
    """Return the conditions under which contacts close, one line for the contacts of each condition."""
    if not any(contact.conditional for contact in robot.contacts):
        return ()
    rates = robot.state_names[robot.n_q :]
    names = robot.coordinates, rates, [*(each.name for each in robot.parameters), *robot.switches]
    symbols = [ca.vertcat(ca.SX(0, 1), *map(ca.SX.sym, group)) for group in names]
    conditions: dict[str, list[str]] = {}
    for contact, expression in zip(robot.contacts, ca.vertsplit(robot.arming(*symbols)), strict=True):
        if contact.conditional:
            text = str(expression)
            if len(text) > LONGEST_EXPRESSION or "@" in text:  # CasADi abbreviates common parts as @1, @2, ...
                text = f"armed(q, v) of {contact.name}"
            text = text[1:-1] if text[0] == "(" else text  # CasADi encloses every sum and product
            conditions.setdefault(text, []).append(contact.name)
    lines = [f"{' and '.join(names)} may close only while {text} > 0" for text, names in conditions.items()]
    return tuple(
        Formula("" if number else "armed", line, rf"\text{{{escape_latex(line)}}}") for number, line in enumerate(lines)
    )


def list_parameters(label: str, parameters: Iterable[Parameter], values: Mapping[str, float]) -> tuple[Formula, ...]:
    """Return the values of parameters, four to a line; infinite ones are left out."""
    entries = [
        assign(each.name, values[each.name], each.unit) for each in parameters if math.isfinite(values[each.name])
    ]
    rows = [entries[start : start + 4] for start in range(0, len(entries), 4)]
    return tuple(line for i, row in enumerate(rows) for line in collect(label if i == 0 else "", row))
