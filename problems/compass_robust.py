"""Compass biped on a floor of unknown friction: one gait and one law for a range of friction and for pushes.

Run it with ``gaitopt design problems/compass_robust.py``, then ``gaitopt push compass_robust/compass_robust.h5 --law
compass_robust/compass_robust_law.json``. With ``--set law=feedforward --set push=0``, a gait
without feedback is planned for the range of friction alone.
"""

from gaitopt import GainSearchOptions, GaitProblem, Limits, Scenarios, compass_biped
from gaitopt.design import RobustProblem


def problem(
    friction=0.15,  # nominal Coulomb coefficient
    least_friction=0.1,  # lower end of the range of friction
    most_friction=0.2,  # upper end of the range of friction
    push=0.1,  # radius of the ball of pushes [rad/s]
    speed=0.6,  # [m/s]
    step_length=0.45,  # [m]
    torque_limit=6.0,  # of ankle and hip each [N m]
    objective="torque_squared",  # or cost_of_transport, positive_work, ...
    sequence="stick | stick",  # contact sequence: phases | impact
    law="lqr",  # or computed_torque, joint_pd, feedforward, SCRIPT.py:FUNCTION
    evaluations=12,  # evaluations of the gain search in each round
):
    """Return the problem: the gait of lowest cost that survives all scenarios under a law."""
    gait = GaitProblem(
        name="compass biped on a floor of unknown friction",
        robot=compass_biped(),
        sequence=sequence,
        friction=friction,
        speed=speed,
        step_length=step_length,
        limits=Limits(torque=torque_limit),
        objective=objective,
    )
    scenarios = Scenarios(ranges={"friction": (least_friction, most_friction)}, push=push)
    search = GainSearchOptions(samples=2, starts=1, evaluations=evaluations)
    return RobustProblem(gait, scenarios, law=law, search=search)


if __name__ == "__main__":
    from gaitopt.cli.app import run_design

    run_design(__file__)
