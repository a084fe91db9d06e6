"""NAME: description in one line.

Run it with ``gaitopt solve NAME.py``; change any keyword of problem() with ``--set friction=0.2 --set speed=0.5:0.7``.
"""

import casadi as ca

from gaitopt import GaitProblem, Limits, Objective, compass_biped
from gaitopt.dataclass import dataclass
from gaitopt.ocp import transcription_named


@dataclass(frozen=True)
class WorkAndTorque(Objective):
    """Cost of transport plus weighted squared torques; the second term reduces motor heat and torque peaks."""

    torque_weight: float  # [W / (N m)^2]
    name = "work_and_torque"
    unit = "1"
    uses_power = True  # point.positive and point.negative contain the parts of the joint powers
    per_weight_and_travel = True  # the integral is divided by weight times travel

    def integrand(self, point):
        """Return the scalar that is integrated over the step [W]; `point` is the gait at one instant."""
        return ca.sum1(point.positive) + ca.sum1(point.negative) + self.torque_weight * ca.sumsqr(point.torque)


# Every keyword can be changed with --set; give it a default of its type, and state its unit.
def problem(
    hip_mass=2.0,  # [kg]
    leg_mass=4.0,  # [kg]
    leg_length=1.6,  # [m]
    leg_com=0.8,  # distance of a leg's mass from its foot [m]
    friction=0.14,  # Coulomb coefficient
    speed=0.633,  # [m/s]: a number, a pair (lower, upper), or None for free
    step_length=0.4713,  # [m], foot slide included; accepts the same values as speed
    torque_limit=6.0,  # of ankle and hip each [N m]; without limits the torques become very large
    torque_weight=0.0,  # weight of the squared torques, see above
    sequence="slip+ stick | slip+",  # phases | impact; try "stick | stick" if no gait is found
    transcription="collocation",  # or multiple_shooting
    intervals=40,  # grid intervals of a sticking phase (a slip phase gets a quarter)
):
    """Return the problem: the gait of lowest cost at the given speed and step length."""
    return GaitProblem(
        name="NAME",
        robot=compass_biped(),  # or a custom robot: gaitopt new NAME --robot compass_biped writes its definition
        sequence=sequence,
        parameters={"hip_mass": hip_mass, "leg_mass": leg_mass, "leg_length": leg_length, "leg_com": leg_com},
        friction=friction,
        speed=speed,
        step_length=step_length,
        limits=Limits(torque=torque_limit),
        objective=WorkAndTorque(torque_weight=torque_weight),
        transcription=transcription_named(transcription)(intervals=intervals),
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
