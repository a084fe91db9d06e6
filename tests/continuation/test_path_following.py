"""Continuation of optimality conditions: small problems whose solutions are known in closed form."""

import math
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from gaitopt.continuation import location
from gaitopt.continuation.optimal.kkt_correction import Metric, at_value, correct, find_tangent
from gaitopt.continuation.optimal.kkt_point import ActiveSet, KktPoint
from gaitopt.continuation.optimal.parametric_nlp import Line, ParametricNlp
from gaitopt.continuation.optimal.path_following import PathFollower
from gaitopt.continuation.optimal.path_items import PathChange, PathKind, PathOptions, PathPoint
from gaitopt.ocp.nlp.block import Block
from gaitopt.ocp.nlp.nlp import assemble_nlp
from gaitopt.ocp.nlp.optimality_system import OptimalitySystem

INF = math.inf


def make_nlp(n, cost, rows, upper, ends, *, smooth=True):
    """Return min cost(x, s) subject to rows(x, s) <= upper, as an NLP over s."""
    x, s = ca.SX.sym("x", n), ca.SX.sym("s", 1)
    constraints = ca.vertcat(*rows(x, s))
    m = constraints.numel()
    columns, places = np.arange(n)[:, None], np.arange(m)[:, None]
    block = Block(
        name="closed_form", variables=x, cost=cost(x, s), constraints=constraints, columns=columns, rows=places
    )
    nlp = assemble_nlp([block], s, n, m, smooth=smooth)
    none = np.zeros(n + m)
    return ParametricNlp(
        problem=None,
        number=None,
        ends=ends,
        method=None,
        transcription=SimpleNamespace(variables=SimpleNamespace(size=n), nlp=nlp, sign_changes=None),
        system=OptimalitySystem(nlp),
        sizes=np.ones(n),
        data=Line(origin=np.zeros(1), slope=np.ones(1)),
        lower=Line(origin=np.full(n + m, -INF), slope=none),
        upper=Line(origin=np.array([*upper], dtype=float), slope=none),
    )


def follow(nlp, x, active=(), direction=1.0, samples=5):
    """Return the items of the curve from the first end of the range, and the reason for its end."""
    sides = np.zeros(nlp.upper.origin.size, dtype=np.int8)
    sides[list(active)] = 1
    start = KktPoint(np.array(x, dtype=float), np.zeros(sides.size - nlp.size), nlp.ends[0])
    here = correct(nlp, start, ActiveSet(sides, np.zeros(sides.size, dtype=bool), nlp.size), at_value(nlp.ends[0]))
    follower = PathFollower(nlp, PathOptions(), np.linspace(*nlp.ends, samples))
    return list(follower.follow(here, direction)), follower.end


def changes_of(items):
    return [(item.kind, item.index, item.optimum.point.value) for item in items if isinstance(item, PathChange)]


def test_a_curve_turns_where_the_reduced_hessian_is_singular():
    # min x^3 / 3 - s x has the minimum x = sqrt(s) and the maximum x = -sqrt(s), which meet at s = 0.
    nlp = make_nlp(1, lambda x, s: x**3 / 3 - s * x, lambda x, s: [x], [INF, INF], (1.0, -1.0))
    items, end = follow(nlp, [1.1], direction=-1.0)
    ((kind, _, value),) = changes_of(items)
    assert kind is PathKind.TURNING_POINT
    assert abs(value) < 1e-10
    assert end == "range_end"
    points = [item for item in items if isinstance(item, PathPoint)]
    assert points[-1].optimum.point.x[0] == pytest.approx(-1.0, abs=1e-9)
    for item in points:
        x = item.optimum.point.x[0]
        assert x**2 == pytest.approx(item.value, abs=1e-9)
        assert item.optimum.negative == (x < 0)


def test_a_constraint_becomes_active_and_inactive_at_exact_values():
    # The free minimum 2 s - s^2 exceeds 0.75 between s = 0.5 and s = 1.5.
    nlp = make_nlp(1, lambda x, s: (x - (2 * s - s**2)) ** 2 / 2, lambda x, s: [x], [INF, 0.75], (0.0, 2.0))
    items, end = follow(nlp, [0.0])
    assert end == "range_end"
    kinds, indices, values = zip(*changes_of(items), strict=True)
    assert kinds == (PathKind.ACTIVATION, PathKind.DEACTIVATION)
    assert set(indices) == {1}
    assert values == pytest.approx([0.5, 1.5], abs=1e-10)
    assert all(item.width < 1e-10 for item in items if isinstance(item, PathChange))


@pytest.mark.parametrize("excess", [1e-3, 1e-6])
@pytest.mark.parametrize("samples", [2, 5, 81])
def test_a_constraint_that_is_active_over_less_than_a_step_does_not_turn_the_curve_back(excess, samples):
    # The bound 1 - excess of the free minimum 2 s - s^2 is active between s = 1 -+ sqrt(excess).
    bound, half = 1 - excess, math.sqrt(excess)
    nlp = make_nlp(1, lambda x, s: (x - (2 * s - s**2)) ** 2 / 2, lambda x, s: [x], [INF, bound], (0.0, 2.0))
    items, end = follow(nlp, [0.0], samples=samples)
    kinds, _, values = zip(*changes_of(items), strict=True)
    assert kinds == (PathKind.ACTIVATION, PathKind.DEACTIVATION)
    assert values == pytest.approx([1 - half, 1 + half], abs=1e-10)
    assert (items[-1].value, end) == (2.0, "range_end")


@pytest.mark.parametrize("smooth", [True, False])
def test_a_change_at_the_end_of_the_range_does_not_lead_back(smooth):
    """The curve of an objective with kinks continues from a solve beyond each change."""
    nlp = make_nlp(
        1, lambda x, s: (x - (2 * s - s**2)) ** 2 / 2, lambda x, s: [x], [INF, 0.75], (0.0, 0.5), smooth=smooth
    )
    items, end = follow(nlp, [0.0])
    assert end == "range_end"
    assert np.all(np.diff([item.value for item in items if isinstance(item, PathPoint)]) >= 0)


def test_a_bound_of_an_unknown_is_a_constraint_like_a_row():
    nlp = make_nlp(1, lambda x, s: (x - (2 * s - s**2)) ** 2 / 2, lambda x, s: [x], [0.75, INF], (0.0, 2.0))
    items, _ = follow(nlp, [0.0])
    assert [index for _, index, _ in changes_of(items)] == [0, 0]
    assert [value for *_, value in changes_of(items)] == pytest.approx([0.5, 1.5], abs=1e-10)
    sampled = [item.value for item in items if isinstance(item, PathPoint) and item.sampled]
    assert set(np.linspace(0, 2, 5)) <= set(sampled)


def test_samples_that_a_step_passes_are_interpolated_and_corrected():
    # As above with the bound 0.99, which is active between 0.9 and 1.1.
    nlp = make_nlp(1, lambda x, s: (x - (2 * s - s**2)) ** 2 / 2, lambda x, s: [x], [INF, 0.99], (0.0, 2.0))
    items, _ = follow(nlp, [0.0], samples=81)
    assert [value for *_, value in changes_of(items)] == pytest.approx([0.9, 1.1], abs=1e-10)
    points = [item for item in items if isinstance(item, PathPoint)]
    values = np.array([item.value for item in points])
    assert set(np.linspace(0, 2, 81)) <= set(values)
    assert np.all(np.diff(values) >= 0)
    expected = np.minimum(2 * values - values**2, 0.99)
    assert [item.optimum.point.x[0] for item in points] == pytest.approx(expected, abs=1e-11)
    assert not any(item.optimum.negative for item in points)
    assert len({id(item.tangent) for item in points}) < 50  # tangents of steps, not of samples


def test_a_constraint_at_a_vertex_replaces_another_one():
    # The projection of (2, 1) on x <= 1, y <= 1/2, x + y <= 3 - s: at s = 3/2 the third replaces the second constraint,
    # whose multiplier 1/2 is the smaller one, and at s = 2 the multiplier 2 - s of the first one vanishes.
    nlp = make_nlp(
        2,
        lambda x, s: ca.sumsqr(x - ca.DM([2, 1])) / 2,
        lambda x, s: [x[0], x[1], x[0] + x[1] + s],
        [INF, INF, 1.0, 0.5, 3.0],
        (1.0, 2.5),
    )
    items, end = follow(nlp, [1.0, 0.5], active=(2, 3))
    kinds, indices, values = zip(*changes_of(items), strict=True)
    assert kinds == (PathKind.ACTIVATION, PathKind.DEACTIVATION, PathKind.DEACTIVATION)
    assert indices == (4, 3, 2)
    assert values == pytest.approx([1.5, 1.5, 2.0], abs=1e-10)
    assert end == "range_end"
    last = items[-1].optimum
    assert last.point.x == pytest.approx([0.75, -0.25], abs=1e-9)
    assert last.margins.min() > 0


def test_a_curve_ends_where_the_constraints_exclude_each_other():
    # The least x^2 + y^2 with x + y >= s, x <= 1, y <= 1/2, which exclude each other beyond s = 3/2.
    nlp = make_nlp(2, lambda x, s: ca.sumsqr(x) / 2, lambda x, s: [s - x[0] - x[1]], [1.0, 0.5, 0.0], (0.5, 2.0))
    items, end = follow(nlp, [0.25, 0.25], active=(2,))
    assert end == "feasibility_limit"
    assert [index for _, index, _ in changes_of(items)] == [1, 0]
    assert [value for *_, value in changes_of(items)] == pytest.approx([1.0, 1.5], abs=1e-9)


def test_dependent_rows_are_counted():
    nlp = make_nlp(
        2,
        lambda x, s: ca.sumsqr(x) / 2,
        lambda x, s: [s - x[0] - x[1], 2 * s - 2 * (x[0] + x[1])],
        [INF, INF, 0, 0],
        (0.5, 1),
    )
    one, two = (follow(nlp, [0.25, 0.25], active=active)[0][0].optimum for active in ((2,), (2, 3)))
    assert (one.dependent, two.dependent) == (0, 1)


def test_the_tangent_keeps_its_direction_near_a_turning_point():
    nlp = make_nlp(1, lambda x, s: x**3 / 3 - s * x, lambda x, s: [x], [INF, INF], (1.0, -1.0))
    sides, equal = np.zeros(2, dtype=np.int8), np.zeros(2, dtype=bool)
    here = correct(nlp, KktPoint(np.array([1e-5]), np.zeros(1), 1e-10), ActiveSet(sides, equal, 1), at_value(1e-10))
    packed, last = find_tangent(here, Metric(nlp), (np.array([-1.0]), 0.0))
    assert packed[0] < 0
    assert last / packed[0] == pytest.approx(2e-5, rel=1e-6)  # ds / dx = 2 x


def test_middle_points_that_do_not_come_closer_end_the_location_of_a_change(monkeypatch):
    """Middle points on another branch stay at their distance; the interval that is left is not divided without end."""
    left, right = (SimpleNamespace(value=value, sample=SimpleNamespace(structure=value)) for value in (0.0, 1.0))
    far, asked = SimpleNamespace(value=0.5, sample=left.sample), []

    def find_far_point(stepper, one, other, share):
        asked.append(share)
        return far

    monkeypatch.setattr(location, "point_between", find_far_point)
    stepper = SimpleNamespace(position=lambda point: np.array([point.value, 5.0 * (point is far)]))
    distances = []
    assert location.structure_brackets(stepper, left, right, distances.append) == [(far, right)]
    assert distances[0] == 1.0
    assert len(distances) == len(asked) + 1  # the last interval is not divided
    assert len(asked) <= 1 + location.MOST_BISECTIONS / location.STALL
