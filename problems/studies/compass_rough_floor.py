"""Compass biped on a rough floor: five steps over a raised edge and a slippery patch, where it slips, and down a ramp.

The gait begins and ends in the periodic gait on a level floor.  Run it with
``gaitopt solve problems/studies/compass_rough_floor.py``; change any keyword below with ``--set NAME=VALUE``.
"""

from gaitopt import GaitProblem, Limits, WarmStart, compass_biped, solve
from gaitopt.model import Terrain
from gaitopt.ocp import MultiStepProblem, state_after_touchdown


def problem(
    rise=0.01,  # height of the raised edge [m]
    patch=0.05,  # Coulomb coefficient of the slippery patch
    descent=0.02,  # height by which the ramp descends [m]
    friction=0.5,  # Coulomb coefficient of the floor
    torque_limit=30.0,  # of ankle and hip each [N m]
):
    """Return the problem: least squared torques over five steps."""
    step = GaitProblem(
        robot=compass_biped(),
        sequence="stick | stick",
        friction=friction,
        speed=0.6,
        step_length=0.45,
        limits=Limits(torque=torque_limit, longest_step=3),
        objective="torque_squared",
    )
    periodic = solve(step)
    state = state_after_touchdown(periodic)
    free = step.replace(speed=None, step_length=None, guess=WarmStart(periodic))
    slippery = free.replace(sequence="slip+ stick | slip+")
    return MultiStepProblem(
        name="compass biped on a rough floor",
        steps=(free, free, slippery, free, free),
        start=state,
        end=state,
        footholds={1: (0.35, 0.48), 2: (0.65, 0.8), 3: (1.12, 1.2), 4: (1.35, 1.7), 5: (1.9, 2.3)},
        terrain=Terrain(steps=[(0.55, rise)], patches=[(0.6, 1.05, patch)], ramps=[(1.3, 1.8, -descent)]),
    )


if __name__ == "__main__":
    from gaitopt.cli.app import run_script

    run_script(__file__)
