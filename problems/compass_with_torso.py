"""Compass biped with a torso that walks on level ground; torques act between the torso and the legs only.

Mass, lengths and actuation are those of Grizzle, Abba & Plestan (IEEE Transactions on Automatic Control 46, 2001).
Solve it with ``gaitopt solve problems/compass_with_torso.py``.
"""

from gaitopt import Collocation, Margins
from gaitopt.model import compass_with_torso
from gaitopt.ocp import PlanarLimits, PlanarProblem


def problem(
    sequence="stick | stick",  # short form of "foot A stick |"
    friction=0.8,  # Coulomb coefficient
    speed=0.7,  # [m/s]
    step_length=0.4,  # [m]
    torque_limit=60.0,  # of each torque between torso and leg [N m]
    lean=0.5,  # largest angle of the torso from the vertical [rad]
    approach=0.05,  # least normal speed of the foot when it lands [m/s]
    intervals=20,  # grid intervals of the step
):
    """Return the problem of a step."""
    return PlanarProblem(
        name="compass with torso",
        robot=compass_with_torso(),
        sequence=sequence,
        friction=friction,
        speed=speed,
        step_length=step_length,
        objective="torque_squared",
        limits=PlanarLimits(torque=torque_limit, coordinate={"torso": (-lean, lean)}),
        margins=Margins(touchdown_rate=approach),
        transcription=Collocation(intervals=intervals, tolerance=1e-8),
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
