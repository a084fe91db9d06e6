"""Statements of the frozen results that are not random: published gaits, walks, laws, tuning, basins and studies."""

import math

LONG = ("laws, slipping impact", "tuned weights")
"""Studies that the default run of pytest leaves out."""

WHEEL = {"spokes": 10, "inertia_ratio": 1 / 3, "leg_length": 1.0, "mass": 1.0, "gravity": 4 / 3}
WHEEL = {"robot": "rimless_wheel", "parameters": WHEEL | {"slope": math.radians(13)}}
"""The rimless wheel of Gamus & Or (2015) in units of m, l and tau_c."""

BIPED = {"leg_length": 1.6, "leg_com": 0.8, "leg_mass": 4.0, "hip_mass": 2.0, "gravity": 9.8}
BIPED = {"robot": "compass_biped", "parameters": BIPED | {"slope": math.radians(1)}}
"""The compass biped of the same study."""

GOSWAMI = {"leg_mass": 5, "hip_mass": 10, "leg_length": 1, "leg_com": 0.5, "slope": math.radians(3), "gravity": 9.81}
SIMPLEST = {"leg_length": 1, "leg_com": 0, "hip_mass": 1, "slope": 0.009, "gravity": 1}
SIX_SPOKES = {"spokes": 6, "inertia_ratio": 0.5, "slope": 0.2, "leg_length": 1, "mass": 1, "gravity": 1}

SLIP, STICK = "slip+ stick | slip+", "stick | stick"

REFERENCE = {
    "robot": "compass_biped",
    "sequence": SLIP,
    "friction": 0.14,
    "speed": 0.633,
    "step_length": 0.4713,
    "limits": {"torque": 6.0},
    "objective": {"name": "cost_of_transport"},
    "transcription": {"name": "collocation", "intervals": 40},
}
"""The actuated compass biped on level ground."""

FEEDBACK = REFERENCE | {"limits": {"torque": 5.0}, "margins": {"cone": 0.05, "impact_cone": 0.1}}
QUICK = REFERENCE | {
    "objective": {"name": "torque_squared"},
    "transcription": {"name": "multiple_shooting", "intervals": 16},
}

LAWS = (
    {"name": "open_loop"},
    {"name": "joint_pd", "stiffness": 20, "damping": 2, "torque_limit": 8},
    {"name": "computed_torque", "stiffness": 25, "damping": 10, "torque_limit": 8},
    {"name": "lqr", "torque_limit": 8},
    {"name": "step_to_step", "torque_limit": 8},
    {"name": "joint_pd", "stiffness": 20, "damping": 2, "torque_limit": 8, "by_stance_angle": True},
)


def _at(robot, **parameters):
    return robot | {"parameters": robot["parameters"] | parameters}


def _gaits(name, robot, starts):
    return name, "find_passive_gaits", {"statement": robot | {"starts": starts}}


def published():
    """Return the computations of section 6 of the physics: (name, computation, arguments)."""
    cascade = {"configuration": [0, 0, -math.pi / 10], "velocity": [0.7, 0, 1.12], "steps": 40}
    edges = {"coordinate": "theta_rate", "interval": [0.02, 1.3], "samples": 12}
    branch = {"parameter": "friction", "values": [0.2, 0.17, 0.16, 0.14], "sequence": STICK, "starts": 30}
    wheel = {"parameter": "friction", "values": [1.0, 0.5, 0.3, 0.26, 0.235], "sequence": STICK, "starts": 20}
    light = {"robot": "compass_biped", "parameters": SIMPLEST, "parameter": "leg_mass", "sequence": STICK}
    light |= {"values": [0.004, 0.002, 0.001, 0.0005], "starts": 60}
    return (
        _gaits("rimless wheel, Type A", _at(WHEEL, friction=1.0), 20),
        _gaits("rimless wheel, Types B and D", _at(WHEEL, friction=0.3), 20),
        _gaits("rimless wheel, Type B with a first slip", _at(WHEEL, friction=0.25), 20),
        _gaits("rimless wheel, Type C", _at(WHEEL, friction=0.24), 20),
        _gaits("rimless wheel, six spokes", {"robot": "rimless_wheel", "parameters": SIX_SPOKES}, 10),
        ("rimless wheel, Types A, B and C over friction", "trace_gaits", {"statement": WHEEL | wheel}),
        ("rimless wheel, Type D to Type B", "walk_passively", {"statement": _at(WHEEL, friction=0.3) | cascade}),
        ("rimless wheel, edges of the basin", "locate_edges", {"statement": _at(WHEEL, friction=0.3) | edges}),
        ("rimless wheel, edges without slip", "locate_edges", {"statement": WHEEL | edges}),
        _gaits("compass biped, Gait A", _at(BIPED, friction=0.3), 30),
        _gaits("compass biped, Gaits B and C", _at(BIPED, friction=0.14), 100),
        ("compass biped, Gaits A and B over friction", "trace_gaits", {"statement": BIPED | branch}),
        _gaits("Goswami's compass biped", {"robot": "compass_biped", "parameters": GOSWAMI}, 40),
        ("simplest walker, light legs", "trace_gaits", {"statement": light}),
        ("reference point, slipping", "solve_problem", {"statement": REFERENCE}),
        ("reference point, sticking", "solve_problem", {"statement": REFERENCE | {"sequence": STICK}}),
    )


def studies():
    """Return the other computations: (name, computation, arguments)."""
    rates, speeds = [0.05, 1.3, 9], [-0.5, 0.55, 6]
    wheel_basin = _at(WHEEL, friction=0.3) | {"axes": {"theta_rate": rates, "foot_speed": speeds}}
    biped_basin = _at(BIPED, friction=0.15) | {
        "axes": {"th1_rate": [0.62, 0.8, 5], "th2_rate": [-0.6, -0.4, 5]},
        "base": {"th1": -0.147},
    }
    imitated = _at(BIPED, friction=0.3) | {"sequence": STICK, "starts": 30, "ground": {"slope": 0.0}, "samples": 11}
    pd = {"name": "pd", "limit": 8, "bounds": {"hip_stiffness": [0, 60], "hip_damping": [0, 20]}}
    riccati = {"name": "lqr", "limit": 8, "bounds": {"rate": [0.05, 3]}}
    test = {"starts": 8, "resolution": 0.3}
    sequences = [STICK, SLIP, "stick slip- | stick", "slip+ | slip+"]
    axes = {"friction": [0.13, 0.15]}
    cost = QUICK | {"objective": {"name": "cost_of_transport"}}
    warm = {"friction": 0.15, "speed": 0.65, "limits": {"torque": 7.0}}
    return (
        ("laws, slipping impact", "assess_laws", {"statement": FEEDBACK, "laws": list(LAWS)}),
        (
            "laws, sticking impact",
            "assess_laws",
            {"statement": FEEDBACK | {"sequence": STICK}, "laws": [LAWS[0], LAWS[1], LAWS[3]]},
        ),
        (
            "tuned joint gains",
            "tune_gains",
            {
                "statement": FEEDBACK,
                "design": pd,
                "options": {"samples": 3, "starts": 1, "evaluations": 15, "seed": 1},
                "test": test,
            },
        ),
        (
            "tuned weights",
            "tune_gains",
            {
                "statement": FEEDBACK,
                "design": riccati,
                "options": {"samples": 2, "starts": 1, "evaluations": 8, "seed": 2},
                "test": test,
            },
        ),
        ("basin of the rimless wheel", "label_basin", {"statement": wheel_basin}),
        ("basin of the compass biped", "label_basin", {"statement": biped_basin}),
        ("sweep", "tabulate_sweep", {"statement": QUICK, "sequences": [STICK, SLIP], "axes": axes}),
        ("search", "rank_sequences", {"statement": cost, "sequences": sequences}),
        ("imitation of Gait A", "imitate_gait", {"statement": imitated}),
        ("warm start, cost of transport", "resolve_problem", {"statement": REFERENCE, "changes": warm}),
        ("warm start, torque squared", "resolve_problem", {"statement": QUICK, "changes": warm}),
        (
            "warm start on a finer grid",
            "resolve_problem",
            {"statement": QUICK, "changes": {"transcription": {"name": "collocation", "intervals": 30}}},
        ),
    )
