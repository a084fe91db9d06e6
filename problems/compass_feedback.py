"""Energy-optimal compass-biped gait planned for feedback, with a torque reserve and margins from both friction cones.

Solve it with ``gaitopt solve problems/compass_feedback.py``, then tune a law that may use the torque reserve:
``gaitopt tune compass_feedback.h5 --law lqr --torque-limit 6`` and ``gaitopt push compass_feedback.h5 --law lqr``.
``--set sequence="stick | stick"`` gives the best gait that never slips, with a margin from the cone of the impact;
without this margin the smallest disturbance would make the impact slip.

``gaitopt run problems/studies/feedback_laws.py`` tunes four laws for both gaits and for an imitation of passive Gait C,
and ``problems/studies/feedback_figures.py`` shows their effect on the imitation, which is unstable in open loop.
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
    cone=0.05,  # margin to the boundary of the friction cone in sticking phases, as a fraction of the cone
    impact_cone=0.1,  # the same for a sticking impact
    intervals=40,  # grid intervals of a sticking phase (a slip phase has a quarter)
    transcription="collocation",  # or multiple_shooting
):
    """Return the problem of compass_slip.py with margins."""
    base = compass_slip.problem(
        sequence=sequence,
        friction=friction,
        speed=speed,
        step_length=step_length,
        torque_limit=torque_limit,
        intervals=intervals,
        transcription=transcription,
    )
    return dataclasses.replace(
        base, name="compass biped for feedback", margins=Margins(cone=cone, impact_cone=impact_cone)
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
