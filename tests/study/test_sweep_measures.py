"""Measures of sweeps, all sequences at each point, and the file as other programs read it."""

import h5py
import numpy as np
import pytest

from gaitopt import Execution, InputError, assess_stability, load_sweep, load_sweep_gait, sweep
from gaitopt.cli.studies import split_sequences
from gaitopt.study import GaitMetric
from gaitopt.study.gait_metrics import friction_demand, slip_distance, slip_duty
from gaitopt.study.planar_metrics import slip_distances, slip_duties
from gaitopt.study.stability_metrics import measure_multipliers
from gaitopt.study.sweeps import sweep as sweep_module
from tests.study.conftest import quick_problem

SEQUENCES = ["slip+ | slip+", "stick | stick", "slip+ stick | slip+"]
CADENCE = GaitMetric("cadence", "1/s", "steps per second", lambda gait: 1 / gait.period)


def run(path, **options):
    return sweep(quick_problem(), {"friction": [0.18]}, sequences=SEQUENCES, starts=1, path=path, **options)


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Return a sweep to which measures were added, and its file."""
    path = tmp_path_factory.mktemp("measures") / "sweep.nc"
    run(path)
    return run(path, measures=["stability", CADENCE]), path


def test_measures_agree_with_the_gaits_and_are_stored(measured):
    table, path = measured
    assert table.status.values.ravel().tolist() == ["impossible", "solved", "solved"]
    assert "All contacts slip forward all the time" in table.reason.values[0, 0]
    for number in (1, 2):
        gait = load_sweep_gait(path, SEQUENCES[number], friction=0.18)
        cycle = assess_stability(gait)
        point = table.isel(sequence=number, friction=0)
        assert float(point.spectral_radius) == pytest.approx(cycle.radius, rel=1e-12)
        multipliers = point.multiplier_real.values + 1j * point.multiplier_imag.values
        expected = np.sort_complex(np.asarray(cycle.multipliers, dtype=complex))
        np.testing.assert_allclose(np.sort_complex(multipliers[np.isfinite(multipliers)]), expected)
        assert bool(point.stable) is cycle.stable
        assert float(point.cadence) == 1 / gait.period
    assert load_sweep(path).identical(table)


def test_measures_are_added_without_solving_again_and_earlier_ones_stay(measured, monkeypatch):
    table, path = measured
    monkeypatch.setattr(sweep_module, "solve_task", None)
    again = run(path, measures=["stability"])
    assert again.identical(table)
    doubled = GaitMetric("doubled", "s", "twice the period", lambda gait: 2 * gait.period)
    more = run(path, measures=[doubled])
    assert more.attrs["measures"] == "cadence, stability, doubled"
    np.testing.assert_array_equal(more.spectral_radius, table.spectral_radius)
    np.testing.assert_array_equal(more.doubled, 2 * table.period)


def test_an_interrupt_while_measuring_leaves_the_file_as_it_was(measured):
    _, path = measured
    before = load_sweep(path)

    def stop(done, total):
        if total == 2:  # the two solved gaits
            raise KeyboardInterrupt

    part = run(path, measures=["recovery"], execution=Execution(observer=stop))
    assert part.attrs["complete"] == 0
    assert load_sweep(path).identical(before)


def test_the_sequence_of_lowest_cost_is_named(measured):
    table, _ = measured
    costs = table.objective.values[:, 0]
    assert str(table.lowest_sequence.values[0]) == SEQUENCES[int(np.nanargmin(costs))]


def test_netcdf_libraries_read_the_file(measured):
    """The rules of NetCDF-4: no user block, dimension scales, and strings of variable length in UTF-8."""
    table, path = measured
    for name, variable in table.variables.items():
        assert variable.dtype.kind in "OU" or variable.attrs["units"], name
        assert str(name) in table.dims or variable.attrs["long_name"], name
    with h5py.File(path) as file:
        assert file.userblock_size == 0
        for name in table.variables:
            dataset = file[name]
            text = h5py.check_string_dtype(dataset.dtype)
            assert text is None or (text.encoding, text.length) == ("utf-8", None)
            assert dataset.is_scale or [scale[0].name.lstrip("/") for scale in dataset.dims] == list(table[name].dims)
            assert text or dataset.dtype.kind in "fi"


def test_any_stands_for_all_sequences():
    problem, axes = quick_problem(), {"friction": [0.18]}
    names = [str(each) for each in sweep_module._sequences_of(problem, "any:1")]
    assert names == ["stick | stick", "slip+ | stick", "slip+ | slip+", "slip- | stick", "slip- | slip-"]
    assert len(sweep_module._sequences_of(problem, "any")) == 15
    assert sweep_module._sequences_of(problem, "stick | stick") == (problem.sequence,)
    assert split_sequences("stick | stick") == ["stick | stick"]
    for options, message in [
        ({"sequences": "any:x"}, "'any' or 'any:N'"),
        ({"measures": ["stabilty"]}, "Did you mean 'stability'"),
        ({"measures": [GaitMetric("period", "s", "period", lambda gait: 1.0)]}, "has a variable 'period' already"),
    ]:
        with pytest.raises(InputError, match=message):
            sweep(problem, axes, **options)


def test_slips_of_a_gait_with_a_forward_and_a_backward_slip(slipping_both_ways):
    first, middle, last = slipping_both_ways.motion.segments
    assert slip_distance(slipping_both_ways) == pytest.approx(abs(first.slide) + abs(last.slide))
    assert slip_duty(slipping_both_ways) == pytest.approx((first.duration + last.duration) / slipping_both_ways.period)
    assert friction_demand(slipping_both_ways) == pytest.approx(np.max(np.abs(middle.force[0]) / middle.force[1]))


def test_several_contacts_have_the_same_metrics(hop_gait):
    assert slip_duties(hop_gait).tolist() == slip_distances(hop_gait).tolist() == [0.0, 0.0]
    multipliers = np.abs(measure_multipliers(hop_gait))
    assert multipliers.size
    assert np.all(np.diff(multipliers) <= 0)
