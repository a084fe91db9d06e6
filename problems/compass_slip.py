"""Energy-optimal compass-biped gait whose touchdown slips forward.

Run it with ``gaitopt solve problems/compass_slip.py`` or ``python problems/compass_slip.py``; change any keyword below
with ``--set NAME=VALUE``.
"""

import math

from gaitopt import GaitProblem, Limits, compass_biped
from gaitopt.ocp import transcription_named


def problem(
    leg_length=1.6,  # [m]
    leg_com=0.8,  # distance of a leg's mass from its foot [m]
    leg_mass=4.0,  # [kg]
    hip_mass=2.0,  # [kg]
    gravity=9.8,  # [m/s^2]
    slope=0.0,  # downhill [deg]
    friction=0.14,  # Coulomb coefficient
    speed=0.633,  # [m/s]; a number, a pair (lower, upper), or None if free
    step_length=0.4713,  # travel per step, foot slip included [m]; as for speed
    torque_limit=6.0,  # of ankle and hip each [N m]
    objective="cost_of_transport",  # or torque_squared, positive_work, torque_rate, impact_loss, peak_torque, ...
    intervals=40,  # grid intervals of a sticking phase (a slip phase has a quarter)
    sequence="slip+ stick | slip+",  # contact sequence: phases | impact
    transcription="collocation",  # or multiple_shooting
):
    """Return the problem: minimise the cost at a given speed and step length."""
    return GaitProblem(
        name="compass biped, slipping impact",
        robot=compass_biped(),
        sequence=sequence,
        parameters={
            "leg_length": leg_length,
            "leg_com": leg_com,
            "leg_mass": leg_mass,
            "hip_mass": hip_mass,
            "gravity": gravity,
        },
        slope=math.radians(slope),
        friction=friction,
        speed=speed,
        step_length=step_length,
        limits=Limits(torque=torque_limit),
        objective=objective,
        transcription=transcription_named(transcription)(intervals=intervals),
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
