"""Imitation gaits: a passive gait's angles over time walked by motors on other ground."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from gaitopt import __version__
from gaitopt.control.inverse_dynamics import prescribed_angles
from gaitopt.control.law import Law, passive
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.energy import cost_of_transport
from gaitopt.motion.gait import Gait, SolverReport, cone_margin
from gaitopt.motion.motion import Motion, Segment
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.simulation.simulator import record_walk
from gaitopt.stability.assessment import assess_stability
from gaitopt.stability.cycle import Cycle
from gaitopt.status import Status, Stop


@dataclass(frozen=True, eq=False, kw_only=True)
class Imitation:
    """A passive gait's angles over one step, reproduced by torques on other ground.

    Attributes
    ----------
    robot : Robot
    motion : Motion
        What the simulator walked; stick and slip are decided afresh by the forces on this ground.
    stop : Stop
        Why it ended.
    feasible : bool
        Whether the step reached its touchdown (no lift-off, the trailing foot separates) and repeats.
    reasons : tuple of str
        Why it is not feasible.
    cost_of_transport : float
    cone_margin : float
        Smallest 1 - abs(f_t) / (mu f_n) while sticking.
    largest_torque : float [N m]
    gap : float
        Largest difference between the state after the step and that at its start.

    Examples
    --------
    Made by :func:`gaitopt.study.imitate`, turned into a gait by its method:

    >>> Imitation.gait.__name__
    'gait'
    """

    robot: Robot
    motion: Motion
    stop: Stop
    feasible: bool
    reasons: tuple[str, ...]
    cost_of_transport: float
    cone_margin: float
    largest_torque: float
    gap: float

    @property
    def sequence(self) -> ContactSequence | None:
        """What was walked; None if the step did not reach its touchdown."""
        return self.motion.sequence()

    def gait(self, *, samples: int = 60) -> Gait:
        """Return the step as a gait, to be saved, replayed, assessed and given feedback like an optimised one.

        Parameters
        ----------
        samples : int
            About how many samples its torques, linear in between, are kept at.

        Raises
        ------
        InputError
            If the imitation is not feasible.
        """
        if not self.feasible or self.sequence is None:
            raise InputError(f"This imitation cannot be walked: {' '.join(self.reasons)}")
        return _as_gait(
            self.robot, self.sequence, thin_samples(self.motion, samples), self.gap, "imitation of a passive gait"
        )


def imitate(robot: Robot, cycle: Cycle, parameters: Mapping[str, float], *, tolerance: float = 1e-3) -> Imitation:
    """Walk the angles of a passive gait on other ground: its torques follow from them, stick and slip from the forces.

    The start is the gait's own.  While the foot slides, its motion follows from the angles and from friction; the
    torques follow by inverse dynamics in the mode the foot is in.

    Parameters
    ----------
    robot : Robot
        With an actuator for each angle.
    cycle : Cycle
        A gait of one step.
    parameters : mapping of str to float
        What changes, such as ``{"slope": 0.0}``; the rest as in the gait.
    tolerance : float
        Largest difference between the state after the step and that at its start of a step that repeats.

    Raises
    ------
    InputError
        If the gait has several steps, or a parameter cannot be.

    Examples
    --------
    >>> import math
    >>> from gaitopt import compass_biped, find_cycles
    >>> from gaitopt.study import imitate
    >>> robot = compass_biped()
    >>> downhill = {"slope": math.radians(1), "friction": 0.3}
    >>> passive_gait = find_cycles(robot, downhill, sequence="stick | stick", starts=30)[0]
    >>> level = imitate(robot, passive_gait, {"slope": 0.0})
    >>> level.feasible, str(level.sequence), round(level.cost_of_transport, 4)
    (True, 'stick | stick', 0.0175)
    """
    if len(cycle.sequences) != 1:
        raise InputError(f"Only gaits of one step can be imitated, not {cycle.sequence!r}.")
    law = passive(robot)
    start = cycle.section.embed(cycle.z)
    walker = make_walker(robot, law, cycle.parameters)
    model = thin_samples(record_walk(walker, start, 1).motion, 80)
    values = robot.resolve({**cycle.parameters, **parameters})
    law = prescribed_angles(robot, model, values)
    walker = make_walker(robot, law, values, period=cycle.period)
    walk = record_walk(walker, start, 1)
    motion, reasons = walk.motion, []
    gap = float("inf")
    if walk.stop is not Stop.STEPS_DONE:
        reasons.append(walk.stop.hint)
    else:
        jump = motion.jumps[-1]
        after = np.concatenate([jump.q_next[2:], jump.v_next])
        gap = float(np.max(np.abs(after - start[2:])))
        if not gap <= tolerance:
            reasons.append(f"The step does not repeat: the state after it differs by {gap:.2g} from that at its start.")
    torque = motion.channel("torque") if motion.segments else np.full((1, 1), np.nan)
    return Imitation(
        robot=robot,
        motion=motion,
        stop=walk.stop,
        feasible=not reasons,
        reasons=tuple(reasons),
        cost_of_transport=cost_of_transport(motion),
        cone_margin=cone_margin(motion),
        largest_torque=float(np.max(np.abs(torque))),
        gap=gap,
    )


def controlled_gait(gait: Gait, law: Law, *, samples: int = 100) -> Gait:
    """Return the periodic gait of a walker under a law as a gait of its own: a plan that keeps the law's torque limits.

    Parameters
    ----------
    gait : Gait
        A periodic gait is looked for near this one, which itself may ask for more torque than there is.
    law : Law
    samples : int
        About how many samples its torques, linear in between, are kept at.

    Raises
    ------
    InputError
        If there is no periodic gait near it.

    Examples
    --------
    >>> from gaitopt import joint_pd, load
    >>> from gaitopt.study import controlled_gait
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> walked = controlled_gait(gait, joint_pd(gait.robot, gait.motion, damping=2, torque_limit=8))
    >>> str(walked.sequence), abs(walked.cost_of_transport - gait.cost_of_transport) < 1e-5
    ('slip+ stick | slip+', True)
    """
    cycle = assess_stability(gait, law)
    walker = make_walker(gait.robot, law, cycle.parameters, period=gait.period)
    motion = record_walk(walker, cycle.section.embed(cycle.z), 1).motion
    return _as_gait(
        gait.robot, cycle.sequences[0], thin_samples(motion, samples), cycle.residual, f"walked under {law.name}"
    )


def thin_samples(motion: Motion, samples: int) -> Motion:
    """Return a motion with about as many samples per step, the ends of its segments among them."""
    step = motion.period / max(len(motion.jumps), 1) / samples
    return replace(motion, segments=tuple(_thin_samples(segment, step) for segment in motion.segments))


def _thin_samples(segment: Segment, step: float) -> Segment:
    count = max(round(segment.duration / step), 8)
    wanted = np.linspace(segment.time[0], segment.time[-1], count + 1)
    after = np.clip(np.searchsorted(segment.time, wanted), 1, segment.time.size - 1)
    nearer = after - (wanted - segment.time[after - 1] < segment.time[after] - wanted)
    keep = np.unique(np.concatenate([[0], nearer, [segment.time.size - 1]]))
    values = {entry.name: getattr(segment, entry.name) for entry in fields(segment)}
    series: dict[str, Any] = {name: x[..., keep] for name, x in values.items() if isinstance(x, np.ndarray)}
    return replace(segment, **series)


def _as_gait(robot: Robot, sequence: ContactSequence, motion: Motion, gap: float, name: str) -> Gait:
    largest = float(np.max(np.abs(motion.channel("torque"))))
    cost = cost_of_transport(motion)
    return Gait(
        robot=robot,
        sequence=sequence,
        status=Status.SOLVED,
        motion=motion,
        problem={
            "name": name,
            "objective": "none",
            "sequence": str(sequence),
            **motion.parameters,
            "torque_limit": dict.fromkeys(motion.actuators, largest),
        },
        solver=SolverReport(
            iterations=0,
            objective=cost,
            constraint_violation=gap,
            error_between_nodes=float("nan"),
            build_seconds=0.0,
            solve_seconds=0.0,
            message=name,
        ),
        versions={"gaitopt": __version__},
    )
