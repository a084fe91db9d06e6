"""Branches of gaits against published values, closed forms and finite differences."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest

from gaitopt import InputError, WalkProblem, compass_biped, find_cycles, load_diagram, rimless_wheel, trace
from gaitopt.continuation import (
    ArclengthOptions,
    SpecialKind,
    SpecialPoint,
    TraceOptions,
    gaits_at,
    roll_over,
    save_diagram,
)
from gaitopt.continuation.gait_family import make_gait_family
from gaitopt.errors import ArchiveError
from tests.continuation.rolling_wheel import least_friction, least_slope
from tests.docs.checked_commands import run_trace
from tests.references.storage import reference

SLOPE = math.radians(13)
GOSWAMI = {"leg_mass": 5, "hip_mass": 10, "leg_length": 1, "leg_com": 0.5, "gravity": 9.81}


@pytest.fixture(scope="module")
def wheel():
    return WalkProblem(robot=rimless_wheel(), parameters={"slope": SLOPE})


@pytest.fixture(scope="module")
def wheel_diagram(wheel):
    return trace(wheel, {"friction": (1.0, 0.05)})


@pytest.fixture(scope="module")
def compass():
    return WalkProblem(robot=compass_biped(), parameters={"slope": math.radians(1)})


@pytest.fixture(scope="module")
def compass_diagram(tmp_path_factory):
    return run_trace("gaitopt trace problems/compass_passive.py --over friction", tmp_path_factory.mktemp("trace"))


@pytest.fixture(scope="module")
def cascade():
    problem = WalkProblem(robot=compass_biped(), parameters=GOSWAMI | {"friction": math.inf})
    ends = (math.radians(3), math.radians(5.2))
    return trace(problem, {"slope": ends}, options=TraceOptions(doublings=5))


def values_of(branch, kind):
    return [point.value for point in branch.special_of(kind)]


def test_an_observer_sees_the_side_that_was_followed_first_too(wheel):
    wheel = WalkProblem(robot=wheel.robot, parameters={"slope": SLOPE, "friction": 1.0})
    (start,) = find_cycles(wheel.robot, wheel.parameters, starts=1)
    seen = []
    diagram = trace(wheel, {"friction": (0.98, 1.02)}, start=start, observer=seen.append)
    sizes = [branch.values.size for branch in seen]
    assert sizes == sorted(sizes)
    assert np.array_equal(seen[-1].values, diagram.branches[0].values)


def test_a_branch_follows_the_closed_form():
    # McGeer's wheel: thd*^2 = beta^2 (thd*^2 + 4 g sin(pi/n) sin(alpha) / (l (1 + kappa))), energy over a step.
    wheel = WalkProblem(robot=rimless_wheel(), parameters={"slope": SLOPE, "friction": math.inf})
    branch = trace(wheel, {"slope": (SLOPE, math.radians(7))}).branches[0]
    kappa = 1 / 3
    beta = (math.cos(math.pi / 5) + kappa) / (1 + kappa)
    gained = 4 * 9.8 * math.sin(math.pi / 10) * np.sin(branch.values) / (1 + kappa)
    expected = np.sqrt(beta**2 * gained / (1 - beta**2))
    assert branch.names == ("theta_rate",)
    assert branch.states[:, 0] == pytest.approx(expected, rel=1e-9)
    assert branch.multipliers[:, 0].real == pytest.approx(np.full(branch.values.size, beta**2), abs=1e-8)


def test_a_branch_ends_where_the_wheel_no_longer_rolls_over():
    wheel = WalkProblem(robot=rimless_wheel(), parameters={"slope": SLOPE, "friction": math.inf})
    branch = trace(wheel, {"slope": (SLOPE, math.radians(1))}).branches[0]
    (end,) = branch.special
    assert (end.kind.key, end.after, branch.end) == ("roll_over", "fell", "roll_over")
    assert end.label == "limit of rolling over"
    exact = least_slope()
    assert end.value == pytest.approx(exact, abs=1e-12)
    assert abs(end.value - exact) <= end.width + 1e-14
    # The rate after the impact is that with which the wheel just reaches its apex.
    assert end.z[0] ** 2 == pytest.approx(2 * 9.8 / (4 / 3) * (1 - math.cos(math.pi / 10 - exact)), rel=1e-10)


def test_the_width_of_the_end_covers_errors_of_the_integrator(monkeypatch):
    """Gaits at four distances from the end, with errors of the energies as large as those of scipy."""
    random, distances = np.random.default_rng(3), 1e-4 * np.arange(4, 0, -1)
    places, energies = [np.array([1 + x, x]) for x in distances], 19.5 * distances + 2 * distances**2
    stepper = SimpleNamespace(family=SimpleNamespace(line=None, value_scale=1.0), scales=np.ones(2), position=np.array)
    end = SpecialPoint(
        kind=SpecialKind.ROLL_OVER, value=0.0, width=0.0, z=np.ones(1), before="", after="",
        multipliers_before=np.ones(1), multipliers_after=np.ones(0),
    )  # fmt: skip
    located = []
    for _ in range(100):
        measured = list(energies * (1 + random.normal(scale=3e-9, size=4)))
        monkeypatch.setattr(roll_over, "_sample", lambda *_, energies=measured: (energies, places))
        located.append(roll_over.locate_roll_over(stepper, [1.0, 0.0], end))
    assert np.median([abs(each.value) for each in located]) < np.median([each.width for each in located])


@pytest.mark.slow
def test_special_points_of_the_wheel(wheel_diagram):
    branch = wheel_diagram.branches[0]
    # The greatest force ratio of the sticking gait is 0.914121; the others are in tests/references/rimless_wheel.py.
    onset, first_slip = values_of(branch, "slip_onset")
    assert onset == pytest.approx(0.9141207839, abs=1e-8)
    least = reference("rimless_wheel", "ranges")["type_b_least_without_first_slip"]
    assert first_slip == pytest.approx(least, abs=1e-8)
    assert values_of(branch, "impact_cone") == pytest.approx([0.245052], abs=5e-7)  # Gamus & Or (2015): 0.2450
    assert values_of(branch, "loss_of_stick") == pytest.approx([math.tan(SLOPE)], abs=1e-8)
    assert branch.end == "loss_of_stick"
    widths = [point.width for point in branch.special]
    assert max(widths) <= 1e-9


def test_the_multipliers_jump_where_the_impulse_touches_the_cone(wheel_diagram):
    (point,) = wheel_diagram.branches[0].special_of("impact_cone")
    before, after = np.abs(point.multipliers_before).max(), np.abs(point.multipliers_after).max()
    assert (before, after) == pytest.approx((0.76746, 0.77233), abs=1e-5)  # problems/studies/rimless_branches.py


def test_complete_slip_is_followed_as_a_branch_of_its_own(wheel_diagram):
    branch = wheel_diagram.branches[1]
    assert set(branch.sequences) == {"slip+ | slip+"}
    assert values_of(branch, "drift_reversal") == pytest.approx([math.tan(SLOPE)], abs=1e-8)
    assert (branch.begin, branch.end) == ("lift_off", "roll_over")
    assert values_of(branch, "lift_off")[0] == pytest.approx(0.32, abs=5e-3)  # Gamus & Or (2015)
    (rolls,) = values_of(branch, "roll_over")
    assert rolls == pytest.approx(least_friction(), abs=1e-12)
    # The variational equations are singular where the wheel just rolls over: no multiplier is taken from there.
    assert np.all((branch.radii > 0.3) & (branch.radii < 0.4))
    assert branch.special_of("roll_over")[0].multipliers_before[0].real == pytest.approx(branch.radii[-1], abs=1e-12)


@pytest.mark.slow
def test_special_points_of_gait_b(compass_diagram):
    # The study and its reproduction: docs/reproduction.md.
    branch = compass_diagram.branches[0]
    assert values_of(branch, "slip_onset") == pytest.approx([0.17492, 0.1731], abs=5e-5)
    assert values_of(branch, "neimark_sacker") == pytest.approx([0.1103], abs=5e-5)
    assert values_of(branch, "impact_cone") == pytest.approx([0.0698], abs=5e-5)
    assert np.all(np.diff(branch.values) < 1e-9)
    (onset, _), critical = (
        branch.special_of("slip_onset"),
        find_cycles(compass_biped(), {"slope": math.radians(1)}, starts=10)[0].critical_friction,
    )
    assert onset.value == pytest.approx(critical.friction, abs=1e-9)


@pytest.mark.slow
def test_gait_c_joins_the_second_sticking_gait(compass):
    start = next(
        gait
        for gait in find_cycles(compass_biped(), {"slope": math.radians(1), "friction": 0.2})
        if gait.sequence == "slip+ stick | slip+"
    )
    branch = trace(compass, {"friction": (0.2, 0.33)}, start=start).branches[0]
    (point,) = branch.special
    assert (point.kind.key, point.after) == ("impact_cone", "stick | stick")
    assert point.value == pytest.approx(0.3044, abs=5e-5)
    assert branch.states[-1][:-1] == pytest.approx(point.z[:-1], abs=1e-8)  # a gait that sticks ignores friction


@pytest.mark.slow
def test_multipliers_agree_with_finite_differences(compass, compass_diagram):
    branch = compass_diagram.branches[0]
    start = gaits_at(compass, compass_diagram, 0.14)[0]
    family = make_gait_family(compass.robot, start, "friction", (0.33, 0.06))
    checked = 0
    for k in np.random.default_rng(3).permutation(branch.values.size):
        z, value, h = branch.states[k], branch.values[k], 2e-7
        sample = family.evaluate(z, value)
        if any(abs(point.value - value) < 1e-5 for point in branch.special):
            continue
        columns = []
        for j in range(3):  # the foot speed is 0 after a sticking touchdown
            step = h * np.eye(4)[j]
            ends = [family.evaluate(z + sign * step, value).residual + sign * step for sign in (1, -1)]
            columns.append((ends[0] - ends[1]) / (2 * h))
        matrix = np.array(columns).T[:3]
        if family.multipliers(family.derivative(z, value, sample), sample).size == 4:
            continue
        expected = np.linalg.eigvals(matrix)
        expected = expected[np.argsort(-np.abs(expected))]
        assert np.abs(expected) == pytest.approx(np.abs(branch.multipliers[k][:3]), abs=1e-5)
        checked += 1
        if checked == 20:
            return
    pytest.fail(f"only {checked} points were checked")


@pytest.mark.slow
def test_period_doublings_of_goswamis_compass(cascade):
    doublings = [branch.special_of("period_doubling")[0] for branch in cascade.branches]
    assert math.degrees(doublings[0].value) == pytest.approx(4.390898, abs=5e-7)
    assert [branch.steps for branch in cascade.branches] == [1, 2, 4, 8, 16, 32]
    assert [branch.parent for branch in cascade.branches] == [None, 0, 1, 2, 3, 4]
    assert cascade.ratios[2:] == pytest.approx([4.669] * 2, abs=0.01)  # Feigenbaum (1978)
    for branch, doubling in zip(cascade.branches[1:], doublings, strict=False):
        assert branch.values.min() > doubling.value
        assert branch.end == "period_doubling"
    for point in doublings:
        assert np.min(np.abs(point.multipliers_before + 1)) < 1e-8
    later = cascade.branches[1]
    assert np.all(later.stable[:-1])
    assert later.orbits.shape[1:] == (2, 3)
    assert np.max(np.abs(later.orbits[-1, 0] - later.orbits[-1, 1])) > 1e-2


@pytest.mark.slow
def test_coexisting_gaits_are_found_by_deflation(compass):
    options = TraceOptions(deflate=True, starts=16)
    diagram = trace(compass, {"friction": (0.16, 0.12)}, options=options)
    at = {
        gait.sequence
        for number in range(len(diagram.branches))
        for gait in gaits_at(compass, diagram, 0.14, branch=number)
    }
    assert {"slip+ stick slip- | stick", "slip+ stick | slip+"} <= at  # Gaits B and C of Gamus & Or (2015)
    starts = [branch.states[0].round(6).tolist() for branch in diagram.branches]
    assert len({str(start) for start in starts}) == len(starts)


@pytest.mark.slow
def test_gaits_at_a_value_of_the_parameter(compass, compass_diagram):
    (gait,) = gaits_at(compass, compass_diagram, 0.14)
    # Gait B at friction 0.14, from two integrators: docs/physics.md.
    assert gait.z == pytest.approx([-0.140807105, 0.710208797, -0.516847656], abs=1e-8)
    assert gaits_at(compass, compass_diagram, 0.5) == ()


@pytest.mark.parametrize("name", ["wheel_diagram", pytest.param("cascade", marks=pytest.mark.slow)])
def test_a_diagram_is_read_as_it_was_written(request, tmp_path, name):
    diagram = request.getfixturevalue(name)
    path = save_diagram(diagram, tmp_path / "diagram.nc")
    restored = load_diagram(path)
    assert json.dumps(restored.records()) == json.dumps(diagram.records())
    (tmp_path / "other.nc").write_text("text")
    with pytest.raises(ArchiveError, match="is not"):
        load_diagram(tmp_path / "other.nc")


@pytest.mark.parametrize(
    ("over", "message"),
    [
        ({"fricton": (1, 0.5)}, "Did you mean 'friction'"),
        ({"friction": (1, 1)}, "two different finite ends"),
        ({"friction": (math.inf, 1)}, "two different finite ends"),
        ({"friction": (1, -1)}, "friction must be at least 0, got -1"),
        ({"slope": (2, 3)}, r"got 2\. .* 2 to 3 deg is slope=0\.0349066:0\.0523599\."),
        ({"friction": 0.5}, "must be two numbers"),
        ({}, "one parameter with its range"),
        ({"slope": (-0.5, -0.4)}, "No periodic gait"),
    ],
)
def test_invalid_ranges_are_named(wheel, over, message):
    with pytest.raises(InputError, match=message):
        trace(wheel, over)


def test_a_start_outside_the_range_is_named(wheel):
    start = find_cycles(rimless_wheel(), {"slope": SLOPE, "friction": 1.0}, starts=10)[0]
    with pytest.raises(InputError, match="must contain the start, at 1"):
        trace(wheel, {"friction": (0.5, 0.4)}, start=start)


def test_options_are_checked():
    with pytest.raises(InputError, match="doublings"):
        TraceOptions(doublings=-1)
    with pytest.raises(InputError, match="longest_step"):
        ArclengthOptions(longest_step=0)


def test_a_branch_with_large_multipliers_is_followed_in_long_steps():
    start = {"th1": -0.01277558, "th1_rate": -0.10316025, "th2_rate": -0.12494771, "foot_speed": 0.36494445}
    parameters = {"slope": math.radians(1), "friction": 0.03}
    (gait,) = find_cycles(compass_biped(), parameters, starts=[start])
    assert gait.radius == pytest.approx(196.333, abs=1e-3)
    branch = trace(WalkProblem(robot=compass_biped(), parameters=parameters), {"friction": (0.03, 0.027)}, start=gait)
    branch = branch.branches[0]
    assert branch.end == "range_end"
    assert branch.values.size < 50
    (other,) = find_cycles(
        compass_biped(),
        parameters | {"friction": 0.027},
        starts=[dict(zip(branch.names, branch.states[-1], strict=True))],
    )
    assert np.abs(branch.multipliers[-1]) == pytest.approx(np.abs(other.multipliers), rel=1e-5, abs=1e-9)
