"""A mistake gets one clear sentence on stderr, exit status 2, no traceback, and leaves no file."""

import errno
import json
import math
import threading

import pytest

from gaitopt.cli import app

SLIP = "problems/compass_slip.py"


def refused(run, folder, before=(), *, said=""):
    assert run.status == 2, (run.out, run.err)
    assert run.err.startswith("Error: "), run.err
    assert run.err.count("\n") == 1, run.err
    assert said in run.err
    assert "Traceback" not in run.err
    assert sorted(path.name for path in folder.iterdir()) == sorted(before)
    return run


def test_a_setting_of_a_parameter_that_is_true_or_false(command, folder):
    (folder / "walk.py").write_text("def problem(fast=False):\n    pass\n")
    said = "fast must be True or False like its default False, got 'yes'"
    refused(command("solve", "walk.py", "--set", "fast=yes"), folder, ["walk.py"], said=said)


SETTINGS = [
    (["leg_mass=nan"], "leg_mass must be a finite number [kg], got nan"),
    (["leg_mass=-1"], "leg_mass must be greater than 0 [kg], got -1"),
    (["leg_mass=heavy"], "leg_mass must be a number like its default 4.0, got 'heavy'"),
    (["hip_mass=-0.5"], "hip_mass must be at least 0 [kg]"),
    (["gravity=inf"], "gravity must be a finite number"),
    (["leg_length=0"], "leg_length must be greater than 0 [m]"),
    (["leg_length=0.7"], "leg_com (distance of the leg's mass from its foot) must be at most leg_length = 0.7 [m]"),
    (["friction=-0.1"], "friction must be at least 0, got -0.1"),
    (["friction=0"], "friction must be greater than 0"),
    (["friction=inf"], "needs a finite friction"),
    (["torque_limit=-1"], "Limits.torque of every actuator must be at least 0 [N m], got -1"),
    (["frction=0.2"], "has no parameter 'frction'. Did you mean 'friction'?"),
    (["friction"], "--set must have the form NAME=VALUE, got 'friction'"),
    (["=0.2"], "--set must have the form NAME=VALUE"),
    (["sequence=slip+ | fly"], "The sequence 'slip+ | fly' has an unknown mode 'fly'"),
    (["sequence=stick | slip+"], "The sequence 'stick | slip+' is not periodic"),
    (["sequence=stick"], "needs exactly one '|'"),
    (["objective=cost_of_transprt"], "Did you mean 'cost_of_transport'?"),
    (["step_length=20"], "step_length 20 m is longer than the 3.2 m the robot can reach"),
    (["speed=100"], "speed 100 m/s and step_length leave at most"),
    (["speed=0.01"], "more than Limits.longest_step"),
    (["speed=0.7:0.5"], "the lower bound 0.7 must not exceed the upper bound 0.5"),
    (["speed=0.7:"], "speed must be a number like its default 0.633, bounds LOWER:UPPER, or free, got '0.7:'"),
    (["leg_mass=free"], "leg_mass must be a number like its default 4.0, got 'free'"),
    (["leg_mass=3:4"], "leg_mass must be a number like its default 4.0, got '3:4'"),
    (["transcription=shooting"], "There is no transcription 'shooting'"),
    (["speed=(0.7, 0.5)"], "the lower bound 0.7 must not exceed the upper bound 0.5"),
    (["speed=(0.7,)"], "speed must be a number, a pair (lower, upper) or None"),
    (["speed=0"], "speed must be greater than 0"),
    (["intervals=1"], "intervals must be at least 2"),
    (["intervals=2.5"], "intervals must be a whole number"),
    (["slope=100"], "slope must be at least"),
    (["slope=None"], "compass_slip.py, line"),
]


@pytest.mark.parametrize(("settings", "said"), SETTINGS, ids=[" ".join(settings) for settings, _ in SETTINGS])
def test_settings_that_cannot_be(command, root, folder, settings, said):
    arguments = [text for setting in settings for text in ("--set", setting)]
    refused(command("solve", root / SLIP, *arguments), folder, said=said)


@pytest.mark.parametrize("settings", [["leg_mass=nan"], ["sequence=slip+ | fly"], ["frction=1"]])
def test_the_same_as_a_process(process, root, folder, settings):
    arguments = [text for setting in settings for text in ("--set", setting)]
    refused(process("solve", root / SLIP, *arguments), folder)


def test_with_json_the_reason_is_an_object(command, root, folder):
    run = refused(command("solve", root / SLIP, "--set", "friction=-1", "--json"), folder)
    assert run.json == {"status": "error", "error": "friction must be at least 0, got -1."}


SCRIPTS = {
    "raises while it loads": ("import nosuchmodule\n", "own.py, line 1 raised ModuleNotFoundError"),
    "raises in problem": ("\ndef problem(a=1):\n    return 1 / 0\n", "own.py, line 3 raised ZeroDivisionError"),
    "raises on two lines": ("def problem():\n    raise ValueError('a [b]\\nc')\n", "ValueError: a [b] c"),
    "has a syntax error": ("def problem(:\n", "own.py, line 1: invalid syntax"),
    "lacks a comma": ("def problem(a=1):\n    return [a a]\n", "Perhaps you forgot a comma?\n"),
    "misspells its function": ("def problm(a=1):\n    return 3\n", "It has problm: did you mean 'problem'?"),
    "leaves": ("raise SystemExit(0)\n", "own.py, line 1 raised SystemExit"),
    "has no problem": ("x = 1\n", "own.py has no function problem(**parameters)"),
    "has a problem that is no function": ("problem = 3\n", "own.py has no function problem(**parameters)"),
    "returns something else": ("def problem():\n    return 3\n", "Family or RobustProblem; it returned int"),
    "returns nothing": ("def problem():\n    3\n", "it returned None: a return statement is missing"),
    "needs an argument": ("def problem(a):\n    return 3\n", "missing 1 required positional argument: 'a'"),
    "makes a wrong problem": (
        "from gaitopt import GaitProblem, compass_biped\n\n\ndef problem():\n"
        "    return GaitProblem(robot=compass_biped(), sequence='stick | slip+')\n",
        "The sequence 'stick | slip+' is not periodic",
    ),
    "is empty": ("", "own.py has no function problem(**parameters). 'gaitopt new NAME' writes a script that has one."),
    "defines a law": (
        "def servo(robot, motion, torque_limit):\n    return None\n",
        "It defines the law servo, which acts on a gait: 'gaitopt stability GAIT.h5 --law ",
    ),
    "defines a law by the decorator": (
        "from gaitopt.control import define_law\n\n\n@define_law\ndef servo(state, plan, k=1.0):\n    return {}\n",
        "own.py:servo' tunes its gains.",
    ),
}


@pytest.mark.parametrize("case", SCRIPTS)
def test_scripts_that_cannot_be(command, script, folder, case):
    text, said = SCRIPTS[case]
    refused(command("solve", script(text)), folder, ["own.py"], said=said)
    assert command("solve", "own.py", "--json").json["status"] == "error"


def test_errors_of_gaitopt_name_the_line_of_the_script(command, script, folder):
    text, _ = SCRIPTS["makes a wrong problem"]
    run = refused(command("solve", script(text.replace("problem()", "problem(friction=1.0)"))), folder, ["own.py"])
    assert run.err.endswith("own.py, line 5)\n")
    changed = command("solve", "own.py", "--set", "friction=0.5")
    assert "not periodic" in changed.err
    assert "line 5" not in changed.err  # a changed parameter is the more likely cause


MONOPOD = "from gaitopt.model import monopod\n\nrobot = monopod()\n"


@pytest.mark.parametrize("text", [MONOPOD, f"{MONOPOD}\n\ndef problem():\n    return robot\n"])
@pytest.mark.parametrize("verb", ["solve", "stability"])
def test_a_robot_alone_is_to_become_a_problem(command, script, folder, verb, text):
    run = refused(
        command(verb, script(text)), folder, ["own.py"], said="Robot 'monopod' is not a problem: problem() must"
    )
    assert "a PlanarWalkProblem(robot=..., section=..., coordinates=..., rates=...) for its passive gaits" in run.err
    assert run.err.rstrip().endswith("see the guide 'Stability and branches of a custom robot'.")
    assert "first" not in run.err  # `solve` refuses it


def test_a_script_with_a_robot_alone_has_no_result_that_is_to_be_solved_first(command, script):
    run = command("plot", script(f"{MONOPOD}\n\ndef problem():\n    return robot\n"), "--quiet")
    assert "own.py is a script with a robot alone, not a result." in run.err


@pytest.mark.parametrize("verb", ["solve", "sweep"])
def test_a_folder_in_place_of_a_script_names_the_command_that_lists_its_problems(command, folder, verb):
    (folder / "walks").mkdir()
    said = "walks is a folder, not a script; 'gaitopt problems walks' lists the problems in it."
    options = ("--over", "friction=0.1:0.2:2", "-o", "a.nc") if verb == "sweep" else ()
    refused(command(verb, "walks", *options), folder, ["walks"], said=said)


@pytest.mark.parametrize(
    ("text", "advice"),
    [
        (
            "def servo(robot, motion, torque_limit):\n    return None\n",
            "'gaitopt stability GAIT.h5 --law own.py:servo'",
        ),
        ("limit = 3\n", "Specify the file of a result (.h5, .nc or .json)."),
    ],
)
def test_a_script_without_a_problem_is_not_to_be_solved(command, script, text, advice):
    script(text)
    run = command("plot", "own.py", "--quiet")
    assert run.status == 2
    assert "own.py is a script without a problem, not a result. " in run.err
    assert advice in run.err
    assert "gaitopt solve" not in run.err


@pytest.mark.parametrize("verb", ["plot", "doctor"])
def test_a_script_in_place_of_a_result_is_to_be_solved_first(command, script, folder, verb):
    run = command(verb, script("def problem():\n    return 3\n"), "--quiet")
    assert run.status == (1 if verb == "doctor" else 2)
    assert "own.py is a script, not a result; solve it first: gaitopt solve " in run.err


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("a.png", "a figure"),
        ("a.gif", "an animation"),
        ("a.html", "a page"),
        ("a.csv", "a table"),
        ("a.h", "a controller in C"),
    ],
)
def test_a_drawing_in_place_of_a_result_is_to_be_opened_or_its_result_specified(command, folder, name, kind):
    (folder / name).write_bytes(b"any")
    for result in (" (.h5, .nc or .json).", ", such as a.nc."):
        run = command("plot", name, "--quiet")
        assert run.status == 2
        said = " ".join(run.err.split())
        relation = "is exported from" if name in ("a.csv", "a.h") else "shows"
        assert f"{name} is {kind}, which does not contain the result that it {relation}; open it in a" in said
        assert said.endswith(f"or specify the file of its result{result}")
        (folder / "a.nc").write_bytes(b"any")


@pytest.mark.parametrize("bytes_", [b"\xff\xfe", b"x = 1\0"])
def test_a_script_that_is_no_text(command, folder, bytes_):
    (folder / "own.py").write_bytes(bytes_)
    refused(command("solve", "own.py"), folder, ["own.py"], said="own.py")


def test_a_missing_script_of_a_law_is_not_to_be_written_by_new(command, root, folder):
    gait = root / "docs" / "examples" / "compass_slip.h5"
    said = "There is no law script laws/mylaw.py. State its path as SCRIPT.py:FUNCTION; the script of tuned gains is "
    refused(command("stability", gait, "--law", "laws/mylaw.py:servo"), folder, said=said)


def test_a_missing_script_names_the_nearest(command, script, folder):
    script("", "compass.py")
    run = refused(command("solve", "compas.py"), folder, ["compass.py"], said="There is no problem script compas.py")
    assert "Did you mean 'compass.py'?" in run.err
    run = refused(command("solve", "walker.py"), folder, ["compass.py"], said="There is no problem script walker.py")
    assert "'gaitopt problems .' lists the scripts of the folder." in run.err


def test_a_folder_or_text_file_is_no_script(command, script, folder):
    script("def problem(): pass", "notes.txt")
    refused(command("solve", "notes.txt"), folder, ["notes.txt"], said="notes.txt is not a Python script")
    refused(command("solve", folder), folder, ["notes.txt"], said="is a folder, not a script; 'gaitopt problems")


# Root may write anywhere, so a folder of the kernel stands for one that is not writable.
@pytest.mark.parametrize("output", ["/proc/gait.h5", "missing/gait.h5", ".", "gait.mat", "gait"])
def test_an_output_that_cannot_be_written_is_refused_before_the_work(command, root, folder, output):
    refused(command("solve", root / SLIP, "-o", output), folder, said=f"Cannot write {output}")
    run = command("solve", root / SLIP, "-o", output, "--json")
    assert run.json["status"] == "error"
    assert json.loads(run.out)["error"].startswith("Cannot write")


@pytest.mark.parametrize("verb", ["show", "verify", "plot", "animate"])
def test_gait_files_that_cannot_be(command, folder, slip_file, verb):
    refused(command(verb, "nope.h5"), folder, said="There is no file nope.h5")
    whole = slip_file.read_bytes()
    (folder / "gait.h5").write_bytes(whole[: len(whole) // 2])
    refused(command(verb, "gait.h5"), folder, ["gait.h5"], said="gait.h5")
    (folder / "gait.h5").write_text("not HDF5")
    refused(command(verb, "gait.h5"), folder, ["gait.h5"], said="gait.h5")
    said = "contains no ranking.json" if verb in ("show", "plot") else "is a folder"
    run = refused(command(verb, folder), folder, ["gait.h5"], said=said)
    assert "; specify a file in it, such as" in run.err


@pytest.mark.parametrize(
    "arguments",
    [
        *((verb, "slip") for verb in ("show", "verify", "plot", "tune", "push", "stability", "report", "animate")),
        ("simulate", "slip"),
        ("export", "slip", "-o", "slip.csv"),
        ("compare", "slip", "slip.h5"),
        ("basin", "slip", "--over", "th1_rate=1,2"),
        ("trace", "slip", "--over", "slope=1:2"),
    ],
)
def test_a_file_without_its_suffix_is_suggested(command, folder, arguments):
    for name in ("slip.h5", "slip.png"):
        (folder / name).touch()
    refused(command(*arguments), folder, ["slip.h5", "slip.png"], said="There is no file slip. Did you mean 'slip.h5'?")


@pytest.mark.parametrize("verb", ["show", "verify"])
def test_gait_files_that_cannot_be_as_json(command, folder, verb):
    run = refused(command(verb, "--json", "nope.h5"), folder)
    assert run.json == {"status": "error", "error": "There is no file nope.h5."}


@pytest.mark.parametrize(
    "arguments",
    [["solve"], ["solve", "a.py", "--bogus"], ["frobnicate"], ["animate", "a.h5", "--steps", "0"], ["show"]],
)
def test_usage_errors(command, folder, arguments):
    run = command(*arguments)
    assert run.status == 2
    assert "Usage: gaitopt" in run.err
    assert "Error: " in run.err
    assert "Traceback" not in run.err
    assert command(*arguments, "--json").json["status"] == "error"


def test_nothing_finite_but_nan_reaches_json(command, root):
    """JSON knows no nan: limits that are infinite are spelled as text."""
    arguments = ["--set", "torque_limit=inf", "--set", "intervals=8", "--set", "objective=torque_squared"]
    run = command("solve", root / "problems/compass_stick.py", *arguments, "--json")
    facts = json.loads(run.out, parse_constant=lambda constant: pytest.fail(f"{constant} is not JSON"))
    assert facts["problem"]["torque_limit"] == {"ankle": "inf", "hip": "inf"}
    assert math.isfinite(facts["cost_of_transport"])


def test_an_option_named_like_a_parameter_is_answered_by_how_a_parameter_is_changed(command):
    solve, doctor = (command(verb, "--friction", "0.1") for verb in ("solve", "doctor"))
    assert solve.status == doctor.status == 2
    assert "A parameter of a problem script is changed by --set friction=VALUE." in " ".join(solve.err.split())
    assert "--set" not in doctor.err


def test_a_short_option_is_not_taken_for_a_parameter(command, root):
    run = command("stability", root / "problems/rimless_wheel.py", "-o", "x.png")
    assert run.status == 2
    assert "No such option: -o" in run.err
    assert "--set" not in run.err


@pytest.mark.parametrize(
    "error",
    [
        MemoryError(),
        OSError(errno.ENOMEM, "Cannot allocate memory", "folder"),
        ImportError("x.so: failed to map segment from shared object"),
        SystemError("error return without exception set"),
    ],
)
def test_insufficient_memory_is_stated_in_a_sentence(command, monkeypatch, error):
    def fail(words):
        raise error

    monkeypatch.setattr(app, "import_commands", fail)
    done = command("show", "x.h5")
    assert (done.status, done.err.strip()) == (
        2,
        "Error: The memory is insufficient for this command: free some memory, or use fewer workers or a smaller "
        "problem.",
    )


def test_another_import_error_is_no_lack_of_memory(monkeypatch):
    monkeypatch.setattr(app, "import_commands", lambda words: __import__("no_such_module"))
    with pytest.raises(ImportError, match="no_such_module"):
        app.main(["show", "x.h5"])


def test_threads_leave_insufficient_memory_to_the_command(capsys):
    for error, expected in ((MemoryError(), False), (ValueError("bad"), True)):
        app.report_thread_error(threading.ExceptHookArgs((type(error), error, None, None)))
        assert ("Error" in capsys.readouterr().err) == expected
