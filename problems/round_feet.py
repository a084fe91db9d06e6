"""Passive walker with two round feet, as a robot with several contacts: periodic gaits and their stability.

The legs are straight, so a foot swings through the ground and can land only in front of the other foot.  Lengths are
measured from the hip, as in McGeer (International Journal of Robotics Research 9(2), 1990).  Run it with ``gaitopt
stability problems/round_feet.py``.
"""

import math

from gaitopt.model import round_foot_walker
from gaitopt.stability import PlanarWalkProblem

SLOPE = math.degrees(0.01)


def problem(
    hip_mass=1.0,  # [kg]
    leg_mass=0.5,  # [kg]
    leg_inertia=0.02,  # of a leg about its centre of mass [kg m^2]
    leg_length=1.0,  # from the hip to the centre of the foot's arc [m]
    leg_com=0.5,  # from the hip to a leg's centre of mass [m]
    foot_radius=0.2,  # [m]
    gravity=1.0,  # [m/s^2]
    slope=SLOPE,  # downhill [deg]
    friction=math.inf,  # Coulomb coefficient
    sequence=None,  # contact sequence as it is printed; None for all gaits that are found
):
    """Return the walk."""
    return PlanarWalkProblem(
        name="walker with round feet",
        robot=round_foot_walker(),
        section="foot B closes",
        coordinates={"x": 0, "a": 0.19, "b": -0.19},
        rates={"a": -0.24, "b": -0.19},
        on=("foot A",),
        sequence=sequence,
        parameters={
            "hip_mass": hip_mass,
            "leg_mass": leg_mass,
            "leg_inertia": leg_inertia,
            "leg_length": leg_length,
            "leg_com": leg_com,
            "foot_radius": foot_radius,
            "gravity": gravity,
            "slope": math.radians(slope),
            "friction": friction,
        },
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_stability

    run_stability(__file__)
