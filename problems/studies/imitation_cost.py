"""Compass biped with motors on level ground: cost of imitating Gaits A, B and C as a function of friction.

The joint angles of a passive gait are imposed on level ground, where stick and slip follow from the contact forces
there. The cost of the torques is compared with that of the optimal sticking and slipping gaits at the speed and step
length of Gait A.
"""

import math

from compass_setup import FRICTION, SEQUENCES, gait
from drawing import GAIT_STYLE, STYLE
from published import OPTIMA, check_optimum

from gaitopt import GaitProblem, Limits, MultipleShooting, WalkProblem, compass_biped, solve, trace, verify
from gaitopt.continuation import gaits_at
from gaitopt.study import Reproduction, imitate


def study(frictions=(0.1, 0.12, 0.14, 0.16, 0.18, 0.2, 0.24), starts=40, torque_limit=6.0, intervals=80):  # [N m]
    """Return the study; 0.14 must be among the frictions."""
    imitations = {name: _imitations(name, frictions, starts) for name in SEQUENCES}
    optima = {
        sequence: [_optimum(sequence, mu, 0.633, 0.4713, torque_limit, intervals) for mu in frictions]
        for sequence in OPTIMA
    }
    numbers = []
    for sequence, reference in OPTIMA.items():
        least = optima[sequence][frictions.index(FRICTION)]
        numbers.append(
            check_optimum(f"{sequence}: minimum cost of transport at friction {FRICTION:g}", least, reference, 3e-4)
        )
    remarks = [_remark(name, imitations[name][FRICTION]) for name in SEQUENCES if FRICTION in imitations[name]]
    level = imitations["C"][FRICTION]
    speed, step = level.motion.travel / level.motion.period, level.motion.travel
    least = _optimum("slip+ stick | slip+", FRICTION, speed, step, torque_limit, intervals)
    remarks.append(
        f"At the speed {speed:.3f} m/s and step length {step:.3f} m of Gait C the optimal gait with slipping impact "
        f"has a cost of transport of {least:.5f}, the imitation {level.cost_of_transport:.5f}."
    )
    return Reproduction(_figure(imitations, frictions, optima), tuple(numbers), tuple(remarks))


def _imitations(name, frictions, starts):
    """Return the imitations of a gait on level ground, by the frictions at which the passive gait exists."""
    robot = compass_biped()
    if name == "A":
        start = gait("A", math.inf, starts)
        feasible = [mu for mu in frictions if mu > start.critical_friction.friction]
        return {mu: imitate(robot, start, {"slope": 0.0, "friction": mu}) for mu in feasible}
    start = gait(name, FRICTION, starts)
    cycles = {FRICTION: start}
    problem = WalkProblem(robot=robot, parameters=start.parameters)
    for end in {min(frictions), max(frictions)} - {FRICTION}:
        diagram = trace(problem, {"friction": (FRICTION, end)}, start=start)
        for mu in frictions:
            for cycle in gaits_at(problem, diagram, mu):
                if cycle.sequence == SEQUENCES[name]:
                    cycles[mu] = cycle
    return {mu: imitate(robot, cycle, {"slope": 0.0}) for mu, cycle in sorted(cycles.items()) if mu in frictions}


def _remark(name, level):
    if not level.feasible:
        sequence = level.motion.sequence()
        return (
            f"Gait {name} on level ground has the contact sequence '{sequence}' but is infeasible. {level.reasons[0]}"
        )
    return (
        f"Gait {name} on level ground has the contact sequence '{level.sequence}', torques up to "
        f"{level.largest_torque:.1f} N m and a cost of transport of {level.cost_of_transport:.5f}."
    )


def _optimum(sequence, friction, speed, step_length, torque_limit, intervals):
    """Return the minimum cost of transport of a contact sequence; nan if no gait was found and verified."""
    gait = solve(
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
    gait = verify(gait) if gait.status.ok else gait
    return gait.cost_of_transport if gait.status.ok else math.nan


def _figure(imitations, frictions, optima):
    with STYLE.figure(3.6) as figure:
        axes = figure.subplots()
        for name, points in imitations.items():
            style = GAIT_STYLE[name]
            for feasible, fill in ((True, style["color"]), (False, "none")):
                points_shown = [
                    (mu, level.cost_of_transport) for mu, level in points.items() if level.feasible is feasible
                ]
                label = f"Gait {name}, imitated" if feasible else f"Gait {name}, not periodic"
                if points_shown:
                    marks = {"marker": "o", "markersize": 5, "markerfacecolor": fill, "linestyle": "none"}
                    axes.plot(*zip(*points_shown, strict=True), color=style["color"], label=label, **marks)
        for (sequence, costs), dashes in zip(optima.items(), ("-", (0, (5, 1.5))), strict=True):
            axes.plot(frictions, costs, color="0.3", linestyle=dashes, label=f"optimal {sequence}")
        axes.set(xlabel=r"friction $\mu$", ylabel="cost of transport")
        figure.legend(loc="outside right center")
    return figure


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
