"""The position of the base of a recorded motion, from the contacts on which the robot stands."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.motion.recorded_columns import RecordedColumns

EXACT = 1e-9
"""Error up to which a coordinate lifts all contacts by its own change [m]."""


def derive_base(
    robot: PlanarRobot, values: Mapping[str, float], sequence: PhaseSequence, recorded: RecordedColumns
) -> RecordedColumns:
    """Return a recorded motion with the position of the base, if it is missing and a foot stands in all phases.

    At each instant the lowest contact of the standing foot is on the ground; along the ground, this contact does not
    move until the next instant.  A motion in which other coordinates are missing is returned as it is.

    Parameters
    ----------
    robot : PlanarRobot
    values : mapping of str to float
        Values of all parameters.
    sequence : PhaseSequence
    recorded : RecordedColumns
    """
    missing = {name for name in robot.coordinates if name not in recorded.coordinates}
    height, standing = _find_height(robot, values), _list_standing(robot, sequence)
    if not missing or not standing or not missing <= {height, robot.travel}:
        return recorded
    q = np.array([recorded.coordinates.get(name, np.zeros(recorded.time.size)) for name in robot.coordinates])
    p = np.asarray(robot.vector(dict(values)), dtype=float)
    columns = np.tile(p[:, None], (1, q.shape[1]))
    gaps, slides = (np.array(part)[standing] for part in robot.gaps.map(q.shape[1])(q, columns))
    lowest = np.argmin(gaps, axis=0)
    derived = {}
    if height in missing:
        derived[height] = -gaps.min(axis=0)
    if robot.travel in missing:
        kept = lowest[:-1], np.arange(q.shape[1] - 1)
        moved = slides[:, 1:][kept] - slides[:, :-1][kept]
        derived[robot.travel] = np.concatenate([[0.0], -np.cumsum(moved)])
    names = [robot.contact_names[standing[i]] for i in dict.fromkeys(lowest.tolist())]
    remark = (
        f"{' and '.join(derived)} {'are' if len(derived) > 1 else 'is'} not in the file: derived from "
        f"{' and then '.join(names)}, on the ground without slip"
    )
    coordinates: dict[str, Array] = {**recorded.coordinates, **derived}
    return replace(recorded, coordinates=coordinates, warnings=(*recorded.warnings, remark))


def _find_height(robot: PlanarRobot, values: Mapping[str, float]) -> str | None:
    """Return the coordinate that lifts all contacts with the ground by its own change; None without any."""
    feet = [i for i, contact in enumerate(robot.contacts) if not contact.is_stop]
    p, q = np.asarray(robot.vector(dict(values)), dtype=float), np.full(robot.n_q, 0.3)
    for name, direction in zip(robot.coordinates, np.eye(robot.n_q), strict=True):
        before, after = (np.array(robot.gaps(place, p)) for place in (q, q + direction))
        lifts, moves = ((b - a).ravel()[feet] for b, a in zip(after, before, strict=True))
        if np.allclose(lifts, 1.0, atol=EXACT) and np.allclose(moves, 0.0, atol=EXACT):
            return name
    return None


def _list_standing(robot: PlanarRobot, sequence: PhaseSequence) -> list[int]:
    """Return the contacts that close in any phase, of the bodies that are on the ground in all phases."""
    if sequence.is_open:
        return []
    bodies, closed = list[set[str]](), set[int]()
    for state in sequence.states(robot):
        down = {
            i
            for i, contact in enumerate(robot.contacts)
            if not (contact.is_stop or contact.falls) and state.mode(contact.name) is not Mode.FREE
        }
        bodies.append({robot.contacts[i].body for i in down})
        closed |= down
    stand = set.intersection(*bodies) if bodies else set()
    return sorted(i for i in closed if robot.contacts[i].body in stand)
