"""Compass biped that walks with a double support, in which the trailing foot is dragged forward.

Solve it with ``gaitopt solve problems/compass_double_support.py``.  With both feet at rest the robot is rigid, so one
of them slips.  The gait that lifts its trailing foot at touchdown is solved with ``--set sequence="stick | stick"``.
"""

import numpy as np

from gaitopt import Collocation, Margins
from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
from gaitopt.ocp import PlanarKeyframes, PlanarLimits, PlanarProblem, PoseGuess

LEG_LENGTH = 1.6  # [m]


def dragged_guess(step_length, period, double_support=0.25, drag=0.75):
    """Return a guess in which the trailing foot is dragged by the fraction `drag` of the step in double support."""
    hip = np.array([-1, drag - 1, 1]) * step_length / 2  # ahead of the foot that sticks, at the ends of the phases
    trailing = np.array([-1, drag - 1, 1]) * step_length / 2
    coordinates = {"x": hip - hip[0], "y": np.sqrt(LEG_LENGTH**2 - hip**2)}
    coordinates |= {"a": np.arcsin(trailing / LEG_LENGTH), "b": -np.arcsin(hip / LEG_LENGTH)}
    times = np.array([0, double_support, 1]) * period
    return PlanarKeyframes(times, coordinates, phases=np.diff(times))


def problem(
    sequence="foot A slip+, foot B stick > foot B stick |",  # phases and events of a step
    friction=0.4,  # Coulomb coefficient
    speed=0.25,  # [m/s]
    step_length=0.4713,  # [m]
    torque_limit=np.inf,  # of ankle and hip each [N m]
    double_intervals=8,  # grid intervals of the phase with two feet on the ground
    single_intervals=16,  # grid intervals of a phase with one foot on the ground
):
    """Return the problem of a step; the ankle torque acts at the foot that sticks."""
    double = "foot A slip+, foot B stick" in sequence
    idle, phases = ("ankle A" if double else "ankle B"), sequence.replace("|", ">").split(">")[:-1]
    counts = [double_intervals if "," in phase else single_intervals for phase in phases]
    return PlanarProblem(
        name="compass with double support",
        robot=compass_with_two_feet(),
        sequence=sequence,
        friction=friction,
        speed=speed,
        step_length=step_length,
        objective="torque_squared",
        limits=PlanarLimits(torque={"ankle A": torque_limit, "ankle B": torque_limit, "hip": torque_limit, idle: 0}),
        margins=Margins(slip_speed=0, impact_cone=0, separation=0, normal_force=0) if double else Margins(),
        guess=dragged_guess(step_length, step_length / speed) if double else PoseGuess(),
        transcription=Collocation(intervals=tuple(counts) if double else single_intervals),
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
