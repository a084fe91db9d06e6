"""Units of objectives of robots with several contacts, whose actuators may have torques and forces."""

from collections.abc import Iterable

from gaitopt.ocp.statement.criteria import TorqueRate, TorqueSquared
from gaitopt.ocp.statement.objective import Objective

SQUARES = {"N m": "N^2 m^2", "N": "N^2"}
"""Square of each unit of an actuator."""


def find_objective_unit(objective: Objective, actuator_units: Iterable[str]) -> str:
    """Return the unit of an objective: the squares of torques and forces are added in SI units.

    Parameters
    ----------
    objective : Objective
    actuator_units : iterable of str
        Units of the actuators that have a torque or force.

    Examples
    --------
    >>> find_objective_unit(TorqueSquared(), ["N m", "N"]), find_objective_unit(TorqueSquared(), ["N"])
    ('N^2 m^2 s + N^2 s', 'N^2 s')
    """
    units = [unit for unit in SQUARES if unit in set(actuator_units)]
    if not units or not all(isinstance(term, TorqueSquared | TorqueRate) for _, term in objective.terms()):
        return objective.unit
    if not objective.unit:  # squared torques and squared rates
        return ""
    return " + ".join(objective.unit.replace(SQUARES["N m"], SQUARES[unit]) for unit in units)
