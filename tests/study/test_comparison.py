"""Gaits side by side."""

import dataclasses
import math

import numpy as np
import pytest

from gaitopt import InputError, absolute_work, compare, load, plot_comparison
from gaitopt.cli.study_output import print_comparison
from gaitopt.motion.view_motion import view_motion
from gaitopt.study.comparison import label_by_sequence
from gaitopt.study.comparison_record import list_energy_terms
from tests.study.test_sweep import SEQUENCES


@pytest.fixture(scope="module")
def pair():
    from gaitopt import solve
    from tests.study.conftest import quick_problem

    return [solve(quick_problem(sequence=sequence)) for sequence in SEQUENCES]


def test_gaits_of_two_robots_share_what_both_have(slip_gait):
    motion = dataclasses.replace(slip_gait.motion, angles=("th1", "knee"), actuators=("ankle", "knee"))
    figure = plot_comparison(compare({"one": slip_gait, "other": dataclasses.replace(slip_gait, motion=motion)}))
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert [label.split()[0] for label in labels] == [r"$\theta_{1}$", "ankle", "force", "foot", "cost"]


def test_the_terms_add_up_to_the_cost(pair):
    for record, gait in zip(compare(pair).records(), pair, strict=True):
        terms = dict(record["energy_per_distance"])
        total = terms.pop("absolute_work")
        weight = gait.motion.total_mass * gait.motion.parameters["gravity"]
        assert total == pytest.approx(absolute_work(gait.motion) / gait.step_length)
        assert total / weight == pytest.approx(record["cost_of_transport"])
        assert sum(terms.values()) == pytest.approx(total, rel=1e-6)


def test_labels_tell_gaits_apart(pair, slip_gait):
    assert list(compare(pair).gaits) == SEQUENCES
    assert list(compare([pair[1], slip_gait]).gaits) == [f"{SEQUENCES[1]}{number}" for number in (" (1)", " (2)")]
    changed = dict(slip_gait.motion.parameters) | {"friction": 0.16, "hip_mass": 2.5}
    other = dataclasses.replace(slip_gait, motion=dataclasses.replace(slip_gait.motion, parameters=changed))
    texts = [f"{SEQUENCES[1]}, friction 0.14, hip mass 2", f"{SEQUENCES[1]}, friction 0.16, hip mass 2.5"]
    assert list(compare([slip_gait, other]).gaits) == list(label_by_sequence({"a": slip_gait, "b": other})) == texts
    changed = dict(slip_gait.motion.parameters) | {"slope": math.radians(1)}
    tilted = dataclasses.replace(slip_gait, motion=dataclasses.replace(slip_gait.motion, parameters=changed))
    texts = [f"{SEQUENCES[1]}, slope 0\N{DEGREE SIGN}", f"{SEQUENCES[1]}, slope 1\N{DEGREE SIGN}"]  # as in figures
    assert list(compare([slip_gait, tilted]).gaits) == texts
    assert list(compare({"a": pair[0]}).gaits) == ["a"]
    with pytest.raises(InputError, match="or a mapping of labels"):
        compare(load("docs/examples/compass_slip.h5"))
    with pytest.raises(InputError, match="needs at least one gait"):
        compare([])


def test_multipliers_if_asked_for(slip_gait):
    (record,) = compare([slip_gait], multipliers=True).records()
    assert record["largest_multiplier"] == pytest.approx(max(abs(complex(*pair)) for pair in record["multipliers"]))


def test_the_figure_overlays_all_gaits(pair):
    figure = plot_comparison(compare(pair))
    *lines, bars = figure.axes
    assert len(lines) == 6
    for axes in lines:
        assert axes.get_ylabel()
        assert len(axes.lines) == 2
    assert [label.get_text() for label in bars.get_xticklabels()] == ["stick\n| stick", "slip+ stick\n| slip+"]
    tops = [bar.get_y() + bar.get_height() for bar in bars.patches]
    assert max(tops) == pytest.approx(max(record["cost_of_transport"] for record in compare(pair).records()))


def test_dampers_are_a_term_of_the_cost(slip_gait, damped):
    """A robot without dampers has no such term; beside one that has, it is zero."""
    found = compare({"plain": slip_gait, "damped": damped})
    plain, other = (record["energy_per_distance"] for record in found.records())
    assert other["damping_loss"] == pytest.approx(0.25 * damped.period / damped.step_length)
    assert list(plain) == [name for name in other if name != "damping_loss"]
    labels = [text.get_text() for text in plot_comparison(found).axes[-1].get_legend().get_texts()]
    assert "dampers" in labels
    labels = [text.get_text() for text in plot_comparison(compare([slip_gait])).axes[-1].get_legend().get_texts()]
    assert "dampers" not in labels


def test_a_table_of_robots_with_and_without_dampers(slip_gait, damped, capsys):
    print_comparison(compare({"plain": slip_gait, "damped": damped}))
    (row,) = [line.split() for line in capsys.readouterr().out.splitlines() if "damping loss" in line]
    assert row[-2:] == ["0.00000", f"{0.25 * damped.period / damped.step_length:.5f}"]


def test_gaits_with_several_contacts_are_compared(hop_gait, slip_gait):
    """The terms add up to the cost, and what both kinds of gaits have is drawn for both."""
    found = compare({"hop": hop_gait, "again": hop_gait})
    cost = f"{hop_gait.cost_of_transport:.4g}"
    assert repr(found) == f"Comparison(2 gaits, costs of transport {cost}, {cost})"
    record = found.records()[0]
    terms = dict(record["energy_per_distance"])
    total = terms.pop("absolute_work")
    assert total / view_motion(hop_gait.motion).weight == pytest.approx(record["cost_of_transport"])
    assert sum(terms.values()) == pytest.approx(total, rel=1e-4)
    assert set(record["peak_torque"]) == {"hip", "leg"}
    assert (record["objective"], record["objective_unit"]) == ("hop_effort", "N^2 m^2 s")
    assert record["objective_value"] == hop_gait.objective
    assert 0 < record["force_ratio"] <= hop_gait.motion.parameters["friction"]
    figure = plot_comparison(found)
    labels = [axes.get_ylabel().replace("\n", " ") for axes in figure.axes]
    coordinates = [f"{each.name} [{'deg' if unit == 'rad' else 'm'}]" for unit in ("rad", "m")
                   for _, each in view_motion(hop_gait.motion).channels(unit)]  # fmt: skip
    actuators = ["leg force [N]", "hip torque [N m]"]
    assert labels == [*coordinates, *actuators, "force ratio", "cost of transport"]  # no foot slips
    assert len(coordinates) == 4
    ratio = next(axes for axes in figure.axes if axes.get_ylabel() == "force ratio").lines[0].get_ydata()
    flight = sum(part.time.size for part in hop_gait.motion.segments if not part.state.closed)
    assert np.count_nonzero(np.isnan(ratio)) >= flight
    mixed = compare({"hop": hop_gait, "walk": slip_gait})
    assert [axes.get_ylabel() for axes in plot_comparison(mixed).axes][-3:] == [
        "force ratio", "foot speed\n[m/s]", "cost of transport"
    ]  # fmt: skip


def test_the_table_names_what_was_minimised(hop_gait, slip_gait, capsys):
    print_comparison(compare({"hop": hop_gait, "walk": slip_gait}))
    (row,) = [line for line in capsys.readouterr().out.splitlines() if line.strip().startswith("minimised")]
    assert f"hop effort {hop_gait.objective:.6g} N" in row
    assert f"cost of transport {slip_gait.solver.objective:.6g}" in row


def test_switched_springs_are_a_term_of_the_cost(hop_gait):
    """A spring that is extended at touchdown adds energy which no actuator supplies."""
    events = hop_gait.motion.events
    extended = dataclasses.replace(events[0], switch_work=5.0)
    gait = dataclasses.replace(hop_gait, motion=dataclasses.replace(hop_gait.motion, events=(extended, *events[1:])))
    before, after = (list_energy_terms(each) for each in (hop_gait, gait))
    assert after == pytest.approx(before | {"switched_springs": -5.0})


def test_bars_of_robots_that_do_not_travel_are_energies(hop_gait):
    still = dataclasses.replace(hop_gait, motion=dataclasses.replace(hop_gait.motion, travel=None))
    found = compare({"hop": hop_gait, "still": still})
    assert found.records()[1]["cost_of_transport"] is None
    assert plot_comparison(found).axes[-1].get_ylabel() == "energy per period [J]"


def test_long_sequences_are_not_repeated_below_the_bars(hop_gait):
    long = "heel A stick, toe B stick > heel A stick | heel A stick, toe A stick > toe A stick |, speed 0.5"
    axes = plot_comparison(compare({long: hop_gait, "short": hop_gait})).axes[-1]
    assert not axes.get_xticks().size
