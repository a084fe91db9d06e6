"""Energy-optimal compass-biped gait planned for feedback: a torque reserve and margins on both cones.

Solve it with ``gaitopt solve problems/compass_feedback.py``, then tune a law that may use the reserve:
``gaitopt tune compass_feedback.h5 --law lqr --torque-limit 6`` and ``gaitopt push compass_feedback.h5 --law lqr``.
With ``--set sequence="stick | stick"`` it is the optimal gait without slip, with a margin on the cone of the impact:
without a margin the smallest disturbance makes the impact slip.

``gaitopt run problems/studies/feedback_laws.py`` tunes four laws for both gaits and an imitation of passive Gait C,
and ``problems/studies/feedback_figures.py`` draws their effect on the imitation, which is unstable without them.
"""

import dataclasses

import compass_slip

from gaitopt import Margins


def problem(
    sequence="slip+ stick | slip+",  # phases | impact
    friction=0.14,  # Coulomb coefficient
    speed=0.633,  # [m/s]
    step_length=0.4713,  # [m]
    torque_limit=5.0,  # of ankle and hip each [N m]; one sixth of 6 N m is reserved for feedback
    cone=0.05,  # share of the friction cone that a sticking foot must not use
    impact_cone=0.1,  # the same for a sticking impact
    intervals=40,
    transcription="collocation",  # or multiple_shooting
):
    """Return the problem: the one of compass_slip.py with margins."""
    plain = compass_slip.problem(
        sequence=sequence,
        friction=friction,
        speed=speed,
        step_length=step_length,
        torque_limit=torque_limit,
        intervals=intervals,
        transcription=transcription,
    )
    return dataclasses.replace(
        plain, name="compass biped for feedback", margins=Margins(cone=cone, impact_cone=impact_cone)
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
