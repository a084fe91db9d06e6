"""Compass biped with motors on level ground: what it costs to imitate Gaits A, B and C, over friction.

The torques that walk a passive gait's angles on level ground, where stick and slip are decided afresh, beside the
cheapest sticking and slipping gait at the speed and step length of Gait A.
"""

import math

from compass_setup import FRICTION, SEQUENCES, gait
from drawing import GAIT_STYLE, STYLE
from published import OWN, published

from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped, solve, trace_branch, verify
from gaitopt.study import Reproduction, imitate

OPTIMAL = {"stick | stick": "0.01627", "slip+ stick | slip+": "0.01586"}
"""Cost of transport by contact sequence at friction 0.14."""


def study(frictions=(0.1, 0.12, 0.14, 0.16, 0.18, 0.2, 0.24), starts=100, torque_limit=6.0, intervals=40):  # [N m]
    """Return the study; 0.14 must be among the frictions."""
    walked = {name: _imitations(name, frictions, starts) for name in SEQUENCES}
    optima = {
        sequence: [_optimum(sequence, mu, 0.633, 0.4713, torque_limit, intervals) for mu in frictions]
        for sequence in OPTIMAL
    }
    numbers = []
    for sequence, printed in OPTIMAL.items():
        least = optima[sequence][frictions.index(FRICTION)]
        numbers.append(
            published(f"{sequence}: least cost of transport at friction {FRICTION:g}", least, printed, source=OWN)
        )
    remarks = [_remark(name, walked[name][FRICTION]) for name in SEQUENCES if FRICTION in walked[name]]
    level = walked["C"][FRICTION]
    speed, step = level.motion.travel / level.motion.period, level.motion.travel
    least = _optimum("slip+ stick | slip+", FRICTION, speed, step, torque_limit, intervals)
    remarks.append(
        f"At the speed {speed:.3f} m/s and step {step:.3f} m of Gait C the cheapest gait with slipping impact costs "
        f"{least:.5f}, its imitation {level.cost_of_transport:.5f}."
    )
    return Reproduction(_figure(walked, frictions, optima), tuple(numbers), tuple(remarks))


def _imitations(name, frictions, starts):
    """Return the imitations of a gait on level ground by friction, where the passive gait is there."""
    robot = compass_biped()
    if name == "A":
        start = gait("A", math.inf, starts)
        enough = [mu for mu in frictions if mu > start.critical_friction.friction]
        return {mu: imitate(robot, start, {"slope": 0.0, "friction": mu}) for mu in enough}
    start = gait(name, FRICTION, starts)
    found = {FRICTION: start}
    for side in (
        sorted(mu for mu in frictions if mu > FRICTION),
        sorted(mu for mu in frictions if mu < FRICTION)[::-1],
    ):
        branch = trace_branch(robot, start.parameters, start, "friction", side) if side else None
        for cycle in branch.cycles if branch else ():
            if cycle.sequence == SEQUENCES[name] and cycle.parameters["friction"] in side:
                found[cycle.parameters["friction"]] = cycle
    return {mu: imitate(robot, cycle, {"slope": 0.0}) for mu, cycle in sorted(found.items()) if mu in frictions}


def _remark(name, level):
    if not level.feasible:
        return f"Gait {name} on level ground walks '{level.motion.sequence()}' but cannot go on: {level.reasons[0]}"
    return (
        f"Gait {name} on level ground walks '{level.sequence}' with torques up to {level.largest_torque:.1f} N m "
        f"and costs {level.cost_of_transport:.5f}."
    )


def _optimum(sequence, friction, speed, step_length, torque_limit, intervals):
    """Return the least cost of transport of a contact sequence; nan where no gait was found and verified."""
    found = solve(
        GaitProblem(
            robot=compass_biped(),
            sequence=sequence,
            friction=friction,
            speed=speed,
            step_length=step_length,
            limits=Limits(torque=torque_limit),
            transcription=MultipleShooting(intervals=intervals),
        )
    )
    found = verify(found) if found.status.ok else found
    return found.cost_of_transport if found.status.ok else math.nan


def _figure(walked, frictions, optima):
    with STYLE.figure(3.6) as figure:
        axes = figure.subplots()
        for name, points in walked.items():
            style = GAIT_STYLE[name]
            for feasible, fill in ((True, style["color"]), (False, "none")):
                own = [(mu, level.cost_of_transport) for mu, level in points.items() if level.feasible is feasible]
                label = f"Gait {name}, imitated" if feasible else f"Gait {name}, does not repeat"
                if own:
                    marks = {"marker": "o", "markersize": 5, "markerfacecolor": fill, "linestyle": "none"}
                    axes.plot(*zip(*own, strict=True), color=style["color"], label=label, **marks)
        for (sequence, costs), dashes in zip(optima.items(), ("-", (0, (5, 1.5))), strict=True):
            axes.plot(frictions, costs, color="0.3", linestyle=dashes, label=f"cheapest {sequence}")
        axes.set(xlabel=r"friction $\mu$", ylabel="cost of transport")
        figure.legend(loc="outside right center")
    return figure


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
