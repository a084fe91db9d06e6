"""Gaits of a compass biped with the least squared torques at a given speed and step length, to be traced over friction.

Run it with ``gaitopt trace problems/compass_optima.py --over friction=0.10:0.25 -o optima.png``, which follows the
optimum and marks every friction coefficient at which a constraint becomes active or inactive.
"""

from gaitopt import GaitProblem, Limits, compass_biped
from gaitopt.ocp import transcription_named


def problem(
    friction=0.25,  # Coulomb coefficient
    slope=0.0,  # downhill [rad]
    speed=0.6,  # [m/s]; a number, a pair (lower, upper), or None if free
    step_length=0.47,  # travel per step, foot slip included [m]; as for speed
    torque_limit=6.0,  # of ankle and hip each [N m]
    intervals=40,  # grid intervals of a sticking phase (a slip phase has a quarter); the branch keeps this grid
    sequence="stick | stick",  # contact sequence: phases | impact
    transcription="collocation",  # or multiple_shooting
):
    """Return the problem: least squared torques."""
    return GaitProblem(
        name="compass biped, optimal gaits over friction",
        robot=compass_biped(),
        sequence=sequence,
        slope=slope,
        friction=friction,
        speed=speed,
        step_length=step_length,
        limits=Limits(torque=torque_limit),
        objective="torque_squared",
        transcription=transcription_named(transcription)(intervals=intervals),
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
