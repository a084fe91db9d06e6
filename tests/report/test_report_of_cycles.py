"""Reports of periodic gaits that were simulated, not optimised."""

import json
import math
import re
from dataclasses import replace

import casadi as ca
import pytest
from matplotlib.figure import Figure

from gaitopt import InputError, PointContact, PointMass, find_cycles, rimless_wheel, write_report
from gaitopt.cli.app import main
from gaitopt.cli.script import call_script
from gaitopt.model import JointStop, PlanarCoordinates, SwitchedSpring, assemble_planar
from gaitopt.motion.animation_frames import AnimationFrames
from gaitopt.plot.scene import Scene
from gaitopt.report import show_in_notebook
from gaitopt.report.motion_charts import time_charts
from gaitopt.report.sections import cycle_card
from gaitopt.report.walker_drawing import Stage
from gaitopt.stability import find_planar_cycle
from tests.conftest import ROOT


@pytest.fixture(scope="module")
def cycles():
    wheel = find_cycles(rimless_wheel(), {"slope": 0.25, "friction": 0.6}, starts=5)[0]
    hop = next(call_script(ROOT / "problems" / "hopper.py", []).search(1))
    return {"wheel": wheel, "hopper": hop}


@pytest.fixture(scope="module")
def text(cycles, tmp_path_factory):
    path = tmp_path_factory.mktemp("cycles") / "page.html"
    return write_report(cycles, path).read_text(encoding="utf-8")


def test_the_page_has_a_player_charts_and_multipliers_of_each(text, cycles):
    films = [json.loads(film) for film in re.findall(r'class="film">(.*?)</script>', text)]
    assert [film["period"] for film in films] == [cycle.period for cycle in cycles.values()]
    assert text.count("Energy of a period") == 2
    for part in ("<h2>wheel</h2>", "<h2>hopper</h2>", "right after sole closes", "<td>0.7811</td>", "Parameters"):
        assert part in text
    assert "NaN" not in text


def test_periodic_gaits_and_optimal_ones_share_a_page(cycles, slip_gait, tmp_path):
    page = write_report({**cycles, "slip": slip_gait}, tmp_path / "page.html").read_text(encoding="utf-8")
    assert page.count("<section") == 3  # without a table of one optimal gait alone


def test_the_motion_of_a_periodic_gait_is_its_period(cycles):
    wheel = cycles["wheel"]
    assert wheel.motion.period == wheel.period
    assert str(wheel.motion.sequence()) == wheel.sequence


def test_a_notebook_shows_it(cycles):
    assert "multiplier inside" in show_in_notebook(cycles["hopper"])


def test_other_objects_are_refused(tmp_path):
    with pytest.raises(InputError, match="must be a Gait"):
        write_report({"a": 3}, tmp_path / "page.html")


@pytest.mark.parametrize("script", ["hopper", "rimless_wheel"])
def test_the_command_accepts_walking_scripts(script, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        main(["report", str(ROOT / "problems" / f"{script}.py")])
    assert end.value.code in (0, None)
    assert f"<h2>{script}</h2>" in (tmp_path / f"{script}.html").read_text(encoding="utf-8")


def test_the_command_refuses_scripts_of_optimisations(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        main(["report", str(ROOT / "problems" / "monopod.py")])
    assert end.value.code == 2
    assert "'gaitopt solve' finds its gait" in " ".join(capsys.readouterr().err.split())


def test_no_friction_cone_is_drawn_on_ground_of_infinite_friction(slipping):
    for friction, coned in ((0.14, True), (math.inf, False)):
        motion = replace(slipping.motion, parameters=slipping.motion.parameters | {"friction": friction})
        film = AnimationFrames(motion, steps=1, rate=30, slow=2.0)
        (cone,) = (part for part in Stage(film, steps=1, name="walker").draw().iter("polygon"))
        assert bool(cone.get("points")) == coned
        scene = Scene(Figure().add_subplot(), None, film)
        scene.show(film.frame(0))
        assert [cone.get_visible() for _, cone, _ in scene._contacts.values()] == [coned]
        titles = [chart.title for chart in time_charts(motion, {})]
        assert ("Force ratio and friction cone" in titles, "Force ratio" in titles) == (coned, not coned)


def test_the_facts_of_a_periodic_gait_have_units(cycles):
    facts = {row[0].text: row[1].text for row in cycle_card(cycles["wheel"]).iter("tr") if len(row) == 2}
    assert facts["theta_rate"].endswith(" rad/s")


def test_a_robot_without_a_drawing_is_drawn_by_its_bodies_at_its_size(tmp_path):
    c = PlanarCoordinates(("body", "foot"))
    body, foot = c.coordinate("body"), c.coordinate("foot")
    top, sole = ca.vertcat(0, body), ca.vertcat(0, foot)
    stop = JointStop(0.5 - (body - foot), latched=True, released_by="sole closes")
    hopper = assemble_planar(
        "hopper",
        c,
        bodies=[PointMass(8.0, top), PointMass(2.0, sole)],
        contacts={"sole": PointContact(sole), "full length": stop},
        forces=[SwitchedSpring(body - foot, 4000.0, rest=0.5, extension=0.02, contact="sole")],
    )
    hop = find_planar_cycle(hopper, [0.7, 0.2], [0, 0], {}, section="sole closes")
    text = write_report({"hop": hop}, tmp_path / "hop.html").read_text(encoding="utf-8")
    film = json.loads(re.search(r'class="film">(.*?)</script>', text).group(1))
    first = film["frames"][0]
    height = first["foot"][0][1] - min(y for _, y in first["joints"])
    assert height == pytest.approx(0.5 / 0.7 * 360, rel=0.1)  # the body is at 0.5 m and rises to 0.7 m
    # The foot has no slide coordinate, so no tangential force.
    assert '<polygon class="cone" points=""' in text
    assert "friction cone</span>" not in text
