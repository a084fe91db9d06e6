"""Imitation gaits: the joint angles of a passive gait, reproduced by actuators on other ground."""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.inverse_dynamics import prescribed_angles
from gaitopt.control.law import Law, passive
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.energy import cost_of_transport
from gaitopt.motion.gait import Gait, SolverReport, cone_margin
from gaitopt.motion.motion import Array, Motion, Segment
from gaitopt.ocp.transcription.method import check_count
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.simulation.simulator import record_walk
from gaitopt.stability.assessment import assess_stability
from gaitopt.stability.cycle import Cycle
from gaitopt.status import Status, Stop
from gaitopt.version import __version__

WIDEST = 1.5
"""Largest interval between samples that are kept, relative to the requested one, if there are samples in between."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Imitation:
    """A passive gait's angles over one step, reproduced by torques on other ground.

    Attributes
    ----------
    robot : Robot
    motion : Motion
        Simulated step; the forces on this ground decide between stick and slip.
    stop : Stop
        Reason why the simulation ended.
    feasible : bool
        Whether the step reached its touchdown (no lift-off, the trailing foot separates) and repeats.
    reasons : tuple of str
        Reasons why it is not feasible.
    cost_of_transport : float
    cone_margin : float
        Smallest 1 - abs(f_t) / (mu f_n) while sticking.
    largest_torque : float [N m]
    gap : float
        Largest difference between the states after the step and at its start.

    Examples
    --------
    Returned by :func:`gaitopt.study.imitate`; its method returns it as a gait:

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
        """Simulated contact sequence; None if the step did not reach its touchdown."""
        return self.motion.sequence()

    def gait(self, *, samples: int = 60) -> Gait:
        """Return the step as a gait, which can be saved, replayed, assessed and stabilised like an optimised one.

        Parameters
        ----------
        samples : int
            Approximate number of samples of its torques, which are linear in between.

        Raises
        ------
        InputError
            If the imitation is not feasible.
        """
        if not self.feasible or self.sequence is None:
            raise InputError(f"This imitation is not feasible: {' '.join(self.reasons)}")
        return _as_gait(
            self.robot, self.sequence, thin_samples(self.motion, samples), self.gap, "imitation of a passive gait"
        )


@check_arguments
def imitate(robot: Robot, cycle: Cycle, parameters: Mapping[str, float], *, tolerance: float = 1e-3) -> Imitation:
    """Simulate the joint angles of a passive gait on other ground, with torques by inverse dynamics.

    The initial state is that of the gait.  While the foot slides, its motion follows from the angles and from friction;
    the torques follow by inverse dynamics in the current contact mode.

    Parameters
    ----------
    robot : Robot
        Robot with an actuator for each angle.
    cycle : Cycle
        Passive gait of one step.
    parameters : mapping of str to float
        Changed parameters, such as ``{"slope": 0.0}``; all others keep the values of the gait.
    tolerance : float
        Largest difference between the states after the step and at its start for which the step counts as periodic.

    Raises
    ------
    InputError
        If the gait has several steps, or a parameter is invalid.

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
        raise InputError(f"The imitated gait must repeat after one step, got the contact sequences {cycle.sequence!r}.")
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
        difference = np.abs(np.concatenate([jump.q_next, jump.v_next]) - start)
        gap = float(np.max(difference[robot.state_entries.without_position]))
        if not gap <= tolerance:
            reasons.append(
                f"The step does not repeat: the state after it differs by {gap:.2g} from the state at its start."
            )
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


@check_arguments
def controlled_gait(gait: Gait, law: Law, *, samples: int = 100) -> Gait:
    """Return the periodic gait under a control law as a gait: a plan within the torque limits of the law.

    Parameters
    ----------
    gait : Gait
        Initial guess of the periodic gait; its torques may exceed the limits.
    law : Law
    samples : int
        Approximate number of samples of its torques, which are linear in between.

    Raises
    ------
    InputError
        If no periodic gait is found near it.

    Examples
    --------
    >>> from gaitopt import joint_pd, load
    >>> from gaitopt.study import controlled_gait
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> limited = controlled_gait(gait, joint_pd(gait.robot, gait.motion, damping=2, torque_limit=8))
    >>> str(limited.sequence), abs(limited.cost_of_transport - gait.cost_of_transport) < 1e-5
    ('slip+ stick | slip+', True)
    """
    check_count("samples", samples, 1, 1_000_000)
    cycle = assess_stability(gait, law)
    walker = make_walker(gait.robot, law, cycle.parameters, period=gait.period)
    motion = record_walk(walker, cycle.section.embed(cycle.z), 1).motion
    return _as_gait(
        gait.robot, cycle.sequences[0], thin_samples(motion, samples), cycle.residual, f"walked under {law.name}"
    )


def thin_samples(motion: Motion, samples: int) -> Motion:
    """Return a motion with approximately `samples` samples per step, including the ends of its segments."""
    step = motion.period / max(len(motion.jumps), 1) / samples
    return replace(motion, segments=tuple(_thin_samples(segment, step) for segment in motion.segments))


def _thin_samples(segment: Segment, step: float) -> Segment:
    time = segment.time
    count = max(round(segment.duration / step), 8)
    keep = np.unique([0, *_find_nearest(time, np.linspace(time[0], time[-1], count + 1)), time.size - 1])
    # Samples of an integrator may be uneven, and the error between those that are kept grows with the fourth power of
    # their distance.
    wide = np.flatnonzero(np.diff(time[keep]) > WIDEST * step)
    keep = np.unique([*keep, *_find_nearest(time, (time[keep[wide]] + time[keep[wide + 1]]) / 2)])
    keep = keep[np.append(np.diff(time[keep]) > 0, True)]  # a switch at an end of the segment is sampled twice
    values = {entry.name: getattr(segment, entry.name) for entry in fields(segment)}
    series: dict[str, Any] = {name: x[..., keep] for name, x in values.items() if isinstance(x, np.ndarray)}
    return replace(segment, **series)


def _find_nearest(time: Array, targets: Array) -> list[int]:
    """Return the indices of the samples that are nearest to some times."""
    after = np.clip(np.searchsorted(time, targets), 1, time.size - 1)
    return (after - (targets - time[after - 1] < time[after] - targets)).tolist()


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
