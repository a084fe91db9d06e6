"""Frozen results as the present code computes them: the only module of this folder that calls gaitopt.

Every function takes plain data (a statement: keyword arguments by name, SI units, angles in rad) and returns plain
data.  A change of the API is an edit of this file only; the statements and numbers in the JSON files stay as they are.
"""

import functools
import math
import runpy
from pathlib import Path

import numpy as np

from gaitopt import (
    Collocation,
    CostOfTransport,
    GainSearchOptions,
    GaitProblem,
    Ipopt,
    Keyframes,
    Limits,
    LinearGuess,
    Margins,
    MultipleShooting,
    Newton,
    PositiveWork,
    PushTest,
    RandomPerturbation,
    TorqueSquared,
    WalkProblem,
    WarmStart,
    assess_stability,
    basin,
    by_stance_angle,
    compass_biped,
    computed_torque,
    find_cycles,
    joint_pd,
    lqr,
    rimless_wheel,
    search,
    simulate,
    solve,
    step_lqr,
    sweep,
    trace,
    tune_feedback,
    verify,
)
from gaitopt.continuation import gaits_at
from gaitopt.study import ending_labels, imitate, locate_basin_edges
from gaitopt.tuning import controller_family_named

PROBLEMS = Path(__file__).resolve().parents[2] / "problems"

OBJECTIVES = {
    "cost_of_transport": CostOfTransport,
    "positive_work": PositiveWork,
    "torque_squared": TorqueSquared,
}
TRANSCRIPTIONS = {"collocation": Collocation, "multiple_shooting": MultipleShooting}
GUESSES = {"line": LinearGuess, "keyframes": Keyframes, "scattered": RandomPerturbation}
SOLVERS = {"newton": Newton, "ipopt": Ipopt}
LAWS = {"joint_pd": joint_pd, "computed_torque": computed_torque, "lqr": lqr, "step_to_step": step_lqr}


@functools.cache
def make_robot(name):
    """Return a robot of the catalogue, or that of a problem script."""
    if name == "five_link":
        return runpy.run_path(str(PROBLEMS / "five_link.py"))["five_link"]()
    return {"compass_biped": compass_biped, "rimless_wheel": rimless_wheel}[name]()


def make_problem(statement, guess=None):
    """Return the GaitProblem of a statement; what the statement does not name keeps its default."""
    given = dict(statement)
    options = {"objective": {"name": "cost_of_transport"}, "transcription": {"name": "collocation"}} | given
    if guess is None and "guess" in given:
        guess = _make(GUESSES, given["guess"])
    changes = {name: _as_pair(given[name]) for name in ("slope", "speed", "step_length") if name in given}
    if "friction" in given:
        changes["friction"] = given["friction"]
    return GaitProblem(
        robot=make_robot(given["robot"]),
        sequence=given["sequence"],
        parameters=given.get("parameters", {}),
        limits=Limits(**{name: _as_pair(value) for name, value in given.get("limits", {}).items()}),
        margins=Margins(**given.get("margins", {})),
        objective=_make(OBJECTIVES, options["objective"]),
        transcription=_make(TRANSCRIPTIONS, options["transcription"]),
        guess=guess,
        **changes,
    )


def solve_statement(statement, guess=None):
    """Return the gait of a statement, verified if it is solved; ``starts`` and ``solver`` are options of the solve."""
    problem = make_problem(statement, guess)
    solver = _make(SOLVERS, statement["solver"]) if "solver" in statement else None
    gait = solve(problem, starts=statement.get("starts", 1), solver=solver)
    return verify(gait) if gait.status.ok else gait


def _make(kinds, statement):
    options = dict(statement)
    return kinds[options.pop("name")](**options)


def _as_pair(value):
    """Return a list of two as a tuple, in mappings too: JSON has no tuples."""
    if isinstance(value, dict):
        return {name: _as_pair(entry) for name, entry in value.items()}
    return tuple(value) if isinstance(value, list) else value


def tabulate_gait(gait):
    """Return what is frozen of a gait: of one that is not solved only its status."""
    if gait.verification is None and not gait.status.ok:
        return {"status": gait.status.key}
    first, last, jump = gait.motion.segments[0], gait.motion.segments[-1], gait.motion.jumps[-1]
    return {
        "status": gait.status.key,
        "sequence": str(gait.sequence),
        "objective": gait.solver.objective,
        "cost_of_transport": gait.cost_of_transport,
        "period": gait.period,
        "travel": gait.step_length,
        "durations": [segment.duration for segment in gait.motion.segments],
        "initial": _state(first.q[:, 0], first.v[:, 0]),
        "final": _state(last.q[:, -1], last.v[:, -1]),
        "impulse": jump.impulse.tolist(),
        "verification": {
            "passed": gait.verification.passed,
            "sequence": gait.verification.sequence,
            "stop": gait.verification.stop,
        },
    }


def _state(q, v):
    return {"configuration": q.tolist(), "velocity": v.tolist()}


def solve_problem(statement):
    """Return the frozen results of one problem."""
    return tabulate_gait(solve_statement(statement))


def resolve_problem(statement, changes):
    """Return the frozen results of a changed problem that starts from the gait of the original one.

    The cost is flat: at the default tolerance, states differ by 1.4e-6 while the cost differs by 5e-10.
    """
    problem = make_problem(statement | changes, WarmStart(solve_statement(statement)))
    return tabulate_gait(verify(solve(problem, solver=Newton(fallback=Ipopt(tolerance=1e-9)))))


def describe_cycle(cycle):
    """Return what is frozen of a periodic gait."""
    critical = cycle.critical_friction
    energy = cycle.energy
    return {
        "sequence": cycle.sequence,
        "state": list(cycle.state.values()),
        "period": cycle.period,
        "travel": cycle.travel,
        "multipliers": as_pairs(cycle.multipliers),
        "drift": cycle.drift,
        "impact_ratio": cycle.impact_ratio,
        "critical_friction": None if critical is None else critical.friction,
        "critical_friction_of_impact": None if critical is None else critical.impact,
        "energy": [energy.impact_loss, energy.friction_loss],
    }


def as_pairs(multipliers):
    """Return complex numbers as pairs of real and imaginary part."""
    return [[value.real, value.imag] for value in multipliers.tolist()]


FOOT_SPEED = 1.046566598128405
"""Foot speed [m/s] of the gaits that slip throughout."""


def find_passive_gaits(statement):
    """Return all periodic gaits of a passive walker that a seeded search finds, ordered by sequence and state."""
    robot, parameters = make_robot(statement["robot"]), statement["parameters"]
    cycles = find_cycles(robot, parameters, starts=statement["starts"])
    cycles = [choose_foot_speed(robot, parameters, cycle) if cycle.drift else cycle for cycle in cycles]
    return sorted(map(describe_cycle, cycles), key=lambda gait: (gait["sequence"], gait["state"]))


def choose_foot_speed(robot, parameters, cycle):
    """Return a gait that slips throughout at the frozen foot speed, which its motion does not determine."""
    return find_cycles(robot, parameters, starts=[cycle.state | {"foot_speed": FOOT_SPEED}])[0]


def trace_gaits(statement):
    """Return the gaits of a branch at the requested values of its parameter, and where something changes between."""
    robot, parameters, name = make_robot(statement["robot"]), statement["parameters"], statement["parameter"]
    first = parameters | {name: statement["values"][0]}
    start = find_cycles(robot, first, sequence=statement["sequence"], starts=statement["starts"])[0]
    problem, values = WalkProblem(robot=robot, parameters=parameters), statement["values"]
    diagram = trace(problem, {name: (values[0], values[-1])}, start=start)
    return {
        "gaits": [describe_cycle(gait) for value in values for gait in gaits_at(problem, diagram, value)],
        "changes": [point.value for point in diagram.branches[0].special],
    }


def walk_passively(statement):
    """Return the sequences of the steps of a passive walk and its state after the last touchdown."""
    robot = make_robot(statement["robot"])
    walk = simulate(
        robot,
        statement["configuration"],
        statement["velocity"],
        statement["parameters"],
        steps=statement["steps"],
    )
    jump = walk.motion.jumps[-1]
    return {
        "stop": walk.stop.key,
        "sequences": [str(walk.motion.sequence(jump.step)) for jump in walk.motion.jumps],
        "final": _state(jump.q_next, jump.v_next),
    }


def make_law(statement, robot, motion):
    """Return the law of a statement for a motion; None for the torques of the gait, played back."""
    if statement["name"] == "open_loop":
        return None
    options = {name: value for name, value in statement.items() if name not in ("name", "by_stance_angle")}
    law = LAWS[statement["name"]](robot, motion, **options)
    return by_stance_angle(robot, motion, law) if statement.get("by_stance_angle") else law


def assess_laws(statement, laws):
    """Return sequence, fixed point and multipliers of a solved gait under each law."""
    gait = solve_statement(statement)
    robot, found = make_robot(statement["robot"]), []
    for law in laws:
        cycle = assess_stability(gait, make_law(law, robot, gait.motion))
        found.append(
            {"sequence": cycle.sequence, "state": cycle.z.tolist(), "multipliers": as_pairs(cycle.multipliers)}
            | {"stable": cycle.stable, "one_sided": len(cycle.one_sided)}
        )
    return found


def tune_gains(statement, design, options, test):
    """Return the gains that a seeded search tunes for a solved gait, and the spectral radii."""
    gait = solve_statement(statement)
    family = controller_family_named(
        design["name"], make_robot(statement["robot"]), gait.motion, torque_limit=design["limit"]
    )
    if "bounds" in design:
        family = family.with_bounds({name: tuple(span) for name, span in design["bounds"].items()})
    tuned = tune_feedback(gait, family, search=GainSearchOptions(**options), test=PushTest(**test))
    return {
        "gains": tuned.gains,
        "evaluations": tuned.evaluations,
        "radius_before": tuned.radius_before,
        "radius_after": tuned.radius_after,
        "stable": tuned.stable,
        "returned": tuned.verified.returned,
        "verified_radius": tuned.verified.radius,
    }


def label_basin(statement):
    """Return the ending of each start of a basin, in the shape of its axes, and the steps until then."""
    axes = {name: np.linspace(*span) for name, span in statement["axes"].items()}
    fixed = statement["parameters"] | statement.get("base", {})
    table = basin(make_robot(statement["robot"]), fixed, axes)
    return {"labels": ending_labels(table).tolist(), "steps": table.steps.values.tolist()}


def locate_edges(statement):
    """Return where the ending of walks changes along a coordinate: value, ending below, ending above."""
    edges = locate_basin_edges(
        make_robot(statement["robot"]),
        statement["parameters"],
        {statement["coordinate"]: np.linspace(*statement["interval"], statement["samples"])},
    )
    return [list(edge) for edge in edges]


def tabulate_sweep(statement, sequences, axes):
    """Return the numbers of a sweep: statuses, verdicts and measures over contact sequence and axes."""
    table = sweep(make_problem(statement), axes, sequences=sequences, starts=1)
    measures = ("cost_of_transport", "objective", "period", "travel", "foot_slide", "peak_torque")
    return {
        "status": table.status.values.tolist(),
        "verified": table.verified.values.tolist(),
        **{name: table[name].values.tolist() for name in measures},
    }


def rank_sequences(statement, sequences):
    """Return contact sequences in the order of a search, with status, costs and what each was merged into."""
    ranking = search(make_problem(statement), sequences=sequences, starts=1)
    return [
        {
            "sequence": record["sequence"],
            "status": record["status"],
            "objective": record["objective"],
            "cost_of_transport": record["cost_of_transport"],
            "merged_into": record["merged_into"],
            "passed": record["verification"] and record["verification"]["passed"],
        }
        for record in ranking.records()
    ]


def imitate_gait(statement):
    """Return the torques, at equal fractions of the step, that walk the angles of a passive gait on other ground."""
    robot = make_robot(statement["robot"])
    cycles = find_cycles(robot, statement["parameters"], sequence=statement["sequence"], starts=statement["starts"])
    walked = imitate(robot, cycles[0], statement["ground"])
    motion = walked.motion
    time, torque = motion.channel("time"), motion.channel("torque")
    at = np.linspace(time[0], time[-1], statement["samples"])
    return {
        "sequence": str(walked.sequence),
        "feasible": walked.feasible,
        "cost_of_transport": walked.cost_of_transport,
        "period": motion.period,
        "torque": [np.interp(at, time, row).tolist() for row in torque],
        "work": [math.fsum(segment.work[i, -1] for segment in motion.segments) for i in range(robot.n_u)],
    }
