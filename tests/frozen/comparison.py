"""Comparison of computed results with frozen ones: costs within 1e-8, states within 1e-6, everything else equal."""

import math

import numpy as np

COSTS = {"cost_of_transport": 1e-8, "objective": 1e-8}
"""Relative tolerances of costs."""

STATES = 1e-6
"""Relative tolerance of all other numbers."""

VECTORS = ("configuration", "velocity", "state", "impulse", "torque", "work", "energy", "foot_slide", "durations")
"""Entries that are compared relative to the largest of them; all others one by one."""

ROUNDING = 1e-12
"""A number whose frozen value is zero may differ by this much."""


def assert_agree(computed, frozen, *, share=1.0, place="result"):
    """Raise AssertionError, which names the place, unless computed results agree with frozen ones.

    Parameters
    ----------
    computed, frozen : plain data
    share : float
        Share of the tolerances that is granted.
    place : str
        Where in the results this is.
    """
    name = place.rpartition(".")[2].partition("[")[0]
    if isinstance(frozen, dict):
        assert isinstance(computed, dict), f"{place} has no entries"
        assert sorted(computed) == sorted(frozen), f"{place} has entries {sorted(computed)}, not {sorted(frozen)}"
        for key in frozen:
            assert_agree(computed[key], frozen[key], share=share, place=f"{place}.{key}")
    elif name == "multipliers":
        _assert_same_multipliers(computed, frozen, share, place)
    elif name in VECTORS and isinstance(frozen, list):
        _assert_near(computed, frozen, share * STATES * np.max(np.abs(frozen)), place)
    elif isinstance(frozen, list):
        assert isinstance(computed, list), f"{place} is no list"
        assert len(computed) == len(frozen), f"{place} has {len(computed)} entries, not {len(frozen)}"
        for i, (one, other) in enumerate(zip(computed, frozen, strict=True)):
            assert_agree(one, other, share=share, place=f"{place}[{i}]")
    elif isinstance(frozen, float) and isinstance(computed, int | float):
        _assert_near(computed, frozen, share * COSTS.get(name, STATES) * abs(frozen), place)
    else:
        same = type(computed) is type(frozen) and computed == frozen
        assert same, f"{place} is {computed!r}, not {frozen!r}"


def _assert_near(computed, frozen, tolerance, place):
    one, other = np.asarray(computed, dtype=float), np.asarray(frozen, dtype=float)
    assert one.shape == other.shape, f"{place} has shape {one.shape}, not {other.shape}"
    error = float(np.max(np.abs(one - other), initial=0.0))
    assert error <= tolerance + ROUNDING, f"{place} is {computed}, not {frozen}: off by {error:.2e} > {tolerance:.2e}"


def _assert_same_multipliers(computed, frozen, share, place):
    """Compare multipliers, whose order is not defined within a pair, as sets."""
    assert len(computed) == len(frozen), f"{place}: {len(computed)} multipliers, not {len(frozen)}"
    left = [complex(*value) for value in computed]
    tolerance = share * STATES * max(math.hypot(*value) for value in frozen)
    for value in (complex(*pair) for pair in frozen):
        nearest = min(left, key=lambda one, value=value: abs(one - value))
        left.remove(nearest)
        error = abs(nearest - value)
        assert error <= tolerance, f"{place}: {nearest} is not {value}: off by {error:.2e} > {tolerance:.2e}"
