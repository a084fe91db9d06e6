"""The page on which a click on a branch point plays its gait."""

import json
import math
import re
from dataclasses import replace
from itertools import combinations, pairwise

import pytest

from gaitopt import InputError, WalkProblem, compass_biped, load_diagram
from gaitopt.report import write_branch_page
from gaitopt.report.branch_chart import ShownGait, choose_gaits, draw_diagram
from gaitopt.report.branch_page import _special_table
from gaitopt.report.page import read_asset
from tests.conftest import ROOT


def shorten_diagram():
    """Return two branches of a diagram with two gaits each, at their ends."""
    whole = load_diagram(ROOT / "docs/examples/compass_slope.nc")
    kept = [
        replace(
            branch,
            values=branch.values[[0, -1]],
            orbits=branch.orbits[[0, -1]],
            multipliers=branch.multipliers[[0, -1]],
            sequences=(branch.sequences[0], branch.sequences[-1]),
        )
        for branch in whole.branches[:2]
    ]
    return replace(whole, branches=tuple(kept), robot="<compass> & more")


@pytest.fixture(scope="module")
def diagram():
    return shorten_diagram()


@pytest.fixture(scope="module")
def page(diagram, tmp_path_factory):
    walker = WalkProblem(robot=compass_biped(), parameters=diagram.parameters)
    path = write_branch_page(diagram, walker, tmp_path_factory.mktemp("page") / "page.html")
    return path.read_text(encoding="utf-8")


@pytest.mark.slow
def test_every_point_has_its_gait_with_a_player_of_each_step(page):
    shown = re.findall(r'<circle class="branch-point" data-gait="([^"]+)"[^>]*tabindex="0"', page)
    assert shown == ["gait-0-0", "gait-0-1", "gait-1-0", "gait-1-1"]
    clickable = re.findall(r'<circle class="branch-point" data-gait="([^"]+)"', page)
    assert clickable == [*shown[:2], *[shown[2]] * 2, *[shown[3]] * 2]  # one for each step of the period
    for name in shown:
        assert len(re.findall(f'<div class="branch-gait"[^>]* id="{name}"', page)) == 1
    films = [json.loads(text) for text in re.findall(r'<script [^>]*class="film"[^>]*>(.*?)</script>', page)]
    assert len(films) == 6  # the gaits of the second branch have two steps
    assert page.count('hidden="hidden"') == 3
    periods = {round(film["period"], 6) for film in films}
    assert len(periods) >= 4
    assert all(math.isfinite(film["shift"][0]) for film in films)


def test_the_page_loads_nothing_and_escapes_its_texts(page):
    assert not re.findall(r'(?:src|href)="(?!data:|#)', page)
    assert "&lt;compass&gt; &amp; more" in page
    assert "<compass>" not in page
    assert read_asset("branches.js").splitlines()[1] in page


def test_special_points_are_marked_and_listed(page, diagram):
    special = [point for branch in diagram.branches for point in branch.special]
    assert page.count('class="special"') == 1 + 2  # one for each step of the period
    assert all(f"<td>{math.degrees(point.value):.9g}</td>" in page for point in special)


def test_the_tables_have_the_units_of_the_axes_and_no_empty_column(page, diagram):
    value = f"{math.degrees(diagram.branches[0].values[0]):.6g}"
    assert f"<h2>Branch 0, slope = {value} deg</h2>" in page
    assert "[rad]" not in page
    heads = re.findall(r'<th scope="col">(.*?)</th>', page)
    assert heads == ["no.", "branch", "kind", "slope [deg]", "sequence"]
    assert "<td></td>" not in page


def test_a_changed_sequence_has_a_column(diagram):
    (point, *_), (first, *others) = diagram.branches[0].special, diagram.branches
    changed = replace(first, special=(point, replace(point, before="stick | stick", after="slip- stick | stick")))
    cells = [cell.text for cell in _special_table(replace(diagram, branches=(changed, *others))).iter("td")]
    assert [cells[4], cells[9]] == ["the same", "slip- stick | stick"]


def test_circles_leave_the_lines_of_short_branches_visible():
    diagram = load_diagram(ROOT / "docs/examples/compass_slope.nc")
    places = choose_gaits(diagram, "th1", 8)
    counts = [sum(place.branch == number for place in places) for number in range(len(diagram.branches))]
    assert counts == [8, 8, 1, 1, 1]
    drawing = draw_diagram(diagram, "th1", [place for place in places if place.branch == 1])
    rows = [(float(part.get("cx")), float(part.get("cy"))) for part in drawing.iter("circle")]
    lower = [corner for corner in rows if corner[1] > rows[0][1]]
    assert all(math.dist(one, other) > 8 for one, other in pairwise(sorted(lower)))


def test_the_parameters_of_the_robot_are_listed(page, diagram):
    listed = page.partition("<summary>Parameters</summary>")[2].partition("</table>")[0]
    rows = re.findall(r'<th scope="row">(.*?)</th><td>(.*?)</td>', listed)
    assert ("leg length [m]", "1") in rows
    assert ("hip mass [kg]", "10") in rows
    assert len(rows) == len(diagram.parameters)
    assert "slope" not in listed


def test_numbers_of_special_points_lie_apart():
    diagram = load_diagram(ROOT / "docs/examples/compass_slope.nc")
    places = [ShownGait(k, number) for k, branch in enumerate(diagram.branches) for number in range(branch.values.size)]
    drawing = draw_diagram(diagram, "th1", places)
    numbers = [part for part in drawing.iter("text") if part.get("class") == "number"]
    assert [part.text for part in numbers] == ["1", "2", "3", "4", "5"]
    centres = [(float(part.get("x")), float(part.get("y"))) for part in numbers]
    assert all(abs(a - c) > 5 or abs(b - d) > 7 for (a, b), (c, d) in combinations(centres, 2))
    circles = [(float(part.get("cx")), float(part.get("cy"))) for part in drawing.iter("circle")]
    assert all(math.dist((x, y - 2.8), circle) > 4 for x, y in centres for circle in circles)


def test_invalid_requests_are_named(diagram, tmp_path):
    walker = WalkProblem(robot=compass_biped(), parameters=diagram.parameters)
    with pytest.raises(InputError, match="no coordinate 'th3'; they have th1"):
        write_branch_page(diagram, walker, tmp_path / "page.html", coordinate="th3")
    with pytest.raises(InputError, match="no branches to draw"):
        write_branch_page(replace(diagram, branches=()), walker, tmp_path / "page.html")


def test_gaits_of_longer_periods_have_a_colour_and_an_entry_in_the_key():
    diagram = load_diagram(ROOT / "docs/examples/compass_slope.nc")
    drawing = draw_diagram(diagram, "th1", [])
    key = ["".join(entry.itertext()) for entry in drawing.iter("span")]
    assert key == ["stick | stick", *(f"stick | stick, {steps} steps" for steps in (2, 4, 8, 16))]
    lines = {line.get("class").split()[1] for line in drawing.iter("polyline")}
    assert lines == {f"line-{number}" for number in range(5)}


def test_the_diagram_of_a_page_names_the_outcomes_of_an_impact_in_which_alone_gaits_differ(diagram):
    first = diagram.branches[0]
    branch = replace(first, sequences=("a stick | b stick", "a stick | b slip+"), special=())
    drawing = draw_diagram(replace(diagram, branches=(branch,)), first.names[0], [])
    assert {"a stick | b stick", "a stick | b slip+"} <= {"".join(part.itertext()) for part in drawing.iter()}
