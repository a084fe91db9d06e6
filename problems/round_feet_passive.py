"""Passive walker with round feet on a gentle slope: periodic gaits and their stability.

The robot of round_feet.py with heavy legs and other proportions.  Run it with ``gaitopt stability
problems/round_feet_passive.py``, ``gaitopt simulate ...`` or ``gaitopt basin ...``.
"""

import math

import round_feet

from gaitopt import WalkProblem

SLOPE = math.degrees(0.01)


def problem(
    leg_length=1.2,  # from the hip to the middle of the foot [m]
    foot_radius=0.2,  # [m]
    leg_com=0.7,  # distance of a leg's centre of mass from its foot [m]
    leg_mass=0.5,  # [kg]
    leg_inertia=0.02,  # of a leg about its centre of mass [kg m^2]
    hip_mass=1.0,  # [kg]
    gravity=1.0,  # [m/s^2]
    slope=SLOPE,  # downhill [deg]
    friction=math.inf,  # Coulomb coefficient
    sequence=None,  # contact sequence such as "stick | stick"; None for all gaits that are found
):
    """Return the walk."""
    return WalkProblem(
        name="passive walker with round feet",
        robot=round_feet.round_feet_biped(),
        sequence=sequence,
        parameters={
            "leg_length": leg_length,
            "foot_radius": foot_radius,
            "leg_com": leg_com,
            "leg_mass": leg_mass,
            "leg_inertia": leg_inertia,
            "hip_mass": hip_mass,
            "gravity": gravity,
            "slope": math.radians(slope),
            "friction": friction,
        },
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_stability

    run_stability(__file__)
