"""Walker with heel and toe: heel strike, push-off of the trailing toe, foot flat, heel-off; motors at hip and ankles.

Solve it with ``gaitopt solve problems/flat_foot.py``.  The legs are straight, so a foot swings through the ground and
can land only if the angle between the legs exceeds `clearance_angle`.  The gait without double support is solved with
``--set sequence="heel A stick | heel A stick, toe A stick > toe A stick |"``.
"""

import numpy as np

from gaitopt import Collocation, Margins
from gaitopt.model import flat_foot_walker
from gaitopt.ocp import PlanarKeyframes, PlanarLimits, PlanarProblem

LEG = 0.98  # from the hip to the sole [m]


def rolling_guess(step_length, period):
    """Return a guess in which every foot lands on its heel, is flat, and rolls over its toe."""
    part, reach = np.linspace(0, 1, 13), np.arcsin(step_length / 2 / LEG)
    coordinates = {"x": step_length * part}
    for leg, place in (("a", part), ("b", 1 + part)):  # in steps since the touchdown of the foot
        angle = np.interp(place, [0, 1, 1.1, 1.8, 2], reach * np.array([1, -1, -1.05, 1.15, 1]))
        pitch = np.interp(place, [0, 0.15, 0.6, 1, 1.1, 1.5, 2], [0.2, 0, 0, -0.24, -0.4, 0, 0.2])
        coordinates |= {leg: angle, f"ankle_{leg}": pitch - angle}
    coordinates["y"] = LEG * np.cos(coordinates["a"])
    return PlanarKeyframes(part * period, coordinates)


def problem(
    sequence="heel A stick, toe B stick > heel A stick | heel A stick, toe A stick > toe A stick |",
    friction=1.0,  # Coulomb coefficient
    speed=0.5,  # [m/s]
    step_length=0.4,  # [m]
    hip_torque=60.0,  # largest torque of the hip [N m]
    ankle_torque=60.0,  # of each ankle [N m]
    ankle_angle=0.4,  # largest angle of an ankle [rad]
    clearance_angle=0.35,  # least angle between the legs at which a foot can land [rad]
    approach=0.05,  # least normal speed of heel and toe when they land [m/s]
    intervals=6,  # grid intervals of a phase; a phase with a flat foot has twice as many
):
    """Return the problem of a step."""
    phases = sequence.replace("|", ">").split(">")[:-1]
    ankle, leg = (-ankle_angle, ankle_angle), (-0.9, 0.9)
    return PlanarProblem(
        name="flat-foot walker",
        robot=flat_foot_walker(),
        sequence=sequence,
        parameters={"clearance_angle": clearance_angle},
        friction=friction,
        speed=speed,
        step_length=step_length,
        objective="torque_squared",
        limits=PlanarLimits(
            torque={"ankle A": ankle_torque, "ankle B": ankle_torque, "hip": hip_torque},
            coordinate={"a": leg, "ankle_a": ankle, "b": leg, "ankle_b": ankle},
        ),
        margins=Margins(touchdown_rate=approach, slip_speed=0, normal_force=0.02, separation=0.01, cone=0.05),
        guess=rolling_guess(step_length, step_length / speed),
        transcription=Collocation(
            intervals=tuple(intervals * (1 + ("toe A" in phase and "heel A" in phase)) for phase in phases),
            tolerance=1e-7,
        ),
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
