"""Walker with latched knees and motors at hip and knees, on a slope too gentle for its passive gait.

The knee of the swing leg is released at touchdown and latches at the knee strike.  The branch of passive gaits of
kneed_walker.py, which walks down 2.9 degrees, turns back at 1.8 degrees.  Solve it with ``gaitopt solve
problems/kneed_walker_motors.py``.
"""

import math

import numpy as np

from gaitopt import Collocation, Margins
from gaitopt.model import kneed_walker
from gaitopt.ocp import PlanarKeyframes, PlanarLimits, PlanarProblem


def swing_guess(step_length, period):
    """Return a guess with a straight stance leg and a swing knee that is bent in the first half of the step."""
    part, reach = np.array([0, 0.27, 0.45, 0.62, 1]), np.arcsin(step_length / 2)
    stance = reach * np.array([1, 0.3, -0.1, -0.5, -1])
    coordinates = {
        "x": np.sin(stance[0]) - np.sin(stance),
        "y": np.cos(stance),
        "a": stance,
        "flexion_a": np.zeros(5),
        "b": reach * np.array([-1, 0.4, 1, 1.2, 1]),
        "flexion_b": (0, 0.45, 0.4, 0, 0),
    }
    return PlanarKeyframes(part * period, coordinates, phases=(0.62 * period, 0.38 * period))


def problem(
    sequence="foot A stick, knee A latched | foot A stick, knee A latched, knee B latched |",
    friction=1.0,  # Coulomb coefficient
    slope=1.0,  # downhill [deg]
    speed=0.7,  # [m/s]
    step_length=0.45,  # [m]
    hip_torque=10.0,  # largest torque of the hip [N m]
    knee_torque=2.0,  # of each knee [N m]
    bend=0.1,  # least flexion of the knee of the swing leg between release and strike [rad]
    straight=0.15,  # shortest duration of each phase [s], so that the knee is straight before the foot lands
    approach=0.2,  # least normal speed of the foot when it lands [m/s], and rate of the knee at the knee strike [rad/s]
    intervals=10,  # grid intervals of each phase
):
    """Return the problem of a step."""
    return PlanarProblem(
        name="kneed walker with motors",
        robot=kneed_walker(),
        sequence=sequence,
        friction=friction,
        slope=math.radians(slope),
        speed=speed,
        step_length=step_length,
        objective="torque_squared",
        limits=PlanarLimits(
            torque={"hip": hip_torque, "knee A": knee_torque, "knee B": knee_torque},
            shortest_phase=straight,
            clearance=bend,
        ),
        margins=Margins(touchdown_rate=approach, slip_speed=0, normal_force=0.01, separation=0.01),
        guess=swing_guess(step_length, step_length / speed),
        transcription=Collocation(intervals=intervals, tolerance=1e-7),
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
