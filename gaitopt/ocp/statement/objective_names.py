"""Built-in objectives by name, for the command line and for problems."""

from gaitopt.errors import InputError, suggest
from gaitopt.ocp.statement.criteria import (
    CostOfTransport,
    Duration,
    FootSlide,
    ImpactLoss,
    PeakFrictionDemand,
    PeakTorque,
    PositiveWork,
    TorqueRate,
    TorqueSquared,
)
from gaitopt.ocp.statement.objective import Objective

OBJECTIVES: dict[str, type[Objective]] = {
    objective.name: objective
    for objective in (
        CostOfTransport,
        TorqueSquared,
        PositiveWork,
        TorqueRate,
        FootSlide,
        ImpactLoss,
        PeakTorque,
        PeakFrictionDemand,
        Duration,
    )
}


def objective_named(name: str | Objective) -> Objective:
    """Return an objective from its name.

    Raises
    ------
    InputError
        If the name is unknown; the message names the nearest.  For anything else, it states how a custom objective is
        written.

    Examples
    --------
    >>> objective_named("torque_squared")
    TorqueSquared()
    """
    if isinstance(name, Objective):
        return name
    if not isinstance(name, str):
        advice = (
            f"Call it: objective={name.__name__}()."
            if isinstance(name, type)
            else "A custom one derives from Objective, see the guide 'Built-in, weighted and custom objectives'."
        )
        raise InputError(f"objective must be a name or an Objective, got {name!r}. {advice} {suggest('', OBJECTIVES)}")
    if name not in OBJECTIVES:
        raise InputError(f"There is no objective {name!r}. {suggest(name, OBJECTIVES)}")
    return OBJECTIVES[name]()
