"""Sweeps and searches over the gaits of robots with several contacts."""

import re
import signal

import numpy as np
import pytest

from gaitopt import Collocation, Execution, load, load_sweep_gait, search, sweep
from gaitopt.errors import InputError
from gaitopt.export import write_sweep_table
from gaitopt.model import compass_with_two_feet, kneed_walker, monopod
from gaitopt.motion import PhaseSequence
from gaitopt.ocp import PlanarLimits, PlanarProblem, solve_planar
from gaitopt.ocp.multicontact.planar_enumeration import enumerate_planar_sequences
from gaitopt.study import load_sweep, planar_starts
from gaitopt.study.sequence_search.planar_search import name_file
from gaitopt.study.storage.study_key import study_key
from gaitopt.study.sweeps.sweep_file import SweepResults, to_dataset
from gaitopt.study.sweeps.sweep_grid import SweepGrid
from tests.ocp.multicontact_examples import walk

COARSE = Collocation(intervals=10)


@pytest.fixture(scope="module")
def problem():
    return walk(transcription=COARSE)


def test_a_sweep_has_the_optima_of_its_points_and_numbers_by_contact(problem, tmp_path):
    table = sweep(problem, {"speed": [0.6, 0.633]}, starts=1, path=tmp_path / "speeds.nc")
    for speed in (0.6, 0.633):
        alone = solve_planar(problem.replace(speed=speed))
        point = table.sel(sequence="foot A stick |", speed=speed)
        assert float(point.objective) == pytest.approx(alone.solver.objective, rel=1e-6)
        landing = alone.motion.events[-1].impulse
        assert point.normal_impulse.sel(contact="foot B") == pytest.approx(landing[1, 1], rel=1e-5)
        assert point.normal_impulse.sel(contact="foot A") == 0
        assert point.tangential_impulse.sel(contact="foot B") == pytest.approx(landing[1, 0], rel=1e-5)
    assert table.status.values.tolist() == [["solved", "solved"]]
    assert np.all(table.verified == 1)
    stored = load_sweep(tmp_path / "speeds.nc")
    np.testing.assert_array_equal(stored.objective, table.objective)
    assert stored.attrs["complete"] == 1
    header = write_sweep_table(stored, tmp_path / "speeds.csv").read_text(encoding="utf-8").partition("\n")[0]
    assert {"peak_torque_ankle_B_Nm", "peak_torque_hip_Nm"} <= set(header.split(","))


def test_the_column_of_each_actuator_has_its_unit(tmp_path):
    hop = PlanarProblem(robot=monopod(), sequence="foot stick > flight |", friction=1, speed=1)
    grid = SweepGrid(hop, (hop.sequence,), {"speed": np.array([1.0])}, starts=1)
    table = to_dataset(SweepResults(grid, {}, dict.fromkeys(grid.points(), ("pending", "")), {}))
    header = write_sweep_table(table, tmp_path / "hop.csv").read_text(encoding="utf-8").partition("\n")[0].split(",")
    assert {"peak_torque_leg_N", "peak_torque_hip_Nm"} <= set(header)


class InterruptedSolves:
    """Solves of which one receives Ctrl-C at its first iterate."""

    def __init__(self, number):
        self.number, self.count = number, 0

    def __call__(self, problem, *, starts=1):
        self.count += 1

        def observe(iteration):
            if self.count == self.number:
                signal.raise_signal(signal.SIGINT)

        return solve_planar(problem, starts=starts, observer=observe)


@pytest.mark.parametrize("number", [1, 2, 3])
def test_an_interrupt_in_a_solve_ends_a_sweep_and_its_iterate_is_not_a_result(problem, monkeypatch, number):
    """Each solve of a sweep in this process: of default starts, and warm-started from a neighbour."""
    solves = InterruptedSolves(number)
    monkeypatch.setattr(planar_starts, "solve_planar", solves)
    axes = {"speed": [0.6, 0.633]}
    if number == 1:
        with pytest.raises(KeyboardInterrupt):
            sweep(problem, axes, starts=1)
    else:
        table = sweep(problem, axes, starts=1)
        assert table.attrs["complete"] == 0
        assert set(table.status.values.ravel()) <= {"solved", "pending"}
    assert solves.count == number


def test_an_interrupt_in_a_solve_ends_a_search(problem, monkeypatch):
    monkeypatch.setattr(planar_starts, "solve_planar", InterruptedSolves(1))
    with pytest.raises(KeyboardInterrupt):
        search(problem, sequences=["foot A stick |"], starts=1)


@pytest.mark.slow
def test_the_gaits_of_a_sweep_are_stored_and_an_interrupted_one_is_resumed(problem, tmp_path):
    path, axes, solved = tmp_path / "speeds.nc", {"speed": [0.6, 0.633]}, []

    def interrupt(done, total):
        if done == 3:
            raise KeyboardInterrupt

    partial = sweep(problem, axes, starts=1, path=path, execution=Execution(observer=interrupt))
    assert partial.attrs["complete"] == 0
    kept = {file.name for file in (tmp_path / "speeds.nc.parts").glob("*.h5")}
    assert kept
    table = sweep(problem, axes, starts=1, path=path, execution=Execution(observer=lambda *n: solved.append(n)))
    assert table.attrs["complete"] == 1
    assert solved[0][0] >= len(kept)  # what was stored counts as done
    assert [file.name for file in tmp_path.iterdir()] == ["speeds.nc"]
    for speed in (0.6, 0.633):
        gait = load_sweep_gait(path, "foot A stick |", speed=speed)
        assert gait.verification.passed
        assert gait.solver.objective == float(table.sel(sequence="foot A stick |", speed=speed).objective)
        assert gait.robot is problem.robot
    with pytest.raises(InputError, match="different study"):
        sweep(problem, {"speed": [0.6]}, starts=1, path=path)


def test_the_gaits_of_a_search_are_stored_and_not_solved_again(problem, tmp_path):
    sequences, counts = ["foot A stick |", "foot A slip+ > foot A stick |"], []
    search(problem.replace(friction=0.3), sequences=sequences, starts=1, directory=tmp_path)
    stored = {file: file.stat().st_mtime_ns for file in tmp_path.glob("*.h5")}
    assert {file.stem for file in stored} == {"foot_A_stick__", "foot_A_slip+_-_foot_A_stick__"}
    again = search(
        problem.replace(friction=0.3, sequence="foot A any |"),
        sequences=["foot A stick |", "foot A slip+ > foot A stick |"],
        starts=1,
        directory=tmp_path,
        execution=Execution(observer=lambda *n: counts.append(n)),
    )
    assert {file: file.stat().st_mtime_ns for file in stored} == stored
    assert again.findings[0].file == tmp_path / "foot_A_stick__.h5"
    assert load(again.findings[0].file).solver.objective == again.best.solver.objective
    with pytest.raises(InputError, match="different study"):
        search(problem, sequences=sequences, starts=1, directory=tmp_path)


def test_long_sequences_have_short_file_names():
    long = " > ".join(["foot A slip+, foot B slip+", "foot A slip-, foot B slip+", "foot A slip+, foot B slip- |"])
    names = {name_file(PhaseSequence.parse(text)) for text in (long, long.replace("slip- |", "stick |"))}
    assert len(names) == 2
    assert all(len(name) < 100 and not set(name) & set('<>:"/|?*') for name in names)


@pytest.mark.slow
def test_a_sweep_does_not_depend_on_the_number_of_workers(problem):
    axes = {"friction": [0.3, 1.0]}
    one, two = (sweep(problem, axes, starts=1, execution=Execution(workers=count)) for count in (1, 2))
    assert one.objective.values.tolist() == two.objective.values.tolist()


def test_a_point_that_is_impossible_states_the_reason(problem):
    table = sweep(problem, {"speed": [0.633, 200.0]}, starts=1)
    assert table.status.values.tolist() == [["solved", "impossible"]]
    assert "leave 0.00236 s" in str(table.reason.values[0, 1])


def test_a_search_ranks_the_sequences_that_have_a_gait(problem, tmp_path):
    slipping = "foot A slip+ > foot A stick | [foot B slip+]"
    ranking = search(
        problem.replace(friction=0.3), sequences=["foot A stick |", slipping], starts=1, directory=tmp_path / "ranks"
    )
    assert ranking.complete
    assert str(ranking.best.sequence) == "foot A stick |"
    first = ranking.records()[0]
    assert first["phases"][0][0] == "foot A stick"
    assert first["verification"]["passed"]
    assert (tmp_path / "ranks" / "ranking.json").exists()


def test_enumeration_counts_rotations_and_mirror_images_once():
    compass = [str(sequence) for sequence in enumerate_planar_sequences(compass_with_two_feet(), 2)]
    assert compass[:3] == ["foot A stick |", "foot A slip+ |", "foot A slip- |"]
    assert "foot A stick, foot B slip+ > foot A stick |" in compass  # the exchange of the legs drags foot A
    assert not [name for name in compass if "foot A stick, foot B stick" in name]  # the robot would be rigid
    hops = [str(sequence) for sequence in enumerate_planar_sequences(monopod(), 3)]
    assert {"foot stick > flight |", "foot slip+ > foot stick > flight |"} <= set(hops)
    assert len(hops) == len(set(hops)) == 3 + 6
    with pytest.raises(InputError, match="with joint stops are not enumerated"):
        enumerate_planar_sequences(kneed_walker(), 1)
    with pytest.raises(InputError, match="max_phases"):
        enumerate_planar_sequences(monopod(), 4)


def test_too_many_sequences_are_refused_with_the_number_of_shorter_ones(monkeypatch):
    monkeypatch.setattr("gaitopt.ocp.multicontact.planar_enumeration.MOST_SEQUENCES", 5)
    assert len(enumerate_planar_sequences(monopod(), 2)) == 3
    message = "'monopod' has more than 5 contact sequences of at most 3 phases, but 3 of at most 2: use max_phases=2"
    with pytest.raises(InputError, match=message):
        enumerate_planar_sequences(monopod(), 3)
    monkeypatch.setattr("gaitopt.ocp.multicontact.planar_enumeration.MOST_SEQUENCES", 1)
    with pytest.raises(InputError, match=r"of at most 2 phases: name the sequences to solve in search\("):
        enumerate_planar_sequences(monopod(), 3)


def test_searches_sweeps_and_solves_state_one_reason_of_an_impossible_sequence(problem):
    sequence = "foot A slip+ |"
    (finding,) = search(problem, sequences=[sequence], starts=1).findings
    slipping = problem.replace(sequence=sequence)
    assert finding.status == "impossible"
    assert finding.reason == solve_planar(slipping).solver.message
    assert finding.reason.startswith("all contacts slip forward all the time: friction 1 then")
    with pytest.raises(InputError, match=re.escape(f"A{finding.reason[1:]}.")):
        sweep(slipping, {"speed": [0.6]}, starts=1)


def test_the_key_of_a_study_contains_a_changed_clearance_only(problem):
    """Studies with the default clearance keep the key of earlier versions and are resumed."""
    key = study_key(problem.replace(limits=PlanarLimits(torque=6)))
    assert "clearance" not in key["problem"]
    assert study_key(problem.replace(limits=PlanarLimits(torque=6, clearance=0.01)))["problem"]["clearance"] == 0.01
