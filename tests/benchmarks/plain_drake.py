"""The benchmark in Drake: a MultibodyPlant, DirectCollocation (Hermite and Simpson, torques linear) and IPOPT."""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, SpatialInertia, UnitInertia
from pydrake.planning import DirectCollocation
from pydrake.solvers import IpoptSolver, SolverOptions

from tests.benchmarks.compass_equations import (
    COM,
    GRAVITY,
    HIP,
    IMPULSE,
    LEG,
    LENGTH,
    SHORT,
    STEP,
    straight_line,
    touchdown,
)

TO_JOINTS = np.kron(np.eye(2), [[1.0, 0.0], [-1.0, -1.0]])
"""From angles to the vertical to joint angles; undoes itself."""


def walker():
    """Return two legs on a pin; joint angles are the stance leg's, and that of the swing leg against it."""
    plant = MultibodyPlant(time_step=0.0)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, -GRAVITY])
    stance = plant.AddRigidBody("stance", points((LEG, COM), (HIP, LENGTH)))
    swing = plant.AddRigidBody("swing", points((LEG, -SHORT)))
    hip = plant.AddFrame(FixedOffsetFrame("hip", stance, RigidTransform([0, 0, LENGTH])))
    plant.AddJoint(RevoluteJoint("ankle", plant.world_frame(), stance.body_frame(), [0, 1, 0]))
    plant.AddJoint(RevoluteJoint("hip", hip, swing.body_frame(), [0, 1, 0]))
    for name in ("ankle", "hip"):
        plant.AddJointActuator(name, plant.GetJointByName(name))
    plant.Finalize()
    return plant


def points(*masses):
    """Return the inertia of point masses on the z axis."""
    total = sum(mass for mass, _ in masses)
    centre = sum(mass * height for mass, height in masses) / total
    inertia = sum(mass * height**2 for mass, height in masses) / total
    return SpatialInertia(total, [0, 0, centre], UnitInertia(inertia, inertia, 0))


class Walker:
    """The NLP; each solve starts from the one before."""

    def __init__(self, intervals):
        plant = walker()
        self.dircol = DirectCollocation(
            plant, plant.CreateDefaultContext(), intervals + 1, 1e-3, 1.0, plant.get_actuation_input_port().get_index()
        )
        dircol, prog = self.dircol, self.dircol.prog()
        self.intervals = intervals
        self.impulse = prog.NewContinuousVariables(2, "impulse")
        steps = [dircol.time_step(k)[0] for k in range(intervals)]
        self.steps = prog.AddBoundingBoxConstraint(0, 0, steps)
        for k in range(intervals):
            u = np.concatenate([dircol.input(k), dircol.input(k + 1)])
            # the integral of the square of what is linear in between
            prog.AddQuadraticCost(2 / 3 * np.kron([[1, 0.5], [0.5, 1]], np.eye(2)), np.zeros(4), u)

        def landing(values):
            last, first = TO_JOINTS @ values[:4], TO_JOINTS @ values[4:8]
            return np.array(touchdown(last, first, values[8:], np.sin, np.cos))

        bound = np.concatenate([dircol.final_state(), dircol.initial_state(), self.impulse])
        prog.AddConstraint(landing, np.zeros(8), np.zeros(8), bound)
        self.solver, self.options, self.start = IpoptSolver(), SolverOptions(), None
        self.options.SetOption(IpoptSolver.id(), "tol", 1e-8)

    def solve(self, speed):
        """Return the least integral of the squared torques."""
        dircol, prog, step = self.dircol, self.dircol.prog(), STEP / speed / self.intervals
        self.steps.evaluator().UpdateLowerBound(np.full(self.intervals, step))
        self.steps.evaluator().UpdateUpperBound(np.full(self.intervals, step))
        if self.start is None:
            line = TO_JOINTS @ straight_line(self.intervals + 1, speed)
            for k in range(self.intervals + 1):
                prog.SetInitialGuess(dircol.state(k), line[:, k])
                prog.SetInitialGuess(dircol.input(k), np.zeros(2))
            prog.SetInitialGuess(self.impulse, IMPULSE)
        else:
            prog.SetInitialGuessForAllVariables(self.start)
        for k in range(self.intervals):
            prog.SetInitialGuess(dircol.time_step(k), [step])
        answer = self.solver.Solve(prog, None, self.options)
        assert answer.is_success(), answer.get_solution_result()
        self.start = answer.GetSolution()
        return step * answer.get_optimal_cost()
