"""The gaits to be stabilised, planned with 5 N m and stabilised with 6 N m, and the laws tuned for them."""

import functools

from compass_setup import FRICTION, gait

from gaitopt import (
    Collocation,
    GainSearchOptions,
    GaitProblem,
    Limits,
    Margins,
    PushTest,
    assess_stability,
    compass_biped,
    computed_torque,
    feedforward,
    solve,
    tune_feedback,
    verify,
)
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.stability import find_largest_recovery, measure_recovery
from gaitopt.study import controlled_gait, imitate
from gaitopt.tuning import controller_family_named

SLIP, STICK, IMITATED = "slip+ stick | slip+", "stick | stick", "Gait C imitated"
PLAN_LIMIT, FEEDBACK_LIMIT = 5.0, 6.0
"""Torque limits of the plan and under feedback [N m]; the difference is a reserve for feedback."""

OPEN_LOOP = "open loop"
LAW_STYLE = {
    OPEN_LOOP: {"color": "0.35", "linestyle": (0, (1.5, 1)), "marker": "s"},
    "joint_pd": {"color": "#D55E00", "linestyle": (0, (5, 1.5)), "marker": "^"},
    "computed_torque": {"color": "#0072B2", "linestyle": "-", "marker": "o"},
    "lqr": {"color": "#009E73", "linestyle": (0, (5, 1.5, 1, 1.5)), "marker": "D"},
    "step_lqr": {"color": "#AA4499", "linestyle": (0, (3, 1, 1, 1, 1, 1)), "marker": "v"},
}
LABEL = {"joint_pd": "joint PD", "computed_torque": "computed torque", "lqr": "LQR", "step_lqr": "step to step"}
LAWS = tuple(LABEL)


@functools.cache
def plan(name):
    """Return a gait by name: one of SLIP, STICK and IMITATED.

    IMITATED imposes the joint angles of the passive Gait C on level ground. They require more torque than the limit, so
    the plan is the neighbouring gait of the walker under computed torque with this limit.
    """
    robot = compass_biped()
    if name == IMITATED:
        model = imitate(robot, gait("C", FRICTION), {"slope": 0.0}).gait(samples=100)
        law = computed_torque(robot, model.motion, stiffness=100, damping=20, torque_limit=PLAN_LIMIT)
        return controlled_gait(model, law)
    problem = GaitProblem(
        robot=robot,
        sequence=name,
        friction=FRICTION,
        speed=0.633,
        step_length=0.4713,
        limits=Limits(torque=PLAN_LIMIT),
        margins=Margins(cone=0.05, impact_cone=0.1),
        transcription=Collocation(intervals=40),
    )
    return verify(solve(problem))


@functools.cache
def tune_law(name, law, evaluations=60, starts=200):
    """Return a law tuned for a gait, both by name, for the smallest spectral radius."""
    gait_plan = plan(name)
    design = controller_family_named(law, compass_biped(), gait_plan.motion, torque_limit=FEEDBACK_LIMIT)
    return tune_feedback(
        gait_plan, design, search=GainSearchOptions(evaluations=evaluations), test=PushTest(starts=starts)
    )


def walker(name, law, **parameters):
    """Return the walker of a gait under a law, optionally with changed parameters."""
    robot, gait_plan = compass_biped(), plan(name)
    return make_walker(robot, law, {**gait_plan.motion.parameters, **parameters}, period=gait_plan.period)


def assess_open_loop(name):
    """Return the law of the open loop and the cycle of the walker under it."""
    law = feedforward(compass_biped(), plan(name).motion)
    return law, assess_stability(plan(name), law)


def largest_ball(name, law, cycle, starts):
    """Return the recovery from the largest ball of pushes from which all walks return."""
    return find_largest_recovery(walker(name, law), cycle, PushTest(starts=starts))


def recovery_rate(name, law, cycle, radius, starts):
    """Return the fraction of pushes in a ball from which the walker returns."""
    return measure_recovery(walker(name, law), cycle, radius, PushTest(starts=starts)).fraction
