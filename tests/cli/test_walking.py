"""Commands on walks: stability, simulate, basin, run."""

import json
import re
from pathlib import Path

import pytest
from rich.console import Console
from rich.progress import Progress
from typer.testing import CliRunner

from gaitopt import GaitoptError, assess_stability, load, load_basin
from gaitopt.cli import walk_file
from gaitopt.cli.app import app, main
from gaitopt.simulation import engine_choice
from gaitopt.stability.cycle import Cycle
from gaitopt.study.basins.basin_file import fraction_at

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
PASSIVE, WHEEL, SLIP = "problems/compass_passive.py", "problems/rimless_wheel.py", "docs/examples/compass_slip.h5"


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_stability_of_a_script():
    result = run("stability", WHEEL, "--set", "friction=inf", "--starts", 20, "--json")
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    assert data["engine"] in ("heyoka", "scipy")
    (gait,) = data["gaits"]
    assert gait["sequence"] == "stick | stick"
    assert gait["multipliers"][0] == pytest.approx([0.734042, 0], abs=1e-6)  # Gamus & Or (2015)
    assert gait["stable"] is True
    assert gait["critical_friction"] == pytest.approx(0.914, abs=5e-4)
    assert gait["impact_ratio"] == pytest.approx(-0.2374, abs=5e-5)
    assert set(gait["energy"]) >= {"actuator", "gravity", "impact_loss", "friction_loss", "residual"}
    assert set(gait["state"]) == {"theta_rate"}
    assert gait["period"] > 0
    assert gait["step_length"] > 0


def test_stability_reports_gaits_of_several_steps_with_their_own_period():
    result = run("stability", PASSIVE, "--set", "friction=0.1445", "--steps", 2, "--json")
    assert result.exit_code == 0, result.output
    gaits = json.loads(result.stdout)["gaits"]
    assert [gait["steps"] for gait in gaits if gait["stable"]] == [1]
    (doubled,) = [gait for gait in gaits if gait["steps"] == 2]
    single = next(gait for gait in gaits if gait["sequence"] == "slip+ stick | slip+")
    assert doubled["sequence"] == "slip+ stick | slip+; slip+ stick | slip+"
    assert doubled["period"] == pytest.approx(2 * single["period"], rel=1e-2)


def test_stability_of_a_saved_gait():
    result = run("stability", SLIP, "--json", "--engine", "scipy")
    data = json.loads(result.stdout)
    assert data["engine"] == "scipy"
    assert data["gaits"][0]["stable"]
    assert len(data["gaits"][0]["multipliers"]) == 4


def test_multipliers_on_either_side_of_an_impacts_edge_are_told_apart():
    result = run("stability", WHEEL, "--set", "friction=0.2450521555785", "--starts", 10)
    text = " ".join(result.stdout.split())
    told = [text.index(part) for part in ("one-sided, impact sticks:", "0.767465", "impact slips:", "0.772328")]
    assert told == sorted(told)


def test_a_search_for_gaits_shows_progress_unless_it_is_quiet(monkeypatch):
    shown = []
    monkeypatch.setattr(Console, "is_terminal", True)
    monkeypatch.setattr(Progress, "add_task", lambda self, text, **_: shown.append(text))
    for more in ((), ("--json",), ("--quiet",)):
        assert run("stability", WHEEL, "--set", "friction=inf", "--starts", 2, *more).exit_code == 0
    assert shown == ["searching for periodic gaits"]


def test_no_gait_is_exit_status_one():
    # Friction is infinite: on level ground a wheel that slips throughout repeats its rates while its foot slows down.
    result = run("stability", WHEEL, "--set", "slope=0", "--set", "friction=inf", "--starts", 5)
    assert result.exit_code == 1
    assert "no periodic gait found" in result.output


def test_simulate_logs_events():
    result = run(
        "simulate", WHEEL, "--set", "friction=0.3", "--set", "sequence=stick slip+ | stick", "--steps", 2, "--json"
    )
    data = json.loads(result.stdout)
    assert result.exit_code == 0
    assert data["stop"] == "steps_done"
    assert [event["name"] for event in data["events"]] == ["slip+", "touchdown"] * 2
    assert data["sequences"] == ["stick slip+ | stick"] * 2
    assert data["events"][1]["energy_lost"] > 0


@pytest.mark.parametrize("width", [3.5, 7.2])
def test_the_figure_of_a_walk_has_the_requested_width(tmp_path, width):
    path = tmp_path / "walk.svg"
    settings = ["--set", "friction=0.3", "--set", "sequence=stick slip+ | stick"]
    assert run("simulate", WHEEL, *settings, "--steps", 1, "-o", path, "--width", width).exit_code == 0
    assert float(re.search(r'width="([\d.]+)pt"', path.read_text()).group(1)) == pytest.approx(72 * width, rel=0.1)


@pytest.mark.parametrize(("law", "name"), [("feedforward", "open loop"), ("lqr", "lqr")])
def test_the_title_of_a_saved_gait_states_its_name_the_law_and_the_speed(tmp_path, monkeypatch, law, name):
    titles = []
    monkeypatch.setattr(walk_file.WalkFile, "write", lambda _, motion, title, *rest: titles.append(title))
    path = tmp_path / "walk.png"
    assert run("simulate", SLIP, "--law", law, "--steps", 1, "-o", path).exit_code == 0
    assert run("simulate", WHEEL, "--steps", 1, "-o", path).exit_code == 0
    assert titles == [f"compass biped, slipping impact\n{name}, planned speed 0.633 m/s", "rimless wheel"]


def test_the_events_of_a_walk_end_with_the_sequence_of_each_step():
    lines = run("simulate", WHEEL, "--set", "sequence=stick slip+ | stick", "--steps", 2).stdout.splitlines()
    ends = [line for line in lines if "touchdown" in line]
    assert [line.rstrip().endswith("stick slip+ | stick") for line in ends] == [True, True]


def test_simulate_from_a_changed_state_that_fails():
    result = run("simulate", WHEEL, "--state", "theta_rate=0.01", "--json")
    assert result.exit_code == 1
    assert json.loads(result.stdout)["stop"] == "fell"


def test_basin_on_the_command_line(tmp_path):
    file = tmp_path / "basin.nc"
    result = run("basin", WHEEL, "--set", "friction=inf", "--over", "theta_rate=0.1:3.4:4", "-o", file, "--json")
    data = json.loads(result.stdout)
    assert data["endings"] == ["fell", "stick | stick", "stick | stick", "lift_off"]
    assert data["fractions"]["stick | stick"] == pytest.approx(0.5)
    assert file.exists()


def test_a_basin_that_does_not_contain_the_gait_is_remarked():
    for axis, remarked in (("th1_rate=-0.5,0.1", True), ("th1_rate=0.5,0.7", False)):
        result = run("basin", SLIP, "--over", axis, "--workers", 1)
        assert ("outside the axes: th1_rate = 0.602" in result.output) is remarked, result.output


def test_basin_names_its_engine_and_where_a_faster_one_is_had(monkeypatch):
    arguments = ["basin", WHEEL, "--set", "friction=inf", "--over", "theta_rate=0.01,0.02"]
    result = run(*arguments)
    assert result.stdout.splitlines() == ["100.00 %  fell", f"engine {engine_choice.default_engine().name}"]
    monkeypatch.setattr(engine_choice, "find_spec", lambda name: None)
    result = run(*arguments)
    assert result.stdout.splitlines() == ["100.00 %  fell", "engine scipy"]
    assert "pip install 'gaitopt[fast]'" in result.stderr
    assert run(*arguments, "--quiet").stderr == ""


def test_what_ends_in_the_saved_gait_is_told_apart_from_others_of_its_sequence(tmp_path):
    own = ["basin", SLIP, "--over", "th1_rate=0.73,5", "--law", "lqr", "--workers", "1"]
    facts = json.loads(run(*own, "--json").stdout)
    assert facts["endings"] == ["slip+ stick | slip+", "lift_off"]
    assert facts["saved_gait"] == 0.5
    assert " 50.00 %  in the saved gait\n" in run(*own).stdout
    file = tmp_path / "basin.nc"
    assert run(*own, "-o", file).exit_code == 0
    found, gait = load_basin(file), assess_stability(load(SLIP))
    names = ("th1", "th1_rate", "th2_rate", "foot_speed")
    assert fraction_at(found, gait.state, names) == 0.5
    assert fraction_at(found.assign(final=found.final + 1e-3), gait.state, names) == 0.0
    assert fraction_at(found.assign(ending=found.ending * 0 - 1), gait.state, names) is None
    other = json.loads(run("basin", SLIP, "--over", "friction=0.14", "--workers", "1", "--json").stdout)
    assert other["saved_gait"] is None


def test_simulate_under_a_law():
    pushed = ["simulate", SLIP, "--state", "th1_rate=0.8", "--steps", 5, "--json"]
    alone, held = run(*pushed), run(*pushed, "--law", "lqr")
    assert alone.exit_code == 1
    assert held.exit_code == 0, held.output
    message = str(run("simulate", WHEEL, "--law", "lqr").exception)
    assert "--law is accepted for a saved gait only" in message
    assert "without optimisation (WalkProblem)" in message


def test_run_a_study(tmp_path):
    script = tmp_path / "tiny.py"
    script.write_text(
        "import numpy as np\nfrom matplotlib.figure import Figure\n"
        "from gaitopt.study import PublishedValue, Reproduction\n"
        "def study(value=1.0):\n"
        "    return Reproduction(Figure(), (PublishedValue('one', np.float64(value), 1.0, 1e-3, 'arithmetic'),))\n"
    )
    good = run("run", script, "-o", tmp_path / "tiny.png", "--json")
    assert good.exit_code == 0
    assert json.loads(good.stdout)["numbers"][0]["agrees"]
    assert (tmp_path / "tiny.png").exists()
    assert run("run", script, "-o", tmp_path / "tiny.png", "--set", "value=2").exit_code == 1
    unknown = run("run", script, "-o", tmp_path / "tiny.png", "--set", "value=nan", "--json")
    assert json.loads(unknown.stdout)["numbers"][0]["value"] is None
    assert unknown.exit_code == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["stability", "problems/compass_slip.py"], "run 'gaitopt solve problems/compass_slip.py' first"),
        (
            ["stability", "problems/compass_slip.py", "--law", "nope.py:f"],
            "returns a GaitProblem, not a WalkProblem; run 'gaitopt solve problems/compass_slip.py' first",
        ),
        (["solve", WHEEL], "gaitopt stability"),
        (["stability", WHEEL, "--engine", "heyoca"], "Did you mean 'heyoka'"),
        (["stability", WHEEL, "--set", "spokes=2"], "spokes must be at least 3"),
        (["stability", WHEEL, "--set", "sequence=stick | fly"], "unknown mode"),
        (["simulate", WHEEL, "--state", "thd=1"], "no coordinate 'thd'"),
        (["simulate", WHEEL, "--state", "theta_rate=fast"], "NAME=NUMBER"),
        (["simulate", WHEEL, "--set", "friction=inf", "--state", "foot_speed=0.1"], "infinite friction cannot slide"),
        (["basin", WHEEL, "--over", "theta_rate=0:1"], "NAME=FROM:TO:COUNT"),
        (["basin", WHEEL, "--over", "theta_rate=0:inf:3"], "An axis must have finite values, got 'theta_rate=0:inf:3'"),
        (
            ["basin", WHEEL, "--over", "theta_rate=0:1:9999999999"],
            "must define at most 10000000 points, got 9999999999",
        ),
        (["basin", WHEEL, "--over", "speed=0:1:3"], "no coordinate or parameter 'speed'"),
        (["basin", WHEEL, "--over", "theta_rate=1", "--state", "theta_rate=2"], "set by both --over and --state"),
        (["basin", "problems/compass_robust.py", "--over", "th1_rate=1"], "returns a RobustProblem, not a WalkProblem"),
        (["run", WHEEL], "no function study"),
        (["simulate", SLIP, "--set", "frction=1"], "no parameter 'frction'. Did you mean 'friction'?"),
        (["stability", SLIP, "--set", "friction=1"], "it is not accepted for a saved gait"),
    ],
)
def test_mistakes_are_one_sentence_and_exit_status_two(arguments, message, capsys):
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    assert stop.value.code == 2
    printed = " ".join(capsys.readouterr().err.split())
    assert message in printed
    assert "Traceback" not in printed


def test_a_saved_gait_is_simulated_on_another_ground_and_with_other_masses():
    """The contact modes follow the friction of the walk, which the law does not know."""

    def walk(*settings):
        result = run("simulate", SLIP, "--law", "lqr", "--steps", 2, "--json", *settings)
        return json.loads(result.stdout)["events"]

    planned = walk()
    assert len(planned) == 4
    assert walk("--set", "friction=0.14") == planned
    rough = walk("--set", "friction=0.16")
    slips = [[event["time"] for event in events if event["name"] == "at rest"] for events in (planned, rough)]
    assert slips[1][0] < slips[0][0]
    assert walk("--set", "hip_mass=10.5") != planned
    assert walk("--set", "slope=0.002") != planned


SCRIPTS = {"`GaitProblem`": "compass_slip", "`PlanarProblem`": "monopod", "`WalkProblem`": "rimless_wheel"}
ROWS = re.findall(r"^\| (`\w+`).*?\| (yes|no) \| (yes|no) \| (yes|no) \| (yes|no) \|$", README, re.MULTILINE)
REFUSED = [
    (command, SCRIPTS[kind])
    for kind, *cells in ROWS
    for commands, cell in zip(
        (("stability", "simulate", "basin"), ("trace",), ("tune", "push"), ("report",)), cells, strict=True
    )
    if cell == "no"
    for command in commands
]
OPTIONS = {"basin": ("--over", "a=0:1:2"), "trace": ("--over", "slope=0:0.01"), "tune": ("--law", "lqr")}


def test_the_readme_states_every_kind_of_script():
    assert [kind for kind, *_ in ROWS] == list(SCRIPTS)
    assert len(REFUSED) == 10


@pytest.mark.parametrize(("command", "script"), REFUSED)
def test_scripts_that_the_readme_excludes_are_refused(command, script):
    error = run(command, f"problems/{script}.py", *OPTIONS.get(command, ())).exception
    assert isinstance(error, GaitoptError)
    assert re.search(r"'gaitopt (solve|stability)", str(error))


def test_stability_remarks_on_another_contact_sequence_than_that_of_the_plan(command, slip_file, monkeypatch):
    assert "contact sequence" not in command("stability", slip_file).err
    monkeypatch.setattr(Cycle, "sequence", property(lambda cycle: "stick | stick"))
    run = command("stability", slip_file, "--json")
    assert (
        "The periodic gait has the contact sequence 'stick | stick', the plan 'slip+ stick | slip+': small" in run.err
    )
    assert run.json["gaits"]
