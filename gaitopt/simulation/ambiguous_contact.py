"""Friction and cone margin with which the contacts of a plan have a unique motion where its replay is ambiguous.

If accelerations and impulses are unique for every slip of the closed contacts, whatever the forces on the robot, they
are unique for every mode.  The largest such friction coefficient depends on the posture alone.  With more friction, the
motion of a single contact that sticks is still unique if its force is in the cone of this coefficient: with the
mobility G of the contact, its normal acceleration without contact force is -(G_nn f_n + G_nt f_t), negative there.
"""

import itertools
import math

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.mode_selection import Determinacy
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.planar_motion import PlanarSegment
from gaitopt.simulation.planar_simulation.contact_resolution import ContactResolution
from gaitopt.simulation.planar_simulation.planar_simulator import PlanarRollout

BISECTIONS = 40
"""Number of bisections of the friction coefficient."""

MOST_FRICTION = 100.0
"""Largest coefficient of friction that is tried."""

SIDES = (Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD)
"""Modes of the contacts of a body whose forces must be determined."""


def describe_ambiguity(gait: PlanarGait, rollout: PlanarRollout) -> str:
    """Return a sentence on the contacts and the instant at which a replay is ambiguous, and what makes it unique.

    It is empty if contacts and friction are not the cause, or the ground is not a plane.

    Parameters
    ----------
    gait : PlanarGait
    rollout : PlanarRollout
        A replay that stopped with `Stop.AMBIGUOUS`.
    """
    planned, walked = gait.motion, rollout.motion
    if planned.terrain is not None:
        return ""
    start = planned.segments[len(walked.segments) % len(planned.segments)]
    time = float(walked.segments[-1].time[-1]) if walked.segments else float(planned.segments[0].time[0])
    ambiguous = _Closing(gait, start)
    friction, unique = planned.parameters["friction"], ambiguous.find_unique_friction()
    if not 0 < unique < friction:
        return ""
    least = math.floor(99 * unique) / 100 or unique
    names, margin = " and ".join(ambiguous.contacts), "cone" if ambiguous.in_modes else "impact_cone"
    text = (
        f"At {time:.4g} s the motion of {names} is unique if friction is at most {least:.3g}: set friction={least:.3g}"
    )
    ratio = friction * planned.parameters["static_friction_ratio"]
    if math.isinf(ratio):
        return f"{text}."
    share = math.ceil(100 * (1 - unique / ratio)) / 100
    return f"{text}, or keep the plan in the cone of this friction by Margins({margin}={share:.2f})."


class _Closing:
    """The closed contacts of a plan at the start of a phase.

    Attributes
    ----------
    contacts : list of str
        Those whose mode is ambiguous, or all with friction.
    in_modes : bool
        Whether their modes are ambiguous in the plan; otherwise the impact before is.
    """

    def __init__(self, gait: PlanarGait, segment: PlanarSegment) -> None:
        robot, self._parameters = gait.robot, gait.motion.parameters
        self._robot, self._q, self._v = robot, segment.q[:, 0], segment.v[:, 0]
        self._modes = dict(segment.state.modes)
        self._closed = [i for i, name in enumerate(robot.contact_names) if self._modes[name] is not Mode.FREE]
        latched = frozenset(i for i in self._closed if self._modes[robot.contact_names[i]] is Mode.LATCHED)
        choice = self._resolve(self._parameters["friction"]).modes(
            self._q, self._v, segment.torque[:, 0], self._closed, latched, {}
        )
        self.in_modes = choice.status is Determinacy.AMBIGUOUS
        rubbing = [robot.contact_names[i] for i in self._closed if robot.contacts[i].slides]
        changing = [name for name in rubbing if len({each.modes[name] for each in choice.candidates}) > 1]
        self.contacts = changing or rubbing

    def find_unique_friction(self) -> float:
        """Return the largest friction coefficient at which all slips are well posed; inf if there is none."""
        low, high = 0.0, MOST_FRICTION
        if self._is_well_posed(high):
            return math.inf
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            low, high = (middle, high) if self._is_well_posed(middle) else (low, middle)
        return low

    def _resolve(self, friction: float) -> ContactResolution:
        return ContactResolution(self._robot, self._robot.vector({**self._parameters, "friction": friction}))

    def _is_well_posed(self, friction: float) -> bool:
        """Return whether the forces are determined if each body sticks or slips in either direction."""
        contacts, robot = self._resolve(friction), self._robot
        bodies = {robot.contacts[i].body for i in self._closed if robot.contacts[i].slides}
        for sides in itertools.product(SIDES, repeat=len(bodies)):
            of_body = dict(zip(sorted(bodies), sides, strict=True))
            modes = self._modes | {
                robot.contact_names[i]: of_body[robot.contacts[i].body]
                for i in self._closed
                if robot.contacts[i].slides
            }
            if not contacts.is_well_posed(self._q, self._v, self._closed, modes):
                return False
        return True
