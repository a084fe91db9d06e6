"""Values that arguments of public functions may have, by the name of the argument, so that one of them can be odd."""

import functools

import numpy as np

import gaitopt
from gaitopt import (
    GaitProblem,
    Limits,
    MultipleShooting,
    WalkProblem,
    assess_stability,
    compass_biped,
    feedforward,
    load,
    load_diagram,
    passive,
    rimless_wheel,
)
from gaitopt.model.robots.monopod import monopod
from gaitopt.study import WalkTest

NUMBERS = {
    "steps": 1,
    "fps": 10,
    "slow": 1.0,
    "starts": 1,
    "seed": 1,
    "states": 1,
    "samples": 2,
    "max_phases": 1,
    "value": 0.02,
    "radius": 0.1,
    "duration": 0.1,
    "windows": 1,
    "intervals": 4,
    "tolerance": 1e-3,
    "slope": 0.03,
    "spokes": 6,
    "friction": 0.3,
    "margin": 0.0,
}


@functools.cache
def _gait(root):
    return load(root / "docs/examples/compass_slip.h5")


@functools.cache
def _cycle(root):
    return assess_stability(_gait(root))


def good_values(root):
    """Return values by argument; the gait is that of the documentation."""
    gait, robot = _gait(root), compass_biped()
    problem = GaitProblem(
        robot=robot,
        sequence="stick | stick",
        speed=0.6,
        step_length=0.45,
        limits=Limits(torque=6),
        objective="torque_squared",
        transcription=MultipleShooting(intervals=6),
    )
    state = gait.motion.segments[0]
    return NUMBERS | {
        "gait": gait,
        "gaits": {"slipping": gait},
        "motion": gait.motion,
        "robot": robot,
        "law": feedforward(robot, gait.motion),
        "cycle": _cycle(root),
        "problem": problem,
        "parameters": {"friction": 0.3},
        "p": robot.vector(gait.motion.parameters),
        "q": state.q[:, 0],
        "v": state.v[:, 0],
        "fixed": {"slope": 0.03},
        "axes": {"friction": [0.3]},
        "sequence": "stick | stick",
        "sequences": ["stick | stick"],
        "comparison": gaitopt.compare({"slipping": gait}, multipliers=False),
        "diagram": load_diagram(root / "docs/examples/compass_slope.nc"),
        "name": "walker",
        "title": "a title",
        "source": "<robot name='x'/>",
        "mass_matrix": np.eye(2),
        "force": np.zeros(2),
        "velocity_minus": np.zeros(2),
        "contacts": [],
        "over": {"slope": (0.02, 0.03)},
        "state": {},
        "gains": {},
        "mirror": None,
    }


def special_values(root):
    """Return values of arguments that mean something else in one function, by its name."""
    wheel, hopper = rimless_wheel(), monopod()
    walk = WalkProblem(robot=wheel, parameters={"slope": 0.23})
    simulation = {"robot": wheel, "q": [0, 0, 0.1], "v": [0, 0, 1.0], "parameters": {"slope": 0.2}, "law": None}
    planar = {"robot": hopper, "q": [0, 0.7, 0, 0, 0.6], "v": np.zeros(5), "parameters": {}, "duration": 0.1}
    return {
        "simulate": simulation,
        "basin": {"robot": wheel, "axes": {"theta_rate": [0.1]}, "law": passive(wheel)},
        "locate_basin_edges": {"robot": wheel, "axes": {"theta_rate": [0.1, 0.2]}, "law": passive(wheel), "fixed": {}},
        "find_cycles": {"robot": wheel, "parameters": {"slope": 0.2}, "law": passive(wheel), "sequence": None},
        "simulate_planar": planar,
        "solve_planar_impact": planar,
        "trace": {"problem": walk},
        "trace_curve": {"problem": walk},
        "gaits_at": {"problem": walk},
        "assess_robustness": {"walking": WalkTest(steps=1, patch=1, resolution=1.0)},
        "controlled_gait": {"law": feedforward(compass_biped(), _gait(root).motion)},
    }
