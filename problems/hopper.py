"""Vertical hopper whose spring is extended at its greatest compression: height of its hops and their stability.

Run it with ``gaitopt stability problems/hopper.py``.
"""

from gaitopt.model import vertical_hopper
from gaitopt.stability import PlanarWalkProblem


def problem(
    body_mass=8.0,  # [kg]
    foot_mass=2.0,  # [kg]
    stiffness=4000.0,  # of the spring [N/m]
    thrust=0.02,  # increase of the spring's rest length from the greatest compression to lift-off [m]
    leg_length=0.5,  # full length of the leg [m]
    gravity=9.81,  # [m/s^2]
    sequence=None,  # contact sequence as it is printed; None for all gaits that are found
):
    """Return the hopper; ``body_rate`` of a gait is the velocity of the body immediately after the landing."""
    height = 0.2
    return PlanarWalkProblem(
        name="vertical hopper",
        robot=vertical_hopper(),
        section="sole closes",
        coordinates={"body": leg_length + height, "foot": height},
        rates={"body": 0, "foot": 0},
        on=(),
        sequence=sequence,
        parameters={
            "body_mass": body_mass,
            "foot_mass": foot_mass,
            "stiffness": stiffness,
            "thrust": thrust,
            "leg_length": leg_length,
            "gravity": gravity,
        },
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_stability

    run_stability(__file__)
