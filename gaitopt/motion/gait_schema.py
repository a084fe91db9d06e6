"""Content of gait files: types, shapes, and agreement of phases and events, checked before a gait is used."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gaitopt.errors import InputError
from gaitopt.motion.motion import LARGEST, Array, Motion, are_finite
from gaitopt.motion.nlp_solution import Solution
from gaitopt.motion.planar_gait import AnyGait, PlanarGait
from gaitopt.motion.planar_motion import PlanarMotion
from gaitopt.parameters import NONNEGATIVE

_TYPES: dict[Any, tuple[type, ...]] = {float: (int, float), int: (int,), str: (str,), bool: (int, bool)}
"""Accepted types of the values of a field by its type, the usual one last."""

_TEXTS = ("objective", "objective_unit", "name", "robot", "sequence", "transcription")
_MAPPINGS = ("objective_parameters", "coordinate_limit", "torque_rate_limit", "margins")

MOST_PHASES = 1000
"""Largest number of phases of a gait."""


def check_gait_content(gait: AnyGait) -> None:
    """Raise InputError if the content of a gait that was read is inconsistent.

    The numbers of a solved gait must be finite; a failed solve may end at any numbers.

    Parameters
    ----------
    gait : Gait or PlanarGait

    Raises
    ------
    InputError
        With the place, its value and what is accepted.

    Examples
    --------
    >>> from gaitopt import load
    >>> check_gait_content(load("docs/examples/compass_slip.h5"))
    """
    _check_problem(gait.problem)
    records = [("solver", gait.solver), ("verification", gait.verification)]
    records += [(name, getattr(gait, name, None)) for name in ("proposal", "certificate")]
    for name, record in records:
        if record is not None:
            _check_record(name, record)
    if gait.solution is not None:
        _check_solution(gait.solution)
    motion = gait.motion
    _require(bool(motion.total_mass > 0 and math.isfinite(motion.total_mass)), "total mass", motion.total_mass, "> 0")
    _check_parameters(motion.parameters)
    _require(0 < len(motion.segments) <= MOST_PHASES, "number of phases", len(motion.segments), f"1 to {MOST_PHASES}")
    count = len(motion.points)
    valid = all(0 <= end < count for link in motion.links for end in link)
    _require(valid, "links", motion.links, f"numbers of points from 0 to {count - 1}")
    if isinstance(gait, PlanarGait):
        _check_planar_motion(gait.motion, finite=gait.status.ok)
    else:
        _check_motion(gait.motion, finite=gait.status.ok)


def _require(valid: bool, name: str, value: Any, accepted: str) -> None:
    if not valid:
        raise InputError(f"{name} is {value!s:.200}, accepted: {accepted}")


def _check_problem(problem: Mapping[str, Any]) -> None:
    _require("objective" in problem, "objective of the problem", None, "a string")
    for name in _TEXTS:
        _require(isinstance(problem.get(name, ""), str), f"{name} of the problem", problem.get(name), "a string")
    for name in _MAPPINGS:
        value = problem.get(name) or {}
        _require(isinstance(value, dict), f"{name} of the problem", value, "an object of names and values")
    intervals = problem.get("intervals", [1])
    valid = isinstance(intervals, list) and all(type(count) is int and count > 0 for count in intervals)
    _require(valid, "intervals of the problem", intervals, "a list of positive whole numbers")
    limit = problem.get("torque_limit", math.inf)
    limits = list(limit.values()) if isinstance(limit, dict) else [limit]
    numbers = all(isinstance(each, int | float) and each >= 0 for each in limits)
    _require(limit is None or numbers, "torque_limit of the problem", limit, "numbers >= 0")


def _check_record(name: str, record: Any) -> None:
    """Check that the numbers and texts of a record have the type of their field."""
    for field in dataclasses.fields(record):
        if field.type in _TYPES:
            value, types = getattr(record, field.name), _TYPES[field.type]
            _require(isinstance(value, types), f"{field.name} of {name}", repr(value), types[-1].__name__)


def _check_solution(solution: Solution) -> None:
    tables = [*solution.unknowns.items(), *solution.constraints.items()]
    for name, table in tables:
        shape, count = np.shape(table.values), len(table.rows)
        _require(len(shape) == 2 and shape[0] == count, f"shape of {name}", shape, f"{count} rows")
        _require(np.shape(table.multipliers) == shape, f"shape of the multipliers of {name}", shape, "that of values")
        _require(len(table.keys) == count, f"number of keys of {name}", len(table.keys), f"{count}")
    _require(all(count > 0 for count in solution.intervals), "intervals", solution.intervals, "positive whole numbers")


def _check_parameters(parameters: Mapping[str, float]) -> None:
    for name, value in parameters.items():
        _require(not math.isnan(value), f"parameter {name}", value, "a number")
        if name.endswith(NONNEGATIVE):
            _require(value >= 0, f"parameter {name}", value, ">= 0")
    _require(parameters.get("gravity", 1.0) > 0, "parameter gravity", parameters.get("gravity"), "> 0")
    for name in ("gravity", "slope", "friction"):
        _require(name in parameters, f"parameter {name}", "missing", "a number")


def _check_motion(motion: Motion, *, finite: bool) -> None:
    n_q, n_u, points = 2 + len(motion.angles), len(motion.actuators), len(motion.points)
    for number, segment in enumerate(motion.segments):
        count = _check_time(segment.time, number, finite=finite)
        rows: dict[str, tuple[int, ...]] = {"q": (n_q, count), "v": (n_q, count), "force": (2, count)}
        rows |= dict.fromkeys(("torque", "power", "work"), (n_u, count)) | {"points": (2, points, count)}
        rows |= dict.fromkeys(("friction_work", "kinetic", "potential", "damping_work", "elastic"), (count,))
        rows |= {} if segment.positive_work is None else {"positive_work": (n_u, count)}
        rows |= {} if segment.rims is None else {"rims": (4, 2, count)}
        _check_arrays(f"phase {number + 1}", segment, rows, finite=finite)
    _require(0 < len(motion.jumps) <= MOST_PHASES, "number of touchdowns", len(motion.jumps), f"1 to {MOST_PHASES}")
    states: dict[str, tuple[int, ...]] = dict.fromkeys(("q", "v_minus", "v_plus", "q_next", "v_next"), (n_q,))
    for number, jump in enumerate(motion.jumps):
        _check_arrays(f"touchdown {number + 1}", jump, states | {"impulse": (2,)}, finite=finite)
        _check_numbers(f"touchdown {number + 1}", jump, ("time", "energy_lost", "separation"), finite=finite)


def _check_planar_motion(motion: PlanarMotion, *, finite: bool) -> None:
    n_q, n_u, n_c = len(motion.coordinates), len(motion.actuators), len(motion.contact_entries)
    names = {entry.name for entry in motion.contact_entries}
    _require(len(motion.units) == n_q, "number of units", len(motion.units), f"{n_q}, one for each coordinate")
    _require(len(motion.actuator_units) == n_u, "number of units of actuators", len(motion.actuator_units), f"{n_u}")
    _require(motion.travel is None or motion.travel in motion.coordinates, "travel", motion.travel, "a coordinate")
    exchange = range(n_c) if motion.exchange is None else motion.exchange
    _require(sorted(exchange) == list(range(n_c)), "exchange", motion.exchange, f"each of 0 to {n_c - 1} once")
    for number, segment in enumerate(motion.segments):
        count = _check_time(segment.time, number, finite=finite)
        rows: dict[str, tuple[int, ...]] = {"q": (n_q, count), "v": (n_q, count), "force": (n_c, 2, count)}
        rows |= dict.fromkeys(("torque", "work"), (n_u, count)) | {"friction_work": (n_c, count)}
        rows |= dict.fromkeys(("damping_work", "kinetic", "potential", "elastic"), (count,))
        rows |= {"points": (2, len(motion.points), count)}
        _check_arrays(f"phase {number + 1}", segment, rows, finite=finite)
        contacts = dict.fromkeys(("gap", "slide", "slip_speed"), (n_c, count)) | {"rims": (4, n_c, count)}
        _check_arrays(f"phase {number + 1}", segment.kinematics, contacts, finite=False)  # a stop has no rim
        _check_names(f"phase {number + 1}", [name for name, _ in segment.state.modes], names)
    for number, event in enumerate(motion.events):
        place = f"event {number + 1}"
        rows = dict.fromkeys(("q", "v_minus", "v_plus"), (n_q,)) | {"impulse": (n_c, 2)}
        _check_arrays(place, event, rows, finite=finite)
        _check_numbers(place, event, ("time", "energy_lost", "switch_work"), finite=finite)
        for state in filter(None, (event.before, event.after, event.outcome)):
            _check_names(place, [name for name, _ in state.modes], names)
        for stage in event.actuator_impulses:
            rows = dict.fromkeys(("v_minus", "v_plus"), (n_q,)) | {"reaction": (n_c, 2)}
            rows |= dict.fromkeys(("impulse", "generated", "absorbed"), (n_u,))
            _check_arrays(f"impulses {stage.moment} {place}", stage, rows, finite=finite)
            _check_names(place, [name for name, _ in stage.outcome.modes], names)


def _check_time(time: Array, number: int, *, finite: bool) -> int:
    """Return the number of samples of a phase."""
    increasing = time.ndim == 1 and time.size > 0 and not np.any(np.diff(time) < 0)
    increasing &= are_finite(time) or not finite
    _require(increasing, f"time of phase {number + 1}", np.shape(time), "a vector of increasing times")
    return int(time.size)


def _check_arrays(place: str, source: Any, shapes: Mapping[str, tuple[int, ...]], *, finite: bool) -> None:
    for name, shape in shapes.items():
        array = getattr(source, name)
        _require(array.shape == shape, f"shape of {name} in {place}", array.shape, f"{shape}")
        if finite:
            _require(are_finite(array), f"{name} in {place}", "not finite", f"finite numbers of at most {LARGEST:g}")


def _check_numbers(place: str, source: Any, names: Sequence[str], *, finite: bool) -> None:
    for name in names:
        value = getattr(source, name)
        _require(are_finite(value) or not finite, f"{name} of {place}", value, f"a number of at most {LARGEST:g}")


def _check_names(place: str, contacts: Sequence[str], names: set[str]) -> None:
    _require(set(contacts) == names, f"contacts of {place}", contacts, ", ".join(sorted(names)))
