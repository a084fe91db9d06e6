"""Point mass on two telescoping legs that walks or runs with the least positive work.

Solve the walk with ``gaitopt solve problems/telescoping_biped.py``, and the run with
``--set sequence="foot A stick > flight |" --set speed=1.2 --set step_length=1``.  With ``--set impulse_limit=1`` the
legs of the walk push impulsively: the trailing one just before touchdown and the leading one just after it.

Leg forces are at most `force_limit`.  For a large limit and light feet, the positive work per step and unit mass tends
to P^2 / 2, that of the impulsive gaits of Srinivasan & Ruina (Nature 439, 2006).  In the walk, P = w tan(alpha) is the
push-off of the inverted pendulum (w: speed at touchdown, 2 alpha: angle between the legs); in the run, P = D g / (2 U)
(D: step length, U: speed, g: gravity).
"""

import numpy as np

from gaitopt import Collocation, Margins, PositiveWork, TorqueSquared
from gaitopt.model import telescoping_biped
from gaitopt.ocp import ActuatorImpulse, PlanarKeyframes, PlanarLimits, PlanarProblem, PoseGuess


def stride_guess(step_length, period, duty, height):
    """Return a guess in which each foot is on the ground for `duty` steps of a stride of two steps."""
    part = np.unique([*np.linspace(0, 1, 9), duty % 1])
    coordinates = {"x": step_length * part, "y": np.full(part.size, height)}
    for leg, place in (("a", part), ("b", 1 + part)):
        ahead = step_length * np.interp(place, [0, duty, 2], [duty / 2, -duty / 2, duty / 2])
        lifted = 0.1 * height * np.sin(np.pi * np.clip((place - duty) / (2 - duty), 0, 1))
        coordinates |= {leg: np.arctan2(ahead, height), f"length_{leg}": np.hypot(ahead, height) - lifted}
    return PlanarKeyframes(part * period, coordinates, phases=np.array([duty % 1, 1 - duty % 1]) * period)


def problem(
    sequence="foot A stick, foot B stick > foot A stick |",  # phases and events of a step
    body_mass=1.0,  # [kg]
    foot_mass=0.001,  # [kg]
    leg_length=1.0,  # greatest length of a leg [m]
    gravity=1.0,  # [m/s^2]
    friction=np.inf,  # Coulomb coefficient
    speed=0.5,  # [m/s]
    step_length=0.4,  # [m]
    force_limit=4.0,  # of each leg [N]
    impulse_limit=0.0,  # of each leg at touchdown [N s]; 0 for a walk without impulses of the legs
    torque_limit=0.02,  # of the hip, which swings the legs [N m]
    approach=0.1,  # least normal speed of the foot when it lands [m/s]
    intervals=12,  # grid intervals of each phase
):
    """Return the problem of a step."""
    share = body_mass * gravity / force_limit
    duty = min(1.2 * share, 0.6) if "flight" in sequence else 1 + min(0.3 * share, 0.3)
    two_phases = len(sequence.replace("|", ">").split(">")) == 3
    length, angle = (leg_length / 2, leg_length), (-1, 1)
    push, stop = (
        ActuatorImpulse(leg, "foot B closes", limits=(0, impulse_limit or 1), moment=moment)
        for leg, moment in (("leg A", "before"), ("leg B", "after"))
    )
    return PlanarProblem(
        name="telescoping biped",
        robot=telescoping_biped(),
        sequence=sequence,
        parameters={"body_mass": body_mass, "foot_mass": foot_mass, "gravity": gravity},
        friction=friction,
        speed=speed,
        step_length=step_length,
        objective=PositiveWork() + 1e-5 * TorqueSquared(),
        limits=PlanarLimits(
            torque={"leg A": force_limit, "leg B": force_limit, "hip": torque_limit},
            coordinate={"length_a": length, "length_b": length, "a": angle, "b": angle},
            clearance=2e-3,
        ),
        impulses=(push, stop) if impulse_limit else (),
        margins=Margins(touchdown_rate=approach, slip_speed=0, normal_force=0),
        guess=stride_guess(step_length, step_length / speed, duty, 0.96 * leg_length) if two_phases else PoseGuess(),
        transcription=Collocation(intervals=intervals, tolerance=1e-8),
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
