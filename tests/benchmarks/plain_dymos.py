"""The benchmark in dymos: Gauss-Lobatto collocation of order 3, complex steps for derivatives, and SLSQP."""

import dymos as dm
import numpy as np
import openmdao.api as om

from tests.benchmarks.compass_equations import IMPULSE, STEP, accelerations, straight_line, touchdown

STATES, TORQUES = ("th1", "th2", "w1", "w2"), ("ankle", "hip")
UNITS = {"th1": "rad", "th2": "rad", "w1": "rad/s", "w2": "rad/s", "ankle": "N*m", "hip": "N*m"}


class Flow(om.ExplicitComponent):
    """Rates of the states at all nodes."""

    def initialize(self):
        self.options.declare("num_nodes", types=int)

    def setup(self):
        nodes = self.options["num_nodes"]
        for name in (*STATES, *TORQUES):
            self.add_input(name, shape=nodes, units=UNITS[name])
        for name in ("a1", "a2"):
            self.add_output(name, shape=nodes, units="rad/s**2")
        self.add_output("square", shape=nodes, units="N**2*m**2")
        at = np.arange(nodes)
        self.declare_partials(("a1", "a2"), (*STATES, *TORQUES), rows=at, cols=at, method="cs")
        self.declare_partials("square", TORQUES, rows=at, cols=at, method="cs")

    def compute(self, inputs, outputs):
        values = [inputs[name] for name in (*STATES, *TORQUES)]
        outputs["a1"], outputs["a2"] = accelerations(*values, np.sin, np.cos)
        outputs["square"] = values[4] ** 2 + values[5] ** 2


class Landing(om.ExplicitComponent):
    """What must vanish at touchdown."""

    def setup(self):
        for name in STATES:
            self.add_input(f"last_{name}", shape=1, units=UNITS[name])
            self.add_input(f"first_{name}", shape=1, units=UNITS[name])
        self.add_input("impulse", val=IMPULSE)
        self.add_output("miss", shape=8)
        self.declare_partials("*", "*", method="cs")

    def compute(self, inputs, outputs):
        last, first = ([inputs[f"{end}_{name}"][0] for name in STATES] for end in ("last", "first"))
        outputs["miss"] = touchdown(last, first, inputs["impulse"], np.sin, np.cos)


class Walker:
    """The NLP; each solve starts from the one before."""

    def __init__(self, intervals):
        problem = self.problem = om.Problem(reports=False)
        problem.driver = om.ScipyOptimizeDriver(optimizer="SLSQP", tol=1e-8, maxiter=200, disp=False)
        problem.driver.declare_coloring(show_summary=False)
        phase = self.phase = dm.Phase(ode_class=Flow, transcription=dm.GaussLobatto(num_segments=intervals, order=3))
        trajectory = dm.Trajectory()
        problem.model.add_subsystem("trajectory", trajectory)
        trajectory.add_phase("stick", phase)
        phase.set_time_options(fix_initial=True, fix_duration=True)
        for name, rate in zip(STATES, ("w1", "w2", "a1", "a2"), strict=True):
            phase.add_state(name, rate_source=rate, targets=[name], units=UNITS[name])
        for name in TORQUES:
            phase.add_control(name, continuity=True, rate_continuity=False, targets=[name], units=UNITS[name], ref=10)
        phase.add_state("cost", rate_source="square", fix_initial=True, units="N**2*m**2*s", ref=100)
        phase.add_objective("cost", loc="final", ref=100)
        problem.model.add_subsystem("landing", Landing(), promotes_inputs=["impulse"])
        for name in STATES:
            source = f"trajectory.stick.timeseries.{name}"
            problem.model.connect(source, f"landing.last_{name}", src_indices=[-1])
            problem.model.connect(source, f"landing.first_{name}", src_indices=[0])
        problem.model.add_design_var("impulse", ref=100)
        problem.model.add_constraint("landing.miss", equals=0.0)
        problem.setup()
        self.started = False

    def solve(self, speed):
        """Return the least integral of the squared torques."""
        problem, phase = self.problem, self.phase
        phase.set_time_val(initial=0.0, duration=STEP / speed)
        if not self.started:
            line = straight_line(2, speed)
            for name, ends in zip(STATES, line, strict=True):
                phase.set_state_val(name, list(ends))
            for name in TORQUES:
                phase.set_control_val(name, [0.0, 0.0])
            phase.set_state_val("cost", [0.0, 100.0])
            self.started = True
        failed = not problem.run_driver().success
        assert not failed
        return float(problem.get_val("trajectory.stick.timeseries.cost")[-1, 0])
