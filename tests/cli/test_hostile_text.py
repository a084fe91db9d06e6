"""Texts of a gait file stay text in every output: no HTML, script, terminal escape, LaTeX, C, or table cell."""

import csv
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest

from gaitopt import save
from gaitopt.report.page import content_policy, read_asset
from tests.hostile import NAME, make_hostile, rename_robot


@pytest.fixture
def files(slip_gait, folder):
    """Write both gaits into the folder of the commands."""
    save(make_hostile(slip_gait), folder / "hostile.h5")
    save(rename_robot(slip_gait), folder / "renamed.h5")
    return folder


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:constrained_layout")  # such long names leave no room for axes
@pytest.mark.parametrize(
    "words",
    [
        "show hostile.h5",
        "show hostile.h5 --json",
        "doctor hostile.h5",
        "verify hostile.h5",
        "verify renamed.h5",
        "verify renamed.h5 --json",
        "plot hostile.h5 -o figure.svg",
        "animate hostile.h5 -o film.gif --steps 1 --slow 0.2",
        "report hostile.h5 renamed.h5 -o page.html",
        "compare hostile.h5 renamed.h5 -o figure.png",
        "export hostile.h5 -o motion.csv",
        "export hostile.h5 -o torques.json",
        "export hostile.h5 -o code.c",
        "export renamed.h5 -o code.c --law joint_pd",
        "stability hostile.h5",
        "stability renamed.h5",
        "simulate renamed.h5",
        "basin hostile.h5 --over th1=0.1,0.2 --json",
        "push hostile.h5 --json",
        "tune hostile.h5 --law joint_pd --json",
        "trace hostile.h5 --over slope=0.01:0.02",
        "sweep hostile.h5 --over friction=0.1,0.2 -o out.nc",
    ],
)
def test_every_command_prints_and_writes_text_only(files, command, words):
    before = set(files.iterdir())
    done = command(*words.split())
    assert done.status in (0, 1, 2)
    assert not re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202e\ud800-\udfff]", done.out + done.err)
    if "--json" in words:
        json.loads(done.out, parse_constant=lambda name: pytest.fail(name))
    output = words.partition("-o ")[2].split()[:1]
    assert {path.name for path in set(files.iterdir()) - before} <= {*output, "code.h", "hostile.h5", "hostile.nc"}


class Page(HTMLParser):
    """Elements of a page, with the texts of its scripts."""

    def __init__(self):
        super().__init__()
        self.found, self.scripts = [], []

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))

    def handle_data(self, data):
        tag, attributes = self.found[-1] if self.found else ("", {})
        if tag == "script":
            self.scripts.append((attributes.get("type"), data.strip()))


def test_the_report_runs_its_own_script_only(files, command):
    assert command("report", "hostile.h5", "-o", "page.html").status == 0
    page = Page()
    page.feed(Path("page.html").read_text(encoding="utf-8"))
    assert not [tag for tag, attributes in page.found if tag == "img" or any(name[:2] == "on" for name in attributes)]
    own = read_asset("player.js")
    assert {text for kind, text in page.scripts if kind != "application/json" and text} == {own.strip()}
    policy = [attributes["content"] for tag, attributes in page.found if attributes.get("http-equiv")]
    assert policy == [content_policy(own)]
    assert "script-src 'sha256-" in policy[0]
    assert "default-src 'none'" in policy[0]


def test_columns_are_identifiers_and_rows_have_as_many_cells(files, command):
    assert command("export", "hostile.h5", "-o", "motion.csv").status == 0
    with Path("motion.csv").open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    assert all(name.isidentifier() for name in head)
    assert {len(row) for row in rows} == {len(head)}


def test_the_name_of_a_robot_ends_no_comment(files, command):
    assert command("export", "renamed.h5", "-o", "code.c", "--law", "joint_pd").status == 0
    header = Path("code.h").read_text(encoding="utf-8")
    assert NAME not in header
    assert "int main(void)" in header.split("*/", 1)[0]  # within the first comment
    if compiler := shutil.which("cc"):
        subprocess.run([compiler, "-std=c99", "-fsyntax-only", "-Werror=comment", "code.c"], check=True)
