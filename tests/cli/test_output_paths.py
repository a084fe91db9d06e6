"""The output of a command replaces neither its input nor a script, and no device."""

import shutil

import pytest


@pytest.fixture
def gait(folder, slip_file):
    return shutil.copy(slip_file, folder / "gait.h5")


@pytest.mark.parametrize(
    "words",
    [
        "report gait.h5 -o gait.h5",
        "report gait.h5 -o ./gait.h5",
        "report gait.h5 -o link.h5",
        "export gait.h5 -o gait.h5",
        "tune gait.h5 -o gait.h5",
        "verify gait.h5 -o link.h5",
        "simulate gait.h5 -o gait.h5",
        "solve problem.py -o problem.py",
        "solve problem.py -o problem.h5",
        "sweep problem.py --over friction=0.1,0.2 -o problem.py",
        "basin gait.h5 --over theta_rate=1,2 -o gait.h5",
        "simulate gait.h5 --law problem.py:law -o problem.h5",
        "compare gait.h5 other.h5 -o other.h5",
        "compare gait.h5 other.h5 --problem problem.py -o problem.h5",
    ],
)
def test_an_input_is_not_replaced(folder, root, command, gait, words):
    shutil.copy(gait, folder / "other.h5")
    script = shutil.copy(root / "problems/compass_stick.py", folder / "problem.py")
    (folder / "problem.h5").symlink_to(script)
    (folder / "link.h5").symlink_to(gait)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    done = command(*words.split())
    assert done.status == 2
    assert "is an input of this command; choose another file with -o" in done.err
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_another_script_and_a_device_are_not_replaced(folder, command, gait):
    script = folder / "other.py"
    script.write_text("precious = True\n")
    done = command("report", gait, "-o", script)
    assert done.status == 2
    assert "suffix '.py' is that of a script" in done.err
    assert script.read_text() == "precious = True\n"
    done = command("report", gait, "-o", "/dev/null")
    assert done.status == 2
    assert "it is a device" in done.err
