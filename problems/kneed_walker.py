"""Passive walker with knees that latch: periodic gaits and their stability.

Each leg has a thigh and a shank with point masses, and a point foot, as in Chen (MIT, 2007).  The stance knee is
latched straight; the knee of the swing leg is released at touchdown and latches at the knee strike in mid-swing.  Run
it with ``gaitopt stability problems/kneed_walker.py``.

A simulation from a state far from the gait may end as ``ambiguous`` at a knee strike: with large friction, two outcomes
may satisfy the impact law, one in which the stance foot sticks and one in which it leaves the ground.
"""

import math

from gaitopt.model import kneed_walker
from gaitopt.stability import PlanarWalkProblem

SLOPE = math.degrees(0.0504)


def problem(
    hip_mass=0.5,  # [kg]
    thigh_mass=0.5,  # [kg]
    shank_mass=0.05,  # [kg]
    thigh_length=0.5,  # [m]
    shank_length=0.5,  # [m]
    thigh_com=0.325,  # distance of the thigh's mass from the hip [m]
    shank_com=0.125,  # distance of the shank's mass from the knee [m]
    gravity=9.81,  # [m/s^2]
    slope=SLOPE,  # downhill [deg]
    friction=math.inf,  # Coulomb coefficient
    sequence=None,  # contact sequence as it is printed; None for all gaits that are found
):
    """Return the walk."""
    return PlanarWalkProblem(
        name="kneed walker",
        robot=kneed_walker(),
        section="foot B closes",
        coordinates={"x": 0, "a": 0.2386, "flexion_a": 0, "b": -0.2386, "flexion_b": 0},
        rates={"a": -1.1096, "flexion_a": 0, "b": -0.0571, "flexion_b": 0},
        on=("foot A",),
        sequence=sequence,
        parameters={
            "hip_mass": hip_mass,
            "thigh_mass": thigh_mass,
            "shank_mass": shank_mass,
            "thigh_length": thigh_length,
            "shank_length": shank_length,
            "thigh_com": thigh_com,
            "shank_com": shank_com,
            "gravity": gravity,
            "slope": math.radians(slope),
            "friction": friction,
        },
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_stability

    run_stability(__file__)
