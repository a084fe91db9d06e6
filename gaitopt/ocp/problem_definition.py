"""Definition of a problem as plain data, in the file of a failed solve, and the problem restored from it."""

import dataclasses
import json
from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.kinematic_motion import PhaseKinematics, make_kinematic_motion
from gaitopt.motion.motion import Motion
from gaitopt.motion.planar_gait import AnyGait, PlanarGait
from gaitopt.motion.summary import plain
from gaitopt.ocp.multicontact.planar_guess import FromPlanarGait, PlanarGuess, PlanarKeyframes, PoseGuess
from gaitopt.ocp.multicontact.planar_limits import PlanarLimits
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.provenance import is_plain
from gaitopt.ocp.statement.initial_guess import DelayedSwing, Keyframes, LinearGuess, RandomPerturbation
from gaitopt.ocp.statement.limits import Limits, Margins
from gaitopt.ocp.statement.objective import Objective
from gaitopt.ocp.statement.objective_names import OBJECTIVES
from gaitopt.ocp.statement.stability_bound import StabilityBound
from gaitopt.ocp.statement.tracking import Tracking
from gaitopt.ocp.statement.warm_start import FromMotion, WarmStart
from gaitopt.ocp.transcription.collocation import Collocation
from gaitopt.ocp.transcription.shooting import MultipleShooting

KEY, REASON = "definition", "not_restorable"
"""Entry of ``gait.problem`` with the definition, and entry of the definition if the problem cannot be restored."""

MOST_SAMPLES = 31
"""Number of samples of a phase that are stored of a motion."""
LONGEST = 40_000
"""Longest text of a definition; an attribute of an HDF5 file has at most 64 kB."""

_NUMBERS = ("friction", "slope", "speed", "step_length", "name")
_CLASSES: tuple[type, ...] = (
    *OBJECTIVES.values(),
    *(LinearGuess, Keyframes, RandomPerturbation, DelayedSwing, PoseGuess, PlanarKeyframes),
    *(Collocation, MultipleShooting, Limits, PlanarLimits, Margins, StabilityBound),
)
_PARTS = {kind.__name__: kind for kind in _CLASSES}
"""Classes whose objects are restored from their fields."""


def record_definition(gait: AnyGait, problem: GaitProblem | PlanarProblem) -> AnyGait:
    """Return a gait whose `problem` contains the definition from which the problem can be solved again.

    Parameters
    ----------
    gait : Gait or PlanarGait
    problem : GaitProblem or PlanarProblem
        The problem that led to it.
    """
    try:
        definition = _define(problem)
        if len(json.dumps(plain(definition))) > LONGEST:
            raise InputError("its definition is too long")
    except InputError as error:
        definition = {REASON: str(error)}
    return gait.replace_fields(problem={**gait.problem, KEY: definition})


@check_arguments
def restore_problem(gait: AnyGait) -> GaitProblem | PlanarProblem:
    """Return the problem of a failed solve, to be solved again or changed.

    A guess or a motion to track is restored from at most 31 samples of each phase, a warm start without its
    multipliers.

    Parameters
    ----------
    gait : Gait or PlanarGait
        Result of a solve that did not lead to a gait, usually read from a file.

    Returns
    -------
    GaitProblem or PlanarProblem

    Raises
    ------
    InputError
        If the gait is a solution, whose file does not contain the definition, or the problem has a custom objective,
        guess or transcription, whose code is not in the file.

    Examples
    --------
    >>> from gaitopt import Collocation, GaitProblem, Limits, compass_biped, solve
    >>> gait = solve(GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.02, speed=0.6, step_length=0.45,
    ...     limits=Limits(torque=6), objective="torque_squared", transcription=Collocation(intervals=8)))
    >>> gait.status.key, restore_problem(gait).friction
    ('infeasible', 0.02)
    """
    definition = gait.problem.get(KEY)
    if not isinstance(definition, Mapping):
        raise InputError(
            f"The gait ({gait.status.key}) has no definition of its problem, which only failed solves contain; solve "
            "the script of the problem."
        )
    if REASON in definition:
        raise InputError(f"The problem cannot be restored: {definition[REASON]}. Solve the script of the problem.")
    fields = dict(definition)
    fields["objective"] = _sum([weight * _restore(term, gait) for weight, term in fields["objective"]])
    for name in ("limits", "margins", "guess", "transcription", "stability"):
        if name in fields:
            fields[name] = _restore(fields[name], gait)
    kind: Any = PlanarProblem if isinstance(gait, PlanarGait) else GaitProblem
    problem: GaitProblem | PlanarProblem = kind(
        robot=gait.robot, **{name: _tuples(value) for name, value in fields.items()}
    )
    return problem


def _sum(terms: Sequence[Objective]) -> Objective:
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total


def _define(problem: GaitProblem | PlanarProblem) -> dict[str, Any]:
    """Return a problem without its robot as plain data; InputError if a part is custom."""
    definition = {name: getattr(problem, name) for name in _NUMBERS}
    definition |= {
        "sequence": str(problem.sequence),
        "parameters": dict(problem.parameters),
        "objective": [[weight, _describe(term)] for weight, term in problem.objective.terms()],
    }
    definition |= {name: _describe(getattr(problem, name)) for name in ("limits", "margins", "transcription", "guess")}
    definition["free"] = {name: list(ends) for name, ends in problem.free.items()}
    if isinstance(problem, PlanarProblem):
        return definition | {"equations": problem.equations}
    return definition | {"stability": _describe(problem.stability)}


def _describe(part: Any) -> dict[str, Any] | None:
    """Return the class and the fields of a part of a problem."""
    if part is None:
        return None
    if isinstance(part, WarmStart | FromMotion):
        motion = part.gait.motion if isinstance(part, WarmStart) else part.motion
        return {"type": "FromMotion", "motion": _describe_motion(motion), "label": part.label}
    if isinstance(part, Tracking):
        return {"type": "Tracking", "motion": _describe_motion(part.motion), "rate_weight": part.rate_weight}
    if isinstance(part, FromPlanarGait):
        part = _keyframes_of(part)
    name = type(part).__name__
    if _PARTS.get(name) is not type(part):
        raise InputError(f"the code of {name} is not in the file")
    kind: Any = type(part)
    names = [field.name for field in (attrs.fields if attrs.has(kind) else dataclasses.fields)(kind)]
    fields = {name: _plain_field(getattr(part, name)) for name in names}
    custom = [name for name, value in fields.items() if not is_plain(value)]
    if custom:
        raise InputError(f"{name}.{custom[0]} is not plain data")
    return {"type": name, **fields}


def _plain_field(value: Any) -> Any:
    """Return arrays and mappings as lists and dictionaries."""
    if isinstance(value, Mapping):
        return {str(name): _plain_field(item) for name, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return [_plain_field(item) for item in value] if isinstance(value, list | tuple) else value


def _describe_motion(motion: Motion) -> dict[str, Any]:
    """Return the first step of a motion: samples of each phase."""
    first = [segment for segment in motion.segments if segment.step == motion.segments[0].step]
    phases = []
    for segment in first:
        chosen = np.unique(np.linspace(0, segment.time.size - 1, MOST_SAMPLES).round().astype(int))
        rows = {name: getattr(segment, name)[..., chosen].tolist() for name in ("time", "q", "v", "torque")}
        phases.append({"mode": segment.mode.value, **rows})
    return {"parameters": dict(motion.parameters), "phases": phases}


def _keyframes_of(guess: FromPlanarGait) -> PlanarGuess:
    """Return the motion of a gait as keyframes with the durations of its phases."""
    motion = guess.gait.motion
    time, first = np.unique(motion.channel("time"), return_index=True)
    chosen = np.unique(np.linspace(0, time.size - 1, 2 * MOST_SAMPLES).round().astype(int))
    q = motion.channel("q")[:, first]
    rows = {name: q[i, chosen].tolist() for i, name in enumerate(motion.coordinates)}
    durations = [float(segment.time[-1] - segment.time[0]) for segment in motion.segments]
    return PlanarKeyframes((time[chosen] - time[0]).tolist(), rows, durations)


def _restore(described: Any, gait: AnyGait) -> Any:
    """Return the part that :func:`_describe` described."""
    if described is None:
        return None
    fields = {name: _tuples(value) for name, value in described.items() if name != "type"}
    if "motion" in fields:
        fields["motion"] = _restore_motion(gait.robot, described["motion"])
        kind: Any = Tracking if described["type"] == "Tracking" else FromMotion
        return kind(**fields)
    return _PARTS[described["type"]](**fields)


def _restore_motion(robot: Any, described: Mapping[str, Any]) -> Motion:
    phases = []
    for phase in described["phases"]:
        arrays = {name: np.array(phase[name], dtype=float) for name in ("time", "q", "v")}
        torque = np.array(phase["torque"], dtype=float).reshape(robot.n_u, arrays["time"].size)
        phases.append(PhaseKinematics(mode=Mode(phase["mode"]), torque=torque, **arrays))
    return make_kinematic_motion(robot, described["parameters"], phases)


def _tuples(value: Any) -> Any:
    """Return lists, which JSON has instead of tuples, as tuples."""
    if isinstance(value, list):
        return tuple(map(_tuples, value))
    return {name: _tuples(item) for name, item in value.items()} if isinstance(value, dict) else value
