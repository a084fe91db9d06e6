"""gaitopt report."""

import shutil


def test_a_report_of_one_gait_is_named_after_it(command, slip_file, folder):
    run = command("report", slip_file)
    assert run.status == 0
    assert "wrote compass_slip.html" in run.out
    assert "<h2>compass_slip</h2>" in (folder / "compass_slip.html").read_text(encoding="utf-8")


def test_gaits_of_one_name_are_told_apart_by_their_folders(command, slip_file, folder):
    (folder / "other").mkdir()
    for path in ("compass_slip.h5", "other/compass_slip.h5"):
        shutil.copy(slip_file, folder / path)
    assert command("report", "compass_slip.h5", "other/compass_slip.h5", "--title", "Both").status == 0
    page = (folder / "report.html").read_text(encoding="utf-8")
    for title in ("<h1>Both</h1>", "<h2>compass_slip.h5</h2>", "<h2>other/compass_slip.h5</h2>"):
        assert title in page


def test_mistakes_in_a_report(command, slip_file):
    assert command("report", "missing.h5").status == 2
    assert f"got {slip_file} twice" in command("report", slip_file, slip_file).err
    assert "does not exist" in command("report", slip_file, "-o", "nowhere/report.html").err
