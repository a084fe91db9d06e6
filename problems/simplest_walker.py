"""Simplest walker: a point mass at the hip and feet of very small mass, which walk down a gentle slope.

In the limit of massless feet it is the walker of Garcia, Chatterjee, Ruina & Coleman (Journal of Biomechanical
Engineering 120, 1998), whose swing foot has no effect on the hip.  Leg length, gravity and hip mass are 1.  Run it with
``gaitopt stability problems/simplest_walker.py``, ``gaitopt simulate ...`` or ``gaitopt basin ...``.
"""

import math

from gaitopt import WalkProblem, compass_biped

SLOPE = math.degrees(0.009)


def problem(
    foot_mass=1e-4,  # foot mass / hip mass; state and multipliers differ from the massless limit by about this ratio
    slope=SLOPE,  # downhill [deg]
    friction=math.inf,  # Coulomb coefficient
    sequence=None,  # contact sequence such as "stick | stick"; None for all gaits that are found
):
    """Return the walker."""
    return WalkProblem(
        name="simplest walker",
        robot=compass_biped(),
        sequence=sequence,
        parameters={
            "leg_length": 1.0,
            "leg_com": 0.0,
            "leg_mass": foot_mass,
            "hip_mass": 1.0,
            "gravity": 1.0,
            "slope": math.radians(slope),
            "friction": friction,
        },
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_stability

    run_stability(__file__)
