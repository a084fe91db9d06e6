"""define_law: a custom law from a function of state, plan and gains that returns the torques."""

import functools
import inspect
from collections.abc import Mapping
from typing import Any, Protocol

import casadi as ca
import numpy as np

from gaitopt.control.custom_laws.law_arguments import FeedbackPlan, FeedbackState, NamedEntries
from gaitopt.control.custom_laws.torque_expression import FORM, TorqueFunction, check_torque_expression, evaluate_torque
from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_feedback import find_section
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.control.planar_laws.planar_reference import PlanarReference, plan_impulses, planar_references
from gaitopt.control.reference import Reference, reference
from gaitopt.control.signature import LawInputs, control_function, law_inputs
from gaitopt.control.torque_saturation import limit_torque, torque_limits
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.locks import one_at_a_time
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array, Motion
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.parameters import Parameter, check_type

RESERVED = ("robot", "motion", "torque_limit")
"""Names of the arguments of the function that makes the law, which are not names of gains."""


class LawMaker(Protocol):
    """Function that makes a custom law for a motion."""

    def __call__(
        self,
        robot: Robot | PlanarRobot,
        motion: Motion | Gait | PlanarGait | None = None,
        torque_limit: float | Mapping[str, float] = np.inf,
        **gains: float,
    ) -> Any:
        """Return the law, a Law or PlanarLaw."""


def define_law(function: TorqueFunction) -> LawMaker:
    """Return the function (robot, motion, torque_limit, gains) that makes a custom law; used as a decorator.

    The decorated function is called with symbols once for each part of the plan and returns the torques as CasADi
    expressions.  All arguments after the first two are gains; they can be tuned.

    Parameters
    ----------
    function : callable
        Function ``(state, plan, gain=value, ...)``.  The state has the attributes `time` [s] (since the last touchdown
        or, with several contacts, since the impact that ends the period), `q` and `v`; the plan has `q`, `v` and
        `torque` at this time, `motion` and `part`.  Entries are selected by name: ``state.q["th1"]``,
        ``plan.torque["hip"]``.  The function returns a mapping of actuator to torque [N m or N], in which an actuator
        that is not named has its planned torque, or all torques in the order of the actuators.

    Returns
    -------
    callable
        Function ``(robot, motion, torque_limit=inf, **gains)`` that returns a Law if the motion is a Motion or Gait,
        or is omitted (law without a plan), and a PlanarLaw if it is a PlanarGait.  Gains that are not stated have
        their default values.  ``--law SCRIPT.py:FUNCTION`` accepts this function.

    Raises
    ------
    InputError
        If the function has another form; by the returned function, if the torques are invalid.

    Examples
    --------
    >>> from gaitopt import compass_biped, load
    >>> @define_law
    ... def hip_servo(state, plan, stiffness=10.0, damping=2.0):
    ...     error = state.q["th2"] - plan.q["th2"]
    ...     rate_error = state.v["th2"] - plan.v["th2"]
    ...     return {"hip": plan.torque["hip"] - stiffness * error - damping * rate_error}
    >>> law = hip_servo(compass_biped(), load("docs/examples/compass_slip.h5"), torque_limit=6, stiffness=20)
    >>> law.gain_values
    {'stiffness': 20.0, 'damping': 2.0}
    """
    defaults = _read_gains(function)

    def make_law(
        robot: Robot | PlanarRobot,
        motion: Motion | Gait | PlanarGait | None = None,
        torque_limit: float | Mapping[str, float] = np.inf,
        **gains: float,
    ) -> Law | PlanarLaw:
        for name in gains:
            if name not in defaults:
                raise InputError(f"The law {function.__name__!r} has no gain {name!r}. {suggest(name, defaults)}")
        return _make_law(_LawBuilder(function, {**defaults, **gains}, torque_limit), robot, motion)

    first = list(inspect.signature(make_law).parameters.values())[:3]
    keyword = inspect.Parameter.KEYWORD_ONLY
    last = [inspect.Parameter(name, keyword, default=value) for name, value in defaults.items()]
    functools.update_wrapper(make_law, function)
    setattr(make_law, "__signature__", inspect.Signature([*first, *last]))  # noqa: B010
    return make_law


@one_at_a_time
def _make_law(
    builder: "_LawBuilder", robot: Robot | PlanarRobot, motion: Motion | Gait | PlanarGait | None
) -> Law | PlanarLaw:
    """Return the law of a robot for a motion."""
    for name, value in builder.gains.items():
        Parameter(name, 0.0, "1", "").check(value)
    check_type("robot", robot, Robot | PlanarRobot, "a robot such as gait.robot")
    if isinstance(robot, Robot):
        motion = motion.motion if isinstance(motion, Gait) else motion
        if motion is not None:
            check_type("motion", motion, Motion, "the Gait of a robot with one foot on the ground, or its Motion")
        return builder.make_law(robot, motion)  # type: ignore[arg-type]
    check_type("motion", motion, PlanarGait, "the PlanarGait of a robot with several contacts, not its motion")
    return builder.make_planar_law(robot, motion)  # type: ignore[arg-type]


def _read_gains(function: TorqueFunction) -> dict[str, float]:
    """Return the gains of a custom law's function with their default values."""
    form = f"a function (state, plan, gain=value, ...) that returns {FORM}"
    name = getattr(function, "__name__", None)
    if isinstance(function, type) or not callable(function) or name is None:
        kind = f"the class {function.__name__}" if isinstance(function, type) else repr(function)
        raise InputError(f"define_law must be applied to {form}, got {kind}.")
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):  # a compiled function
        raise InputError(f"define_law must be applied to {form}, got {function!r}.") from None
    parameters, text = list(signature.parameters.values()), f"{name}{signature}"
    positional = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    if len(parameters) < 2 or any(
        each.kind not in positional or each.default is not each.empty for each in parameters[:2]
    ):
        raise InputError(f"define_law must be applied to {form}, got {text}.")
    gains = {}
    for parameter in parameters[2:]:
        if parameter.default is parameter.empty or parameter.kind is inspect.Parameter.POSITIONAL_ONLY:
            raise InputError(
                f"Every argument of {text} after state and plan is a gain and needs a default value, such as "
                f"{parameter.name}=1.0."
            )
        if parameter.name in RESERVED:
            raise InputError(f"The gain {parameter.name!r} of {text} needs another name than {', '.join(RESERVED)}.")
        gains[parameter.name] = Parameter(f"default of {parameter.name}", 0.0, "1", "").check(parameter.default)
    return gains


@dataclass(frozen=True, eq=False)
class _LawBuilder:
    """The function of a custom law with values of its gains and torque limits."""

    function: TorqueFunction
    gains: Mapping[str, float]
    torque_limit: float | Mapping[str, float]

    def make_law(self, robot: Robot, motion: Motion | None) -> Law:
        """Return the law of a robot with one foot on the ground; without a motion it has no plan."""
        names = ("x", "y", *robot.angles)
        if motion is None:
            inputs = law_inputs(robot, data=len(self.gains))
            nothing = NamedEntries(
                "planned value", (), ca.SX(0, 1), "The law has no planned motion; pass one, such as gait.motion."
            )
            plan, table, begins = FeedbackPlan(nothing, nothing, nothing, None, 0), np.zeros((0, 1)), np.zeros(1)
        else:
            references = reference(robot, motion)
            inputs = law_inputs(robot, data=references.size + len(self.gains))
            plan, table, begins = _plan(references, inputs, motion), references.table, references.breakpoints
        return self._finish(robot, names, (inputs, plan), table, begins)

    def make_planar_law(self, robot: PlanarRobot, gait: PlanarGait) -> PlanarLaw:
        """Return the law of a robot with several contacts."""
        section, parts = find_section(gait), []
        for number, references in enumerate(planar_references(gait)):
            inputs = law_inputs(robot, data=references.size + len(self.gains))
            plan = _planar_plan(references, inputs, gait, number)
            names, begins = robot.coordinates, references.breakpoints
            parts.append(self._finish(robot, names, (inputs, plan), references.table, begins))
        return PlanarLaw(self.function.__name__, section, tuple(parts), plan_impulses(gait))

    def _finish(
        self,
        robot: Robot | PlanarRobot,
        names: tuple[str, ...],
        arguments: tuple[LawInputs, FeedbackPlan],
        table: Array,
        begins: Array,
    ) -> Law:
        """Return the law about a part of the plan; the gains are the last rows of its table."""
        (inputs, plan), first = arguments, table.shape[0]
        state = FeedbackState(
            inputs.clock, NamedEntries("coordinate", names, inputs.q), NamedEntries("rate", names, inputs.v)
        )
        rows = {name: first + i for i, name in enumerate(self.gains)}
        symbols = {name: inputs.data[row] for name, row in rows.items()}
        torque = evaluate_torque(self.function, state, plan, symbols, robot.actuators)
        check_torque_expression(self.function.__name__, inputs, torque, robot.actuators)
        values = np.array([*self.gains.values()])[:, None]
        control = control_function(inputs, ca.cse(ca.densify(torque)))
        numbers = np.vstack([table, np.tile(values, begins.size)])
        law = Law(self.function.__name__, control, begins, numbers, rows)
        return limit_torque(law, torque_limits(robot, self.torque_limit))


def _plan(references: Reference, inputs: LawInputs, motion: Motion) -> FeedbackPlan:
    """Return the plan of a robot with one foot on the ground."""
    desired, robot = references.evaluate(inputs.clock, inputs.data), references.robot
    return FeedbackPlan(
        NamedEntries("planned coordinate", robot.angles, desired.angles),
        NamedEntries("planned rate", ("x", *robot.angles), ca.vertcat(desired.foot_speed, desired.rates)),
        NamedEntries("planned torque", robot.actuators, desired.torque),
        motion,
        0,
    )


def _planar_plan(references: PlanarReference, inputs: LawInputs, gait: PlanarGait, part: int) -> FeedbackPlan:
    """Return a part of the plan of a robot with several contacts."""
    robot, (q, v) = references.robot, references.state(inputs.clock, inputs.data)
    return FeedbackPlan(
        NamedEntries("planned coordinate", robot.coordinates, q),
        NamedEntries("planned rate", robot.coordinates, v),
        NamedEntries("planned torque", robot.actuators, references.torque(inputs.clock, inputs.data)),
        gait.motion,
        part,
    )
