"""The file of reference numbers: for each script its computations, their values and their accuracy."""

import json
import sys
import time
from pathlib import Path

import numpy as np

MULTIPLIER_ACCURACY = 1e-7
"""Accuracy of derivatives by finite differences, hence of complex numbers: two integrators agree within 5e-10, and step
sizes of the differences within 5e-8."""

FILE = Path(__file__).with_name("references.json")


def load_references():
    """Return {script: {computation: {"accuracy": float, name: value, ...}}}."""
    return json.loads(FILE.read_text())


def reference(script, computation):
    """Return the values of a computation; ``accuracy`` is the absolute accuracy of all but the multipliers."""
    return load_references()[script][computation]


def complex_numbers(pairs):
    """Return the complex numbers of (real, imaginary) pairs, sorted by imaginary and real part."""
    return np.array(sorted((complex(*pair) for pair in pairs), key=lambda m: (m.imag, m.real)))


def differ_most(values, others):
    """Return the largest difference between the numbers of two results of the same computation."""
    if isinstance(values, dict):
        assert values.keys() == others.keys()
        return max(differ_most(values[name], others[name]) for name in values)
    if isinstance(values, str):
        return 0.0 if values == others else np.inf
    return float(np.max(np.abs(np.asarray(values, float) - np.asarray(others, float))))


def run(script, computations):
    """Compute, print and, with ``--write``, store the numbers of a script.

    Parameters
    ----------
    script : str
    computations : dict of str to (function, accuracy)
        Functions without arguments that return a dict of numbers, lists of numbers and strings.
    """
    results = {}
    for name, (function, accuracy) in computations.items():
        began = time.perf_counter()
        values = round_to(function(), accuracy)
        results[name] = {"accuracy": accuracy, **values}
        print(f"{name} (within {accuracy:g}, {time.perf_counter() - began:.1f} s)", flush=True)
        for key, value in values.items():
            print(f"    {key:24} {value}", flush=True)
    if "--write" in sys.argv:
        stored = load_references() if FILE.exists() else {}
        FILE.write_text(json.dumps(stored | {script: results}, indent=1) + "\n")


def round_to(value, accuracy):
    """Return plain numbers, rounded one decimal beyond their accuracy."""
    if isinstance(value, dict):
        return {name: round_to(entry, accuracy) for name, entry in value.items()}
    if isinstance(value, str):
        return value
    array = np.asarray(value)
    if np.iscomplexobj(array):
        pairs = sorted(array.ravel().tolist(), key=lambda m: (round(m.imag, 6), m.real))
        array, accuracy = np.array([[m.real, m.imag] for m in pairs]), max(accuracy, MULTIPLIER_ACCURACY)
    decimals = int(np.ceil(-np.log10(accuracy))) + 1
    return (np.round(array.astype(float), decimals) + 0.0).tolist()
