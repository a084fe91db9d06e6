"""gaitopt solve: what it prints, writes and returns."""

import subprocess
import sys
from types import SimpleNamespace

import pytest

from gaitopt import InputError, Status, load
from gaitopt.cli.script import build_problem, read_script
from gaitopt.cli.solving import _list_implausible, _try_remedies
from gaitopt.ocp import PlanarProblem
from gaitopt.progress import silent
from tests.references.storage import reference

KEYS = {  # promised to users
    "status",
    "sequence",
    "cost_of_transport",
    "speed",
    "step_length",
    "period",
    "phases",
    "foot_slide",
    "impact",
    "energy",
    "verification",
    "solver",
    "problem",
    "versions",
}
PARAMETERS = {
    "leg_length": 1.6,
    "leg_com": 0.8,
    "leg_mass": 4.0,
    "hip_mass": 2.0,
    "gravity": 9.8,
    "slope": 0.0,
    "friction": 0.14,
    "speed": 0.633,
    "step_length": 0.4713,
    "objective": "cost_of_transport",
    "torque_limit": {"ankle": 6.0, "hip": 6.0},
}


def demanded(facts):
    assert set(facts) >= KEYS
    assert all(set(phase) >= {"mode", "duration"} for phase in facts["phases"])
    assert set(facts["impact"]) >= {"mode", "ratio"}
    assert set(facts["energy"]) >= {"actuator", "gravity", "impact_loss", "friction_loss", "residual"}
    assert set(facts["verification"]) >= {"passed", "sequence", "state_error", "cost_of_transport"}
    assert set(facts["solver"]) >= {"iterations", "build_seconds", "solve_seconds"}
    return facts


@pytest.mark.slow
def test_a_solve_does_not_import_scipy(root, folder):
    """Its import would take a third of the solve."""
    command = ["solve", str(root / "problems/compass_slip.py"), "--set", "speed=0.6", "-o", "gait.h5", "-q"]
    code = f"""
import sys
from gaitopt.cli.app import main
try:
    main({command})
except SystemExit as end:
    heavy = ("scipy.integrate", "scipy.linalg", "scipy.optimize", "scipy.sparse", "gaitopt.tuning")
    print(end.code, [name for name in heavy if name in sys.modules])
"""
    run = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    assert run.stdout.split(maxsplit=1) == ["0", "[]\n"], run.stdout + run.err


def test_the_main_job_at_its_defaults(process, root, folder):
    run = process("solve", root / "problems/compass_slip.py", "--json")
    assert run.status == 0, run.err
    assert run.err == ""
    facts = demanded(run.json)
    optimum = reference("compass_optimum", "slipping")["replayed_cost_of_transport"]
    assert facts["cost_of_transport"] == pytest.approx(optimum, rel=1e-3)
    assert facts["status"] == "solved"
    assert facts["sequence"] == "slip+ stick | slip+"
    assert [phase["mode"] for phase in facts["phases"]] == ["slip+", "stick"]
    assert sum(phase["duration"] for phase in facts["phases"]) == pytest.approx(facts["period"])
    assert facts["verification"]["passed"] is True
    assert facts["verification"]["sequence"] == facts["sequence"]
    assert facts["impact"]["mode"] == "slip+"
    assert {name: facts["problem"][name] for name in PARAMETERS} == PARAMETERS
    assert facts["file"] == "compass_slip.h5"
    assert [path.name for path in folder.iterdir()] == ["compass_slip.h5"]
    assert load(folder / "compass_slip.h5").status is Status.SOLVED


def test_a_table_for_people(command, root, folder):
    run = command("solve", root / "problems/compass_stick.py", "--set", "intervals=12", "-o", folder / "stick.h5")
    assert run.status == 0
    for fact in (
        "stick | stick",
        "cost of transport",
        "speed",
        "step length",
        "period",
        "phases",
        "friction margin",
        "foot slide",
        "impact",
        "friction",
        "balance error",
        "passed",
        "build",
        "solve",
    ):
        assert fact in run.out
    assert f"wrote {folder / 'stick.h5'}" in run.out
    assert (folder / "stick.h5").is_file()


def test_settings_reach_the_problem(command, root, folder):
    settings = {
        "friction": 0.2,
        "speed": (0.6, 0.7),
        "step_length": 0.45,
        "torque_limit": 8,
        "slope": 1,
        "intervals": 8,
    }
    arguments = [text for name, value in settings.items() for text in ("--set", f"{name}={value}")]
    arguments += ["--set", "objective=torque_squared", "--set", "sequence=stick | stick"]
    run = command("solve", root / "problems/compass_slip.py", *arguments, "--json")
    assert run.status == 0, run.err
    resolved = run.json["problem"]
    assert resolved["friction"] == 0.2
    assert resolved["speed"] == [0.6, 0.7]
    assert resolved["slope"] == pytest.approx(0.0174533, abs=1e-7)  # 1 deg
    assert resolved["torque_limit"] == {"ankle": 8.0, "hip": 8.0}
    assert resolved["objective"] == "torque_squared"
    assert resolved["intervals"] == [8]
    assert run.json["sequence"] == "stick | stick"


LONG_FOOT = """
from tests.walkers.heel_toe import LIGHT, heel_toe_step

def problem():
    return heel_toe_step(0.05, build=LIGHT._replace(heel=-5.0, toe=9.0), coordinate={"a": (-17, 17)})
"""


def test_implausible_sizes_are_reported_before_the_solve(command, root, folder, monkeypatch):
    def end(*_, **__):
        raise InputError("the solve has begun")

    monkeypatch.setattr("gaitopt.cli.solving._solve_and_import", end)
    printed = command("solve", root / "problems" / "compass_slip.py", "--set", "leg_length=1000").err
    assert printed.index("warning: leg_length = 1000 m is implausible") < printed.index("the solve has begun")
    (folder / "long_foot.py").write_text(LONG_FOOT, encoding="utf-8")
    printed = command("solve", "long_foot.py").err
    for warning in (
        "between contacts 'heel a' and 'toe a' of one body is implausible",
        "PlanarLimits.coordinate of a = (-17, 17) rad is implausible: it is (-974, 974) deg, and a bound of an angle "
        "is at most 6.28 rad in size. If the value is in degrees, state (math.radians(-17), math.radians(17)).",
    ):
        assert warning in printed
        assert printed.index(warning) < printed.index("the solve has begun")


def test_implausible_sizes_are_the_first_warning(command, root, folder):
    script = root / "problems" / "compass_slip.py"
    done = command("solve", script, "--set", "leg_length=1000", "--json")
    assert done.status == 1
    assert done.json["warnings"][0].startswith("leg_length = 1000 m is implausible")
    assert "leg_length = 1000 m is implausible" in done.err


@pytest.mark.parametrize("free", ["None", "free"])
def test_a_free_target_is_none(command, root, free):
    run = command(
        "solve", root / "problems/compass_stick.py", "--set", f"step_length={free}", "--set", "intervals=8", "--json"
    )
    assert run.status == 0
    assert run.json["problem"]["step_length"] is None


@pytest.mark.parametrize("bounds", ["0.6:0.7", "(0.6, 0.7)", "(0.6,0.7)"])
def test_a_target_between_bounds(root, bounds):
    problem = build_problem(root / "problems/compass_stick.py", [f"speed={bounds}"])
    assert problem.speed == (0.6, 0.7)
    assert problem.describe()["script"]["parameters"]["speed"] == (0.6, 0.7)


def test_no_gait_is_exit_status_1_and_leaves_an_older_file_alone(command, root, folder):
    (folder / "gait.h5").write_text("precious")
    arguments = ["--set", "torque_limit=0.1", "--set", "intervals=8", "-o", "gait.h5", "--json"]
    run = command("solve", root / "problems/compass_stick.py", *arguments)
    assert run.status == 1
    facts = run.json
    assert facts["status"] in ("infeasible", "iteration_limit")
    assert facts["hint"]
    assert facts["file"] is None
    assert facts["verification"] is None
    assert {"place", "name", "size"} == set(facts["violations"][0])
    assert facts["failure_file"] == "gait_failed.h5"
    assert sorted(path.name for path in folder.iterdir()) == ["gait.h5", "gait_failed.h5"]
    assert (folder / "gait.h5").read_text() == "precious"


def test_no_gait_in_sequences(command, root, folder):
    run = command("solve", root / "problems/compass_stick.py", "--set", "torque_limit=0.1", "--set", "intervals=8")
    assert run.status == 1
    assert "torque limit of ankle (Limits.torque) is 0.1 N m" in " ".join(run.out.split())  # a conflict
    assert "not met" not in run.out  # the violations of a solve that was stopped early
    assert "no verified gait was found; wrote compass_stick_failed.h5" in run.out
    assert [path.name for path in folder.iterdir()] == ["compass_stick_failed.h5"]


def test_the_file_of_a_failed_solve_repeats_it_without_the_script(command, root, folder):
    settings = ("--set", "torque_limit=0.1", "--set", "intervals=8")
    failed = command("solve", root / "problems/compass_stick.py", *settings, "--json").json
    assert "0.1 N m" in command("show", "compass_stick_failed.h5").out  # the conflicting limits
    again = command("solve", "compass_stick_failed.h5", "--json")
    assert again.status == 1
    for name in ("status", "conflicts", "violations", "sequence"):
        assert again.json[name] == failed[name]
    assert again.json["problem"]["script"] == failed["problem"]["script"]
    assert again.json["failure_file"] is None
    assert [path.name for path in folder.iterdir()] == ["compass_stick_failed.h5"]


def test_a_repeated_solve_that_fails_again_names_the_file_that_contains_it(command, root, folder):
    settings = ("--set", "torque_limit=0.1", "--set", "intervals=8")
    command("solve", root / "problems/compass_stick.py", *settings)
    again = command("solve", "compass_stick_failed.h5", "-o", "again.h5")
    assert again.status == 1
    assert (
        "nothing was written: compass_stick_failed.h5 already contains this problem, whose solve fails again"
        in again.out
    )
    assert [path.name for path in folder.iterdir()] == ["compass_stick_failed.h5"]


def test_the_file_of_a_gait_or_settings_are_no_failed_solve(command, slip_file):
    assert "compass_slip.h5 is a solved gait" in command("solve", slip_file).err
    assert "--set changes a parameter of a script" in command("solve", slip_file, "--set", "friction=1").err


def test_quiet_is_silent_and_still_writes(process, root, folder):
    run = process("solve", root / "problems/compass_stick.py", "--set", "intervals=8", "--quiet")
    assert run == (0, "", "")
    assert (folder / "compass_stick.h5").is_file()


def test_a_script_runs_by_itself(process, root, folder):
    run = process("--set", "intervals=12", "--json", program=[str(root / "problems/compass_slip.py")])
    assert run.status == 0, run.err
    assert demanded(run.json)["file"] == "compass_slip.h5"
    assert (folder / "compass_slip.h5").is_file()


OWN = '''"""Own objective, with a sibling and a name full of [markup] [/b]."""

from __future__ import annotations

from dataclasses import dataclass

from gaitopt import GaitProblem, MultipleShooting, Objective, compass_biped


@dataclass(frozen=True)
class AnkleFirst(Objective):
    weight: float = 10.0
    name = "ankle_first"
    per_weight_and_travel = True
    smooth = True

    def integrand(self, point):
        return self.weight * point.torque[0] ** 2 + point.torque[1] ** 2


def problem(friction=0.3, weight=10.0):
    import sibling

    return GaitProblem(
        name="walk [bold] [/b]", robot=compass_biped(), sequence="stick | stick", friction=friction,
        speed=sibling.SPEED, step_length=0.45, objective=AnkleFirst(weight),
        transcription=MultipleShooting(intervals=8),
    )
'''


@pytest.mark.slow
def test_a_script_with_its_own_objective_and_neighbours(command, script):
    script("SPEED = 0.6\n", "sibling.py")
    path = script(OWN, "json.py")  # the name of a module of the standard library, which it must not replace
    light, heavy = (command("solve", path, "--set", f"weight={weight}", "--json") for weight in (1.0, 100.0))
    assert (light.status, heavy.status) == (0, 0), heavy.err
    assert light.json["problem"]["objective"] == "ankle_first"
    assert heavy.json["solver"]["objective"] > light.json["solver"]["objective"]
    table = command("solve", path)
    assert table.status == 0
    assert "wrote json.h5" in table.out


def test_a_failed_solve_with_its_own_objective_needs_its_script(command, script):
    script("SPEED = 0.6\n", "sibling.py")
    weak = OWN.replace("MultipleShooting, O", "Limits, MultipleShooting, O")
    run = command("solve", script(weak.replace('name="walk', 'limits=Limits(torque=0.1), name="walk')))
    assert run.status == 1, run.err
    assert "the script is needed: the code of AnkleFirst is not in the file" in run.out
    assert "the code of AnkleFirst is not in the file" in command("solve", "own_failed.h5").err


@pytest.mark.slow
def test_equal_settings_of_an_own_objective_share_nothing_with_others(command, script):
    """Objectives are distinguished by their fields, so another weight is another NLP."""
    script("SPEED = 0.6\n", "sibling.py")
    path = script(OWN)
    costs = [command("solve", path, "--set", f"weight={w}", "--json").json["solver"]["objective"] for w in (1, 2, 1)]
    assert costs[0] == pytest.approx(costs[2], rel=1e-12)
    assert costs[0] < costs[1]


SLIDING_HOP = """
from gaitopt.model import monopod
from gaitopt.ocp import PlanarProblem


def problem():
    return PlanarProblem(
        robot=monopod(), sequence="foot slip+ > flight |", friction=0.3, speed=1.5, step_length=0.6,
        objective="torque_squared",
    )
"""


def test_touchdowns_without_impulse_are_remarked_before_the_solve(root):
    """Such a gait is accurate on no grid, so that its solve takes long and its replay fails."""
    path, soft = root / "problems/flat_foot.py", "sequence=heel A stick > heel A stick, toe A stick > toe A stick |"
    (remark,) = _list_implausible(read_script(path, [soft])())
    assert remark.startswith("toe A closes at '>', that is without impulse")
    assert not _list_implausible(read_script(path)())


@pytest.mark.parametrize("interrupted", [False, True])
def test_a_failed_solve_of_several_contacts_tries_its_remedies(command, folder, monkeypatch, hop_gait, interrupted):
    """An interrupt of the trials keeps what the solve has found."""

    def try_remedies(problem, failure, observer, *, keep):
        keep(problem.replace(speed=0.3), hop_gait)
        if interrupted:
            raise KeyboardInterrupt
        return failure.replace_fields(solver=failure.solver.replace_fields(warnings=("another sequence is solved",)))

    monkeypatch.setattr("gaitopt.simulation.remedy_trials.try_remedies", try_remedies)
    (folder / "hop.py").write_text(SLIDING_HOP, encoding="utf-8")
    run = command("solve", "hop.py")
    assert run.status == (130 if interrupted else 1)
    assert "all contacts slip forward all the time" in " ".join(run.out.split())
    assert ("another sequence is solved" in run.out) is not interrupted
    assert ("Interrupted: possible remedies are not all tested." in run.err) is interrupted
    assert (folder / "hop_failed.h5").exists()
    assert "wrote hop_remedy_1.h5 (the verified gait with speed = 0.3 m/s)" in run.out
    assert load("hop_remedy_1.h5").status.ok
    assert command("solve", "hop.py", "--json").json["remedy_files"] == ["hop_remedy_1.h5"]


@pytest.mark.parametrize("status", [Status.PLAN_INACCURATE, Status.INFEASIBLE, Status.TIME_LIMIT])
def test_remedies_of_inaccurate_plans_are_tried_as_well(hop_gait, monkeypatch, status):
    tried = []
    monkeypatch.setattr("gaitopt.simulation.remedy_trials.try_remedies", lambda *_, **__: tried.append(1) or hop_gait)
    problem = PlanarProblem(robot=hop_gait.robot, sequence=str(hop_gait.sequence))
    display, files = SimpleNamespace(describe=lambda text: None), SimpleNamespace(keep=print)
    _try_remedies(problem, hop_gait.replace_fields(status=status), silent, display, files)
    assert bool(tried) is (status is not Status.TIME_LIMIT)


def test_a_slope_without_a_gait_is_reported_without_the_remedies_of_a_failed_solve(command, root, folder):
    words = ("solve", root / "problems" / "compass_slip.py", "--set", "slope=20", "-o", "steep.h5")
    run, quiet = command(*words), command(*words, "--quiet")
    assert run.status == quiet.status == 1
    said = " ".join(run.out.split())
    assert "infeasible: The problem was not solved, since no periodic gait exists; the reason is stated below." in said
    assert "tan(slope) = 0.364 exceeds friction 0.14" in said
    assert said.partition("no verified gait")[0].endswith("or friction of at least 0.364 ")  # no iteration, no time
    assert command(*words, "--json").json["solver"]["iterations"] == 0
    assert quiet.err.startswith("infeasible: tan(slope) = 0.364 exceeds friction 0.14")
    assert not any("another contact sequence" in text for text in (run.out, quiet.err))
