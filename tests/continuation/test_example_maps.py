"""Pseudo-arclength continuation on maps whose bifurcations are known in closed form."""

import math
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import attrs
import numpy as np
import pytest

from gaitopt.continuation import location
from gaitopt.continuation.following import BranchFollower
from gaitopt.continuation.map_family import MapSample
from gaitopt.continuation.pseudo_arclength import ArclengthOptions, CurvePoint, Stepper
from gaitopt.continuation.special_point import SpecialKind, SpecialPoint, merge_changes, merge_folds
from gaitopt.continuation.switching import has_half_period, switch_branch
from gaitopt.continuation.tracing import drop_spurious
from gaitopt.continuation.value_slope import differentiate_by_value
from tests.continuation.map_examples import ExampleFamily

OPTIONS = ArclengthOptions(longest_step=0.1)


def follow(family, z, value, ends, options=OPTIONS, direction=1.0):
    """Return points, special points and the reason for the end of the branch from a start."""
    stepper = Stepper(family, options)
    start = stepper.initialise(np.atleast_1d(np.array(z, dtype=float)), value, direction)
    return collect(stepper, start, ends)


def collect(stepper, start, ends):
    follower = BranchFollower(stepper, ends, str)
    items = list(follower.follow(start))
    points = [item for item in items if isinstance(item, CurvePoint)]
    return points, [item for item in items if isinstance(item, SpecialPoint)], follower.end


def test_a_branch_is_followed_around_its_folds():
    # x -> x + value - x^3 + x has fixed points value = x^3 - x with folds at x = +-1/sqrt(3).
    family = ExampleFamily(lambda z, a: z + a - z**3 + z, 1)
    points, special, end = follow(family, [-1.6], (-1.6) ** 3 + 1.6, (-3, 3))
    assert end == "range_end"
    assert points[-1].value == pytest.approx(3, abs=1e-12)
    assert points[-1].z[0] ** 3 - points[-1].z[0] == pytest.approx(3, abs=1e-9)
    folds = [point for point in special if point.kind.key == "fold"]
    expected = 2 / (3 * math.sqrt(3))
    assert [fold.value for fold in folds] == pytest.approx([expected, -expected], abs=1e-10)
    assert [fold.z[0] for fold in folds] == pytest.approx([-1 / math.sqrt(3), 1 / math.sqrt(3)], abs=1e-6)
    assert all(abs(fold.multipliers_before[0] - 1) < 1e-6 for fold in folds)


class GrazingFamily(ExampleFamily):
    """The normal form z -> value - sqrt(z) of a grazing contact, with rounding errors in proportion to its slope."""

    def evaluate(self, z, value):
        if z[0] <= 0:
            return MapSample(None, "diverged")
        noise = 1e-12 / math.sqrt(z[0]) * math.sin(1e17 * z[0])
        return MapSample(np.array([value - math.sqrt(z[0]) - z[0] + noise]), "", [z, z])

    def derivative(self, z, value, sample, by_value=None):
        return np.array([[-0.5 / math.sqrt(z[0]) - 1, 1.0]])


def test_a_branch_ends_where_rounding_errors_decide_its_direction():
    points, special, end = follow(GrazingFamily(None, 1), [1.0], 2.0, (-1, 3), direction=-1.0)
    *_, last = special
    assert (last.kind.key, end) == ("unbounded_multiplier", "unbounded_multiplier")
    assert last.value == pytest.approx(0, abs=1e-3)
    assert 1e4 <= abs(points[-1].multipliers[0]) < 1e6
    assert last.after.startswith("a multiplier of ")
    assert len(points) < 150


def test_an_imperfect_branch_point_is_abandoned_early(monkeypatch):
    """Fixed points z^2 - a z = 1e-8: two branches pass each other at a distance of 2e-4."""
    family, calls = ExampleFamily(lambda z, a: z + a * z - z**2 + 1e-8, 1), []
    between = location.point_between
    monkeypatch.setattr(location, "point_between", lambda *each: calls.append(each) or between(*each))
    works = []
    stepper = Stepper(family, ArclengthOptions(longest_step=0.06, first_step=0.06))
    start = stepper.initialise(np.array([4e-8]), -0.25, 1.0)
    follower = BranchFollower(stepper, (-0.25, 0.25), str, work_observer=works.append)
    items = list(follower.follow(start))
    assert not [item for item in items if isinstance(item, SpecialPoint)]
    assert follower.end == "range_end"
    assert items[-1].z[0] == pytest.approx(-4e-8, abs=1e-9)  # on the other branch
    assert 1 < len(calls) < 15  # 42 if the discontinuity is bisected
    assert "locating a special point (branch point)" in [work.name for work in works]
    lengths = [work.arclength for work in works]
    assert lengths == sorted(lengths)
    assert lengths[-1] == pytest.approx(0.5, abs=0.07)


def test_folds_that_coincide_are_one_fold():
    none = np.array([])
    fold = SpecialPoint(
        kind=SpecialKind.FOLD,
        value=0.5,
        width=1e-12,
        z=np.zeros(1),
        before="a",
        after="a",
        multipliers_before=none,
        multipliers_after=none,
    )
    beside, far = replace(fold, value=0.5 + 1e-11), replace(fold, z=np.ones(1))
    merge = partial(merge_folds, width=1e-10, scale=np.ones(1))
    assert [len(merge(folds)) for folds in ([fold, beside], [fold, beside, fold], [fold, far])] == [0, 1, 2]


def test_the_period_doubling_cascade_of_the_logistic_map():
    # First doublings at 3 and 1 + sqrt(6); the next values from Briggs (1991), A precise calculation of the
    # Feigenbaum constants, Math. Comp. 57: 3.5440903596, 3.5644072661, 3.5687594195.
    expected = [3.0, 1 + math.sqrt(6), 3.5440903596, 3.5644072661, 3.5687594195]
    family, options = ExampleFamily(lambda z, a: a * z * (1 - z), 1), OPTIONS
    stepper = Stepper(family, options)
    point = stepper.initialise(np.array([0.5]), 2.0, 1.0)
    found = []
    for _ in expected:
        _, special, _ = collect(stepper, point, (2, 3.6))
        doubling = next(each for each in special if each.kind.key == "period_doubling")
        found.append(doubling.value)
        options = attrs.evolve(options, first_step=0.4 * options.first_step, longest_step=0.4 * options.longest_step)
        family = family.double_period()
        stepper, point = switch_branch(family, doubling, options)
    assert found == pytest.approx(expected, abs=2e-10)
    gaps = np.diff(found)
    assert gaps[-2] / gaps[-1] == pytest.approx(4.669, abs=2e-3)


def test_a_short_doubled_branch_far_along_a_cascade_is_not_passed_by():
    # The branch of period 32 is stable from 3.5687594195 to 3.5696916098 (Briggs 1991); a point of it at the distance
    # of the first branches from the doubling lies beyond.  The differences of the example limit the accuracy.
    family, options, reduction = ExampleFamily(lambda z, a: a * z * (1 - z), 1), OPTIONS, 1.0
    stepper = Stepper(family, options)
    point = stepper.initialise(np.array([0.5]), 2.0, 1.0)
    for _ in range(6):
        _, special, _ = collect(stepper, point, (2, 3.6))
        doubling = next(each for each in special if each.kind.key == "period_doubling")
        options = attrs.evolve(options, first_step=0.4 * options.first_step, longest_step=0.4 * options.longest_step)
        family = family.double_period()
        stepper, point = switch_branch(family, doubling, options, reduction=reduction)
        reduction *= 0.4
    assert doubling.value == pytest.approx(3.5696916098, abs=5e-8)


def test_a_point_of_the_original_branch_is_not_taken_for_one_of_the_doubled_branch():
    # u -> -(1 + a) u - u^3 about u = z - 500 a doubles its period at a = 0.  The line z = 0.001 contains the fixed
    # point u = 0, at a = 2e-6, but no point of the doubled branch, u^2 = -a.
    def function(z, a):
        u = z - 500 * a
        return 500 * a - (1 + a) * u - u**3

    family = ExampleFamily(function, 1)
    _, special, _ = follow(family, [-0.5], -1e-3, (-1e-3, 1e-3))
    (doubling,) = special
    assert doubling.value == pytest.approx(0, abs=1e-9)
    _, point = switch_branch(family.double_period(), doubling, OPTIONS)
    u = point.orbit[:, 0] - 500 * point.value
    assert u[0] * u[1] < 0
    assert -point.value == pytest.approx(u[0] ** 2, rel=1e-2)


def test_neimark_sacker_point_of_the_delayed_logistic_map():
    # x_{n+1} = a x_n (1 - x_{n-1}) loses stability at a = 2 with multipliers exp(+-i pi/3) (Kuznetsov 2004, ch. 4).
    family = ExampleFamily(lambda z, a: np.array([a * z[0] * (1 - z[1]), z[0]]), 2)
    points, special, _ = follow(family, [1 / 3, 1 / 3], 1.5, (1.5, 2.2))
    (point,) = special
    assert point.kind.key == "neimark_sacker"
    assert point.value == pytest.approx(2, abs=1e-9)
    assert np.sort_complex(point.multipliers_before) == pytest.approx(
        np.exp(np.array([-1, 1]) * 1j * math.pi / 3), abs=1e-7
    )
    assert points[0].unstable == 0
    assert points[-1].unstable == 2


def test_a_crossing_branch_is_located_and_switched_to():
    # x -> x + a x - x^3: the branch x = 0 crosses a = x^2 at a = 0.
    family = ExampleFamily(lambda z, a: z + a * z - z**3, 1)
    _, special, _ = follow(family, [0.0], -0.5, (-0.5, 0.5))
    (crossing,) = special
    assert crossing.kind.key == "branch_point"
    assert crossing.value == pytest.approx(0, abs=1e-9)
    stepper, point = switch_branch(family, crossing, OPTIONS)
    points, _, end = collect(stepper, point, (-0.5, 0.5))
    assert end == "range_end"
    assert points[-1].z[0] == pytest.approx(math.sqrt(0.5), abs=1e-9)


def border(slopes):
    """Return a map that is linear on both sides of z = 0: z -> slope z + value."""

    def piece(z, value):
        return "left" if z[0] < 0 else "right"

    def function(z, value):
        return slopes[0] * z + value if z[0] < 0 else slopes[1] * z + value

    return ExampleFamily(function, 1, piece=piece)


def test_a_branch_continues_through_a_kink():
    # z = value / (1 - slope) on both sides: persistence for slopes 0.5 and -0.5.
    points, special, end = follow(border((0.5, -0.5)), [-2.0], -1.0, (-1, 1))
    (change,) = special
    assert end == "range_end"
    assert change.value == pytest.approx(0, abs=1e-10)
    assert change.width <= 1e-10
    assert (change.multipliers_before[0].real, change.multipliers_after[0].real) == pytest.approx((0.5, -0.5), abs=1e-6)
    assert points[-1].z[0] == pytest.approx(1 / 1.5, abs=1e-9)


def test_a_branch_turns_back_at_a_kink_where_two_gaits_annihilate():
    # Slopes 0.5 and 1.5: both fixed points, value / 0.5 < 0 and -value / 0.5 > 0, exist for negative values only.
    points, special, end = follow(border((0.5, 1.5)), [-2.0], -1.0, (-1, 1))
    (change,) = special
    assert change.value == pytest.approx(0, abs=1e-9)
    assert end == "range_end"
    assert points[-1].value == pytest.approx(-1, abs=1e-12)
    assert points[-1].z[0] == pytest.approx(2, abs=1e-8)
    assert (change.multipliers_before[0].real, change.multipliers_after[0].real) == pytest.approx((0.5, 1.5), abs=1e-6)


def test_the_end_of_a_map_is_the_end_of_the_branch():
    # Fixed point z = value / 0.5; the map is not defined for z > 1.
    family = ExampleFamily(lambda z, a: 0.5 * z + a if z[0] <= 1 else z * np.nan, 1)
    points, special, end = follow(family, [0.0], 0.0, (0, 2))
    *_, last = special
    assert last.kind.key == "end"
    assert last.after == "diverged"
    assert end == "diverged"
    assert last.value == pytest.approx(0.5, abs=1e-8)
    assert points[-1].value <= 0.5


def test_points_lie_on_the_branch_and_tangents_are_tangents():
    family = ExampleFamily(lambda z, a: z + a - z**3 + z, 1)
    points, _, _ = follow(family, [-1.6], (-1.6) ** 3 + 1.6, (-3, 3))
    for point in points:
        assert point.value == pytest.approx(point.z[0] ** 3 - point.z[0], abs=1e-9)
        slope = 3 * point.z[0] ** 2 - 1
        assert point.tangent[1] == pytest.approx(slope * point.tangent[0], abs=1e-6)


def test_steps_grow_although_rounding_errors_are_large():
    # Multiplier 300, and a residual that is known to 2e-10 only, as after many steps of an unstable gait.
    def noisy(z, a):
        deviation = z - np.sin(a)
        return z + 299 * deviation + 30000 * deviation**2 + 2e-10 * np.sin(1e9 * z)

    family = ExampleFamily(noisy, 1)
    options = attrs.evolve(OPTIONS, first_step=1e-3)
    points, _, end = follow(family, [math.sin(-1.0)], -1.0, (-1, 1), options)
    assert end == "range_end"
    assert [point.z[0] for point in points] == pytest.approx([math.sin(point.value) for point in points], abs=1e-12)
    assert len(points) < 45
    assert max(point.iterations for point in points) <= 3  # not those that only confirm the rounding errors


def test_newtons_method_may_reach_the_tolerance_in_its_last_iteration():
    class Inaccurate(ExampleFamily):
        def derivative(self, z, value, sample, by_value=None):
            return np.array([[-1.0, 1.0]]) / 1.1  # each iteration leaves a tenth of the error

    stepper = Stepper(Inaccurate(lambda z, a: a + 0 * z, 1), OPTIONS)
    point = stepper.initialise(np.array([0.505]), 0.5, 1.0)
    assert point.iterations == OPTIONS.most_iterations
    assert point.z[0] == pytest.approx(0.5, abs=OPTIONS.tolerance)


def test_the_derivative_by_the_parameter_is_accurate_for_sensitive_maps():
    family = ExampleFamily(lambda z, a: np.sin(1e3 * (a + z)), 1, value_scale=100.0)
    z, value = np.array([math.pi / 10 - 0.1]), 0.1
    sample, by_z = family.evaluate(z, value), np.array([[1e3]])  # the cosine is 1
    slope = differentiate_by_value(family, z, value, sample, by_z, 1e-6)
    assert slope == pytest.approx(by_z[0], rel=1e-9)  # 1.7e-5 without extrapolation


def test_a_doubled_branch_joins_the_branch_of_half_its_period_again():
    # The logistic map at 3.2 - value^2 doubles its period at value^2 = 0.2, on both sides of 0.
    family = ExampleFamily(lambda z, a: (3.2 - a**2) * z * (1 - z), 1)
    _, special, _ = follow(family, [1 - 1 / (3.2 - 0.36)], -0.6, (-0.6, 0.0))
    (doubling,) = special
    stepper, start = switch_branch(family.double_period(), doubling, OPTIONS)
    points = list[CurvePoint]()
    for item in BranchFollower(stepper, (-0.6, 0.6), str).follow(start):
        if isinstance(item, SpecialPoint):
            break
        points.append(item)
    assert item.kind.key == "fold"
    assert item.value == pytest.approx(math.sqrt(0.2), abs=1e-6)
    assert has_half_period(points[-1].orbit, np.ones(1))
    assert not has_half_period(points[len(points) // 2].orbit, np.ones(1))
    assert not has_half_period(np.zeros((3, 1)), np.ones(1))


class StoppedFamily(ExampleFamily):
    """A map that is not defined above 0.5, where a step stops for a given reason."""

    reason = ""

    def evaluate(self, z, value):
        return MapSample(None, self.reason) if value > 0.5 else super().evaluate(z, value)


@pytest.mark.parametrize(
    ("reason", "key", "label"),
    [
        ("no_touchdown", "no_touchdown", "no touchdown"),
        ("fell", "roll_over", "fall"),  # with kinetic energy: not the limit of rolling over
        ("lift_off", "lift_off", "lift off"),
        ("too_many_events", "end", "end"),
    ],
)
def test_the_end_of_a_branch_is_named_by_the_reason_for_which_steps_beyond_it_stop(reason, key, label):
    family = StoppedFamily(lambda z, a: 0.5 * z + a, 1)
    family.reason = reason
    _, (special,), end = follow(family, [0.4], 0.2, (0.2, 1))
    assert (special.kind.key, special.label, special.after) == (key, label, reason)
    assert special.value == pytest.approx(0.5, abs=1e-6)
    assert end == (reason if key == "end" else key)


def test_a_sequence_that_exists_only_within_rounding_errors_is_no_change():
    def change(value, before, after):
        none = np.array([0.5 + 0j])
        kind = SpecialKind.IMPACT_CONE
        sides = {"multipliers_before": none, "multipliers_after": none}
        return SpecialPoint(kind=kind, value=value, width=0.0, z=none.real, before=before, after=after, **sides)

    chattering = [change(0.1, "a", "b"), change(0.1 + 1e-12, "b", "a"), change(0.1 + 2e-12, "a", "c")]
    (merged,) = merge_changes(chattering, 1e-9, lambda one, other: SpecialKind.IMPACT_CONE)
    assert (merged.before, merged.after) == ("a", "c")
    apart = [change(0.1, "a", "b"), change(0.2, "b", "a")]
    assert merge_changes(apart, 1e-9, lambda one, other: SpecialKind.IMPACT_CONE) == apart


def test_points_of_a_sequence_within_rounding_errors_are_dropped():
    none = {"width": 0.0, "z": np.zeros(1), "multipliers_before": np.ones(1), "multipliers_after": np.ones(1)}
    kind = SpecialKind.IMPACT_CONE
    changes = [
        SpecialPoint(kind=kind, value=0.1, before="a", after="b", **none),
        SpecialPoint(kind=kind, value=0.1 + 1e-12, before="b", after="a", **none),
    ]
    points = [
        SimpleNamespace(value=value, sample=SimpleNamespace(structure=name))
        for value, name in ((0.05, "a"), (0.1, "a"), (0.1 + 1e-12, "b"), (0.15, "a"))
    ]
    merged = merge_changes(changes, 1e-9, lambda one, other: kind)
    assert merged == []
    assert [point.value for point in drop_spurious(points, changes, merged, 1e-9)] == [0.05, 0.1, 0.15]
