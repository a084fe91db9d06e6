"""Energy-optimal compass-biped gait planned so that feedback can hold it: torque kept back, margins on both cones.

Solve it with ``gaitopt solve problems/compass_feedback.py``, then tune a law that has the torque kept back:
``gaitopt tune compass_feedback.h5 --law lqr --torque-limit 6`` and ``gaitopt push compass_feedback.h5 --law lqr``.
With ``--set sequence="stick | stick"`` it is the best gait that never slips, with a margin on the impact's cone:
without one the smallest disturbance would make its impact slip.

``gaitopt run problems/studies/feedback_laws.py`` tunes four laws for both gaits and an imitation of passive Gait C,
and ``problems/studies/feedback_figures.py`` draws what they do for the imitation, which is unstable without them.
"""

import dataclasses

import compass_slip

from gaitopt import Margins


def problem(
    sequence="slip+ stick | slip+",  # phases | impact
    friction=0.14,  # Coulomb coefficient
    speed=0.633,  # [m/s]
    step_length=0.4713,  # [m]
    torque_limit=5.0,  # of ankle and hip each [N m]; one sixth of 6 N m is kept back for feedback
    cone=0.05,  # share of the friction cone a sticking foot keeps free
    impact_cone=0.1,  # the same of a sticking impact
    intervals=40,
):
    """Return the problem: the one of compass_slip.py with margins."""
    plain = compass_slip.problem(
        sequence=sequence,
        friction=friction,
        speed=speed,
        step_length=step_length,
        torque_limit=torque_limit,
        intervals=intervals,
    )
    return dataclasses.replace(
        plain, name="compass biped for feedback", margins=Margins(cone=cone, impact_cone=impact_cone)
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
