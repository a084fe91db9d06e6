"""Random problem statements, seeded: what make_frozen.py chooses the frozen problems from.

A slot fixes what a problem is about (objective, contact sequence, transcription, a special feature); an attempt draws
the rest.  Statements are plain data, as described in computations.py.
"""

import itertools

import numpy as np

SEED = 12

FRICTIONS = {
    "stick | stick": (0.14, 0.3),
    "slip+ stick | slip+": (0.1, 0.2),
    "stick slip- | stick": (0.11, 0.16),
    "slip+ stick slip- | slip+": (0.09, 0.13),
    "slip+ stick slip- | stick": (0.11, 0.16),
    "any | any": (0.11, 0.25),
    "slip+ stick | any": (0.11, 0.18),
    "any | stick": (0.13, 0.2),
}
"""Frictions at which a contact sequence is likely to have a gait."""

OBJECTIVES = ("cost_of_transport", "positive_work", "positive_work with regeneration", "torque_squared")
CLOSED = ("stick | stick", "slip+ stick | slip+", "stick slip- | stick", "slip+ stick slip- | slip+")
STICK, SLIP = CLOSED[:2]

FEATURES = (
    # (feature, objective, contact sequence, transcription)
    ("free slope", "cost_of_transport", STICK, "collocation"),
    ("free slope", "torque_squared", SLIP, "multiple_shooting"),
    ("downhill", "positive_work", SLIP, "collocation"),
    ("downhill", "torque_squared", STICK, "collocation"),
    ("uphill", "cost_of_transport", SLIP, "multiple_shooting"),
    ("speed range", "cost_of_transport", SLIP, "collocation"),
    ("speed range", "torque_squared", STICK, "multiple_shooting"),
    ("free step", "torque_squared", SLIP, "collocation"),
    ("free step", "positive_work with regeneration", STICK, "collocation"),
    ("torque rate", "torque_squared", STICK, "collocation"),
    ("torque rate", "cost_of_transport", SLIP, "collocation"),
    ("weak ankle", "cost_of_transport", STICK, "multiple_shooting"),
    ("weak ankle", "torque_squared", SLIP, "collocation"),
    ("margins", "cost_of_transport", SLIP, "collocation"),
    ("margins", "positive_work", STICK, "multiple_shooting"),
    ("scattered guess", "torque_squared", SLIP, "collocation"),
    ("scattered guess", "cost_of_transport", STICK, "collocation"),
    ("keyframes", "cost_of_transport", STICK, "collocation"),
    ("starts", "torque_squared", SLIP, "multiple_shooting"),
    ("starts", "cost_of_transport", SLIP, "collocation"),
    ("ipopt", "torque_squared", STICK, "multiple_shooting"),
    ("no friction limit", "torque_squared", STICK, "collocation"),
)

OPEN = (
    ("any | any", "cost_of_transport", "collocation"),
    ("any | any", "torque_squared", "collocation"),
    ("any | any", "positive_work", "multiple_shooting"),
    ("slip+ stick | any", "cost_of_transport", "collocation"),
    ("slip+ stick | any", "torque_squared", "multiple_shooting"),
    ("any | stick", "cost_of_transport", "collocation"),
)

FAILING = (
    ("too weak", "cost_of_transport", STICK, "collocation"),
    ("too weak", "torque_squared", SLIP, "multiple_shooting"),
    ("too slippery", "torque_squared", STICK, "collocation"),
    ("too fast", "cost_of_transport", SLIP, "collocation"),
    ("slow joints", "torque_squared", STICK, "multiple_shooting"),
    ("too weak", "positive_work", SLIP, "collocation"),
)

FIVE_LINK = (
    {
        "sequence": SLIP,
        "objective": {"name": "torque_squared"},
        "friction": 0.2,
        "solver": {"name": "ipopt", "tolerance": 1e-10},  # its cost of transport is not what is minimised
    },
    {"sequence": STICK, "objective": {"name": "torque_squared"}, "friction": 0.35},
)


def slots():
    """Return the slots in order: (name, whether a gait is expected, maker of a statement from a random generator)."""
    listed = []

    def add(name, make, solved=True):
        listed.append((name, solved, make))

    for objective, sequence, method in itertools.product(OBJECTIVES, CLOSED, ("collocation", "multiple_shooting")):
        name = f"{objective}, {sequence}, {method}"
        add(name, lambda rng, made=(objective, sequence, method): compass(rng, *made))
    for objective in ("cost_of_transport", "torque_squared"):
        made = (objective, "slip+ stick slip- | stick", "collocation")
        add(", ".join(made), lambda rng, made=made: compass(rng, *made))
    for feature, *made in FEATURES:
        add(f"{feature}: {', '.join(made)}", lambda rng, of=feature, made=made: featured(rng, of, *made))
    for sequence, objective, method in OPEN:
        made = (objective, sequence, method)
        add(", ".join(made), lambda rng, made=made: compass(rng, *made, intervals=(16, 20)))
    for changes in FIVE_LINK:
        add(f"five_link, {changes['sequence']}", lambda rng, changes=changes: five_link(rng, changes))
    for feature, *made in FAILING:
        add(f"{feature}: {', '.join(made)}", lambda rng, of=feature, made=made: failing(rng, of, *made), False)
    return listed


def draw(slot, attempt):
    """Return the statement of an attempt at a slot, given by its number."""
    return slots()[slot][2](np.random.default_rng([SEED, slot, attempt]))


def _between(rng, lower, upper, digits=4):
    return round(float(rng.uniform(lower, upper)), digits)


def compass(rng, objective, sequence, method, intervals=(16, 20, 24, 30, 40)):
    """Return a problem of a compass biped near the reference one, every other time with a random body."""
    statement = {"robot": "compass_biped", "sequence": sequence}
    if rng.uniform() < 0.6:
        length = _between(rng, 1.3, 1.9)
        statement["parameters"] = {
            "leg_length": length,
            "leg_com": round(length * _between(rng, 0.4, 0.6), 4),
            "leg_mass": _between(rng, 2, 6),
            "hip_mass": _between(rng, 1, 8),
        }
    count = int(rng.choice(intervals))
    return statement | {
        "friction": _between(rng, *FRICTIONS[sequence]),
        "speed": _between(rng, 0.53, 0.74),
        "step_length": _between(rng, 0.42, 0.52),
        "limits": {"torque": _between(rng, 6, 16, 2)},
        "objective": _objective(rng, objective),
        "transcription": {"name": method, "intervals": count},
    }


def _objective(rng, objective):
    if objective == "positive_work with regeneration":
        return {"name": "positive_work", "regeneration": _between(rng, 0.2, 0.8, 2)}
    return {"name": objective}


def featured(rng, feature, *made):
    """Return a problem of a compass biped with one special feature."""
    given = compass(rng, *made)
    torque, step, speed = given["limits"]["torque"], given["step_length"], given["speed"]
    angle = round(step / 2 / given.get("parameters", {}).get("leg_length", 1.6), 4)
    changes = {
        "free slope": lambda: {"slope": [-0.01, _between(rng, 0.002, 0.01)]},
        "downhill": lambda: {"slope": _between(rng, 0.003, 0.015, 5)},
        "uphill": lambda: {"slope": -_between(rng, 0.003, 0.012, 5)},
        "speed range": lambda: {"speed": [round(0.9 * speed, 4), round(1.1 * speed, 4)]},
        "free step": lambda: {"step_length": [round(0.8 * step, 4), round(1.2 * step, 4)]},
        "torque rate": lambda: {"limits": {"torque": torque, "torque_rate": _between(rng, 20, 60, 1)}},
        "weak ankle": lambda: {"limits": {"torque": {"ankle": _between(rng, 3, 6, 2), "hip": torque}}},
        "margins": lambda: {"margins": {"cone": 0.05, "impact_cone": 0.1, "separation": 0.01}},
        "scattered guess": lambda: {"guess": {"name": "scattered", "seed": int(rng.integers(1, 100))}},
        "keyframes": lambda: {"guess": _keyframes(angle)},
        "starts": lambda: {"starts": 2},
        "ipopt": lambda: {"solver": {"name": "ipopt"}},
        "no friction limit": lambda: {},
    }[feature]()
    if feature == "no friction limit":
        del given["friction"]
    return given | changes


def _keyframes(angle):
    angles = {"th1": [-angle, 0.0, angle], "th2": [-angle, 0.3 * angle, angle]}
    return {"name": "keyframes", "fractions": [0.0, 0.5, 1.0], "angles": angles}


def failing(rng, feature, *made):
    """Return a problem of a compass biped that has no gait."""
    given = compass(rng, *made, intervals=(16, 20))
    return (
        given
        | {
            "too weak": {"limits": {"torque": 0.2}},
            "too slippery": {"friction": 0.03},
            "too fast": {"speed": 3.0},
            "slow joints": {"limits": {"torque": 10.0, "rate": 0.3}},
        }[feature]
    )


def five_link(rng, changes):
    """Return a problem of the five-link walker of the problem scripts."""
    knee = [0.02, 1.5]
    return {
        "robot": "five_link",
        "speed": _between(rng, 0.55, 0.65),
        "step_length": _between(rng, 0.37, 0.41),
        "limits": {"torque": 40.0, "clearance": 0.02, "angle": {"stance knee": knee, "swing knee": knee}},
        "transcription": {"name": "collocation", "intervals": 40, "points": 6, "tolerance": 1e-6},
        **changes,
    }
