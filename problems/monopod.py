"""Planar monopod that hops at a given speed: optimal leg force and hip torque, with a landing that sticks or slips.

Solve it with ``gaitopt solve problems/monopod.py``.  At low friction a landing that slips costs less than one that
sticks: ``--set friction=0.3 --set sequence="foot slip+ > foot stick > flight |"``.
"""

from dataclasses import dataclass

from gaitopt import Collocation, Margins
from gaitopt.model.robots.monopod import monopod
from gaitopt.ocp import Objective, PlanarLimits, PlanarProblem

PITCH = (-0.5, 0.5)
"""Bounds of the body's angle [rad].  Without them its mean is undetermined, because the cost does not depend on it."""


@dataclass(frozen=True)
class HopEffort(Objective):
    """Integral of the squared hip torque and, with a smaller weight, of the squared leg force."""

    name, unit, smooth, typical = "hop_effort", "N^2 m^2 s", True, 20.0

    def integrand(self, point):
        """Return the sum of the squares [N^2 m^2]; the force [N] has the weight 1e-3 m^2."""
        return 1e-3 * point.torque_of("leg") ** 2 + point.torque_of("hip") ** 2


def problem(
    sequence="foot stick > flight |",  # phases and events of a hop
    friction=1.0,  # Coulomb coefficient
    speed=1.5,  # [m/s]
    step_length=0.6,  # [m]
    stiffness=3000.0,  # of the leg's spring [N/m]
    clearance=2e-3,  # least height of the foot in flight [m]
    approach=0.1,  # least normal speed of the foot when it lands [m/s]
    stance_intervals=8,  # grid intervals of each phase with the foot on the ground
    flight_intervals=24,  # grid intervals of the flight
):
    """Return the problem of a hop."""
    phases = sequence.replace("|", ">").split(">")[:-1]
    return PlanarProblem(
        name="monopod",
        robot=monopod(),
        sequence=sequence,
        parameters={"stiffness": stiffness},
        friction=friction,
        speed=speed,
        step_length=step_length,
        objective=HopEffort(),
        limits=PlanarLimits(coordinate={"s": (0.35, 0.65), "phi": PITCH}, clearance=clearance),
        margins=Margins(touchdown_rate=approach, slip_speed=0, normal_force=0),
        transcription=Collocation(
            intervals=tuple(flight_intervals if "flight" in phase else stance_intervals for phase in phases)
        ),
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
