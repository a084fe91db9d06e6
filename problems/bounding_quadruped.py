"""Quadruped that bounds at a given speed: both back legs, flight, both front legs, flight.

Each pair of legs is modelled as one leg with a spring, a motor in parallel with the spring, and a motor at the hip.
Solve it with ``gaitopt solve problems/bounding_quadruped.py``.
"""

from dataclasses import dataclass

import numpy as np

from gaitopt import Collocation, Margins
from gaitopt.model import quadruped
from gaitopt.ocp import Objective, PlanarKeyframes, PlanarLimits, PlanarProblem


@dataclass(frozen=True)
class LegEffort(Objective):
    """Integral of the squared hip torques and, with a smaller weight, of the squared leg forces."""

    name, unit, smooth, typical = "leg_effort", "N^2 m^2 s", True, 20.0

    def integrand(self, point):
        """Return the sum of the squares [N^2 m^2]; the forces [N] have the weight 1e-3 m^2."""
        legs, hips = ([point.torque_of(f"{pair} {part}") for pair in ("back", "front")] for part in ("leg", "hip"))
        return 1e-3 * sum(force**2 for force in legs) + sum(torque**2 for torque in hips)


def bound_guess(stride, period, height, stance=0.35):
    """Return a guess in which each pair of legs is on the ground for a fraction `stance` of the period."""
    part = np.linspace(0, 1, 21)
    coordinates = {
        "x": stride * part,
        "y": np.full(part.size, height),
        "pitch": 0.1 * np.sin(2 * np.pi * (part - 0.15)),
    }
    for pair, start in (("back", 0.0), ("front", 0.5)):
        place, reach = (part - start) % 1, stride * stance / 2
        ahead = np.interp(place, [0, stance, 1], [reach, -reach, reach])
        lifted = 0.06 * np.sin(np.pi * np.clip((place - stance) / (1 - stance), 0, 1))
        coordinates |= {f"{pair}_angle": np.arctan2(ahead, height), f"{pair}_length": np.hypot(ahead, height) - lifted}
    phases = np.array([stance, 0.5 - stance, stance, 0.5 - stance]) * period
    return PlanarKeyframes(part * period, coordinates, phases=phases)


def problem(
    sequence="back foot stick > flight | front foot stick > flight |",  # phases and events of a stride
    friction=0.8,  # Coulomb coefficient
    speed=1.8,  # [m/s]
    step_length=0.8,  # travel per stride [m]
    stiffness=5000.0,  # of the spring of each pair of legs [N/m]
    clearance=5e-3,  # least height of the feet in flight [m]
    approach=0.1,  # least normal speed of a foot when it lands [m/s]
    intervals=8,  # in each phase
):
    """Return the problem of a stride."""
    angle, length = (-0.9, 0.9), (0.2, 0.45)
    return PlanarProblem(
        name="bounding quadruped",
        robot=quadruped(),
        sequence=sequence,
        parameters={"stiffness": stiffness},
        friction=friction,
        speed=speed,
        step_length=step_length,
        objective=LegEffort(),
        limits=PlanarLimits(
            coordinate={"pitch": (-0.5, 0.5)}
            | {f"{pair}_angle": angle for pair in ("back", "front")}
            | {f"{pair}_length": length for pair in ("back", "front")},
            clearance=clearance,
        ),
        margins=Margins(touchdown_rate=approach, slip_speed=0, normal_force=0, cone=0.02),
        guess=bound_guess(step_length, step_length / speed, 0.38),
        transcription=Collocation(intervals=intervals),
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
