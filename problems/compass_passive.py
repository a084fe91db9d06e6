"""Passive compass biped walking down a slope, with slipping feet: periodic gaits and their stability.

Run it with ``gaitopt stability problems/compass_passive.py``, ``gaitopt simulate ...`` or ``gaitopt basin ...``.
"""

import math

from gaitopt import WalkProblem, compass_biped


def problem(
    leg_length=1.6,  # [m]
    leg_com=0.8,  # distance of a leg's mass from its foot [m]
    leg_mass=4.0,  # [kg]
    hip_mass=2.0,  # [kg]
    gravity=9.8,  # [m/s^2]
    slope=1.0,  # downhill [deg]
    friction=math.inf,  # Coulomb coefficient
    sequence=None,  # contact sequence such as "stick | stick"; None for all gaits that are found
):
    """Return the walker of Gamus & Or (2015)."""
    return WalkProblem(
        name="passive compass biped",
        robot=compass_biped(),
        sequence=sequence,
        parameters={
            "leg_length": leg_length,
            "leg_com": leg_com,
            "leg_mass": leg_mass,
            "hip_mass": hip_mass,
            "gravity": gravity,
            "slope": math.radians(slope),
            "friction": friction,
        },
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_stability

    run_stability(__file__)
