"""Compass biped whose legs' centre of mass and hip mass are optimised together with its gait.

Run it with ``gaitopt solve problems/compass_design.py`` or ``gaitopt design problems/compass_design.py``.
"""

from gaitopt import GaitProblem, Limits, compass_biped
from gaitopt.ocp import transcription_named


def problem(
    least_com=0.4,  # lower bound of the distance of a leg's mass from its foot [m]
    most_com=1.0,  # upper bound of this distance [m]
    least_hip_mass=1.0,  # lower bound of the hip mass [kg]
    most_hip_mass=3.0,  # upper bound of the hip mass [kg]
    friction=0.14,  # Coulomb coefficient
    speed=0.633,  # [m/s]
    step_length=0.4713,  # [m]
    torque_limit=6.0,  # of ankle and hip each [N m]
    objective="torque_squared",  # or cost_of_transport, positive_work, ...
    intervals=40,  # grid intervals of a sticking phase (a slip phase has a quarter)
    sequence="slip+ stick | slip+",  # contact sequence: phases | impact
    transcription="collocation",  # or multiple_shooting
):
    """Return the problem: the parameters and the gait of lowest cost at a given speed and step length."""
    return GaitProblem(
        name="compass biped with free masses",
        robot=compass_biped(),
        sequence=sequence,
        friction=friction,
        speed=speed,
        step_length=step_length,
        free={"leg_com": (least_com, most_com), "hip_mass": (least_hip_mass, most_hip_mass)},
        limits=Limits(torque=torque_limit),
        objective=objective,
        transcription=transcription_named(transcription)(intervals=intervals),
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
