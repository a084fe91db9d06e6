"""The report in headless Chromium: it plays, is scrubbed by mouse and keys, fits every screen, and never complains."""

import re
from importlib.resources import files
from itertools import combinations, pairwise

import numpy as np
import pytest

from gaitopt import write_report
from gaitopt.report.chart import Chart, Curve
from gaitopt.report.markup import to_html
from tests.hostile import NAME, TEXT, make_hostile


def wait_until(page, condition):
    """Wait for a condition in JavaScript, without evaluating a text in the page, which its policy forbids."""
    for _ in range(200):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(50)
    raise AssertionError(condition)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("viewport", ["phone", "desktop"])
def test_the_page_fits_the_screen(open_page, viewport, scheme):
    opened = open_page(viewport, scheme)
    width, inner = opened.page.evaluate("[document.documentElement.scrollWidth, innerWidth]")
    assert width == inner, "the page must not scroll sideways"
    stage = opened.first(".stage").bounding_box()
    assert stage["width"] > 300
    assert stage["height"] > 200
    controls = opened.first(".play").bounding_box()
    assert min(controls["width"], controls["height"]) >= 40, "a finger must hit it"


@pytest.mark.slow
def test_light_and_dark_differ_and_can_be_read(open_page):
    contrast = {}
    for scheme in ("light", "dark"):
        page = open_page(scheme=scheme).page
        ink, ground = page.evaluate(
            "[getComputedStyle(document.querySelector('td')).color, getComputedStyle(document.body).backgroundColor]"
        )
        contrast[scheme] = luminance(ink), luminance(ground)
    assert contrast["light"][0] < contrast["light"][1]
    assert contrast["dark"][0] > contrast["dark"][1]
    for ink, ground in contrast.values():
        light, dark = max(ink, ground), min(ink, ground)
        assert (light + 0.05) / (dark + 0.05) > 7  # WCAG 2, level AAA


def luminance(color):
    """Return the relative luminance of ``rgb(r, g, b)``, as WCAG 2 defines it."""
    parts = [int(part) / 255 for part in re.findall(r"\d+", color)[:3]]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("largest", [0.05, 0.4, 8.0, 1500.0])
def test_the_label_of_an_axis_and_the_numbers_at_its_ticks_lie_apart(browser, largest):
    line = Curve(label="ratio", x=(np.array([0.0, 1.0]),), y=(largest * np.array([-1.0, 1.0]),))
    chart = Chart(title="ratio", x_label="time [s]", y_label="a label as long as the axis", unit="", lines=[line])
    page = browser.new_page()
    styles = "".join((files("gaitopt.report") / "assets" / name).read_text() for name in ("page.css", "parts.css"))
    page.set_content(f"<style>{styles}</style><div class='gaitopt'>{to_html(chart.draw())}</div>")
    boxes = page.evaluate(
        "[...document.querySelectorAll('svg text')].map(text => text.getBoundingClientRect().toJSON())"
    )
    page.close()
    assert len(boxes) > 8
    for one, other in combinations(boxes, 2):
        beside = one["right"] <= other["left"] or other["right"] <= one["left"]
        assert beside or one["bottom"] <= other["top"] or other["bottom"] <= one["top"], (one, other)


def test_no_area_below_the_player_is_blank(open_page):
    """The player, the facts and the charts are stacked in two columns; phones have one."""
    page = open_page().page
    boxes = page.evaluate(
        "[...document.querySelector('.columns').children].map(part => part.getBoundingClientRect().toJSON())"
    )
    edges = sorted({round(box["left"]) for box in boxes})
    assert len(edges) == 2
    for left in edges:
        stacked = sorted((box for box in boxes if round(box["left"]) == left), key=lambda box: box["top"])
        gaps = [below["top"] - above["bottom"] for above, below in pairwise(stacked)]
        assert gaps == pytest.approx([16.0] * len(gaps), abs=1)


def test_scrubbing_moves_the_walker_the_sequence_and_the_charts(open_page):
    opened = open_page()
    before = opened.stage(), opened.first("figure.chart output").inner_text()
    assert opened.first(".token.now").inner_text() == "slip+"
    opened.slide_to(60)
    after = opened.stage(), opened.first("figure.chart output").inner_text()
    assert before[0] != after[0]
    assert before[1] != after[1]
    assert opened.first(".token.now").inner_text() == "stick"
    assert "t = 0." in opened.first(".stamp").inner_text()


def test_the_second_step_goes_on_where_the_first_ended_with_the_legs_swapped(open_page):
    opened = open_page()
    last = int(opened.first(".time").get_attribute("max"))
    opened.slide_to(last // 2)
    swing = opened.first(".link.swing").evaluate("line => [+line.getAttribute('x2'), +line.getAttribute('y2')]")
    assert not opened.first(".stage.swapped").count()
    opened.slide_to(last // 2 + 1)
    foot = opened.first(".link.stance").evaluate("line => [+line.getAttribute('x1'), +line.getAttribute('y1')]")
    assert opened.first(".stage.swapped").count()
    assert foot == pytest.approx(swing, abs=8)  # a frame apart [px]
    assert opened.page.locator("section:has(.mark) .mark.made").count() == 2


def test_the_button_plays_and_pauses(open_page):
    opened = open_page()
    opened.first(".play").click()
    wait_until(opened.page, "document.querySelector('.time').value > 10")
    opened.first(".play").click()
    assert opened.first(".play").get_attribute("aria-label") == "Play"
    here = opened.first(".time").input_value()
    opened.page.wait_for_timeout(100)
    assert opened.first(".time").input_value() == here


def test_everything_can_be_done_by_keys(open_page):
    opened = open_page()
    keyboard = opened.page.keyboard
    for _ in range(20):
        keyboard.press("Tab")
        if opened.page.evaluate("document.activeElement.className") == "play":
            break
    keyboard.press("Enter")
    wait_until(opened.page, "document.querySelector('.time').value > 5")
    keyboard.press("ArrowRight")
    assert opened.first(".play").get_attribute("aria-label") == "Play"
    keyboard.press("Tab")
    assert opened.page.evaluate("document.activeElement.className") == "time"
    keyboard.press("Home")
    assert opened.first(".time").input_value() == "0"
    keyboard.press("ArrowRight")
    assert opened.first(".time").input_value() == "1"
    assert "seconds" in opened.first(".time").get_attribute("aria-valuetext")
    keyboard.press(" ")
    wait_until(opened.page, "document.querySelector('.time').value > 5")


def test_it_stops_at_the_end_and_starts_again(open_page):
    opened = open_page()
    last = opened.first(".time").get_attribute("max")
    opened.slide_to(int(last) - 3)
    opened.first(".play").click()
    wait_until(opened.page, f"document.querySelector('.time').value == {last}")
    wait_until(opened.page, "document.querySelector('.play').getAttribute('aria-label') == 'Play'")
    opened.first(".play").click()
    wait_until(opened.page, f"document.querySelector('.time').value < {last}")


def test_two_players_do_not_disturb_each_other(open_page):
    opened = open_page()
    opened.slide_to(40)
    assert [slider.input_value() for slider in opened.page.locator(".time").all()] == ["40", "0"]


def test_names_are_texts(open_page):
    opened = open_page()
    assert opened.page.title() == "Two gaits & more"
    assert opened.page.locator("h2").all_inner_texts() == ["Comparison", "slipping", "sticking <b>"]


def test_texts_of_a_hostile_gait_run_no_script(open_page, slip_gait, tmp_path):
    file = write_report({NAME: make_hostile(slip_gait)}, tmp_path / "hostile.html", title=TEXT)
    opened = open_page(file=file)
    assert opened.page.title() != "run"
    assert opened.page.locator("img").count() == 0
    opened.first(".play").click()
    wait_until(opened.page, "document.querySelector('.time').value > 5")


def test_the_policy_of_the_page_refuses_inserted_scripts(open_page, report_file, tmp_path):
    text = report_file.read_text(encoding="utf-8")
    file = tmp_path / "changed.html"
    file.write_text(text.replace("<main>", "<main><script>document.title='run'</script>"), encoding="utf-8")
    opened = open_page(file=file)
    assert opened.page.title() != "run"
    assert len(opened.complaints) == 1
    assert "Content Security Policy" in opened.complaints.pop()
