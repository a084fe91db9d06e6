"""Sweeps of the scripts of robots with several contacts, and the energy ledgers of their gaits."""

import functools
import sys
from pathlib import Path

import xarray as xr
from drawing import TERMS

from gaitopt import Execution, sweep
from gaitopt.cli.script import load_script
from gaitopt.study import PublishedValue

REASONS = {
    "infeasible": "was not found",
    "iteration_limit": "reached the iteration limit",
    "not_verified": "failed its replay",
}
"""Descriptions of the failures, by status."""

NEGLIGIBLE = 1e-7
"""Work per distance [J/m] below which it is a rounding error."""

PROBLEMS = Path(__file__).resolve().parents[1]


def script_problem(name):
    """Return the function `problem` of a script in the folder above."""
    return load_script(PROBLEMS / f"{name}.py")


def sweep_sequences(script, problems, axes, workers=1, folder=None):
    """Return the sweeps of some problems of a script as one dataset, with their labels in the dimension ``gait``.

    If a folder is named, each sweep is stored in a file of this folder, from which an interrupted study resumes.

    The work per distance of travel is added [J/m]: ``motor_work``, without sign, and its terms ``impact``, ``friction``
    and ``braking``, in the dimension ``term``.
    """
    tables = []
    if folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
    for label, problem in problems.items():
        execution = Execution(
            workers=workers,
            prepare=functools.partial(load_script, PROBLEMS / f"{script}.py"),
            observer=print_progress(f"{problem.robot.name}, {label}"),
        )
        path = Path(folder) / f"{problem.robot.name} {label}.nc".replace(" ", "_") if folder else None
        table = sweep(problem, axes, starts=1, execution=execution, path=path).isel(sequence=0)
        if not table.attrs["complete"]:
            raise KeyboardInterrupt
        robot = problem.robot
        weight = float(robot.mass(robot.vector(problem.values))) * problem.parameters["gravity"]
        table = table.drop_vars("sequence")
        table["motor_work"] = table.cost_of_transport * weight
        table["braking_work"] = (table.motor_work * table.travel - table.actuator_work) / 2
        terms = [factor * table[name] / table.travel for name, factor, *_ in TERMS]
        labels = [name for name, *_ in TERMS]
        table["terms"] = xr.concat(terms, xr.DataArray(labels, dims="term", name="term"), coords="minimal")
        tables.append(table.drop_vars(["braking_work"]))
    gaits = xr.DataArray(list(problems), dims="gait", name="gait")
    return xr.concat(tables, gaits, coords="minimal", compat="override", combine_attrs="drop")


def print_progress(label):
    """Return an observer that prints each tenth of the computed gaits to the standard error."""

    def observe(done, count):
        if done * 10 // count > (done - 1) * 10 // count:
            print(f"{label}: {done} of {count} gaits computed", file=sys.stderr, flush=True)

    return observe


def check_balance(table, label="all gaits"):
    """Return the sum of the terms over the work of the motors, at the gait of largest error, which must be 1."""
    ratio = (table.terms.sum("term", skipna=False) / table.motor_work).where(table.verified == 1).values.ravel()
    worst = max((float(each) for each in ratio if each == each), key=lambda each: abs(each - 1))
    return PublishedValue(
        f"{label}: (impact + friction + 2 braking) / work of the motors", worst, 1.0, 1e-3, "energy balance"
    )


def describe_work(point):
    """Return a text with the work of the motors of a gait and its terms, with three digits."""
    labels = {term: label.replace("2 \N{MULTIPLICATION SIGN}", "twice the") for term, _, label, *_ in TERMS}
    parts = [f"{label} {_round(point.terms.sel(term=term))}" for term, label in labels.items()]
    return f"{_round(point.motor_work)} J/m ({', '.join(parts)} J/m)"


def _round(value):
    return f"{float(value):.3g}" if abs(float(value)) > NEGLIGIBLE else "0"


def describe_gaits(table):
    """Yield the number of gaits that were found and replayed, and the points without a gait, by friction."""
    verified, missing = (table.verified == 1).transpose("gait", "friction", ...), {}
    yield f"{int(verified.sum())} of {verified.size} gaits were found and passed the replay."
    other = verified.dims[-1]
    for index in zip(*(~verified).values.nonzero(), strict=True):
        point = table.isel(dict(zip(verified.dims, index, strict=True)))
        reason = REASONS.get(point.status.item(), f"failed ({point.status.item()})")
        places = missing.setdefault((point.gait.item(), reason), {}).setdefault(float(point.friction), [])
        if other != "friction":
            places.append(f"{float(point[other]):g}")
    for (gait, reason), places in missing.items():
        listed = [
            f"{friction:g}" + (f" ({', '.join(values)})" if values else "") for friction, values in places.items()
        ]
        label = "" if other == "friction" else f" ({other.replace('_', ' ')} [m] in parentheses)"
        yield f"{name_gait(gait).capitalize()} {reason} at friction {', '.join(listed)}{label}."


def name_gait(gait):
    """Return the name of a gait in a sentence: a landing has an article."""
    return f"the {gait}" if gait.endswith("landing") else gait
