"""Rimless wheel rolling down a slope, with slipping spokes: periodic gaits and their stability.

Run it with ``gaitopt stability problems/rimless_wheel.py``, ``gaitopt simulate ...`` or ``gaitopt basin ...``.
"""

import math

from gaitopt import WalkProblem, rimless_wheel


def problem(
    spokes=10,  # number of spokes
    inertia_ratio=1 / 3,  # moment of inertia about the centre of mass divided by m l^2 (mass m, spoke length l)
    slope=13.0,  # downhill [deg]
    friction=0.3,  # Coulomb coefficient; inf for no slip
    sequence=None,  # contact sequence such as "stick slip+ | stick"; None for all gaits that are found
):
    """Return the rimless wheel of Gamus & Or (2015) with spokes of length 1 m."""
    return WalkProblem(
        name="rimless wheel",
        robot=rimless_wheel(),
        sequence=sequence,
        parameters={
            "spokes": spokes,
            "inertia_ratio": inertia_ratio,
            "slope": math.radians(slope),
            "friction": friction,
        },
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_stability

    run_stability(__file__)
