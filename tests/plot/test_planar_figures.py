"""Figures of robots with several contacts: every foot, stop, mode and flight is drawn."""

import functools
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from matplotlib.figure import Figure

from gaitopt import FigureStyle, InputError, animate, load, plot_gait, simulate
from gaitopt.cli.script import call_script
from gaitopt.model import (
    PlanarCoordinates,
    PointContact,
    PointMass,
    Terrain,
    adapt_to_uneven_ground,
    assemble_planar,
)
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
from gaitopt.model.robots.monopod import monopod
from gaitopt.model.robots.round_foot_walker import round_foot_walker
from gaitopt.model.robots.vertical_hopper import vertical_hopper
from gaitopt.motion.kinematic_motion import PhaseKinematics, make_kinematic_motion
from gaitopt.motion.motion_view import MotionView
from gaitopt.motion.printable import show_minus
from gaitopt.motion.view_motion import view_motion
from gaitopt.parameters import Parameter
from gaitopt.plot import plot_motion
from gaitopt.plot.contact_forces import FORCE_LABEL
from gaitopt.plot.ground_line import find_profile
from gaitopt.plot.mode_bar import draw_mode_bar
from gaitopt.plot.panels import foot_style, short_slips
from gaitopt.plot.stick_figures import choose_instants, draw_stick_figures
from gaitopt.plot.style import MODE_FILL, PATCH, leg_color
from gaitopt.report.motion_charts import time_charts
from gaitopt.simulation import place_planar, simulate_planar
from tests.conftest import ROOT
from tests.plot.test_gait_figure import axes_of, check_texts, draw, every_text
from tests.simulation.planar_examples import heel_toe_walker

PROBLEMS = Path(__file__).parents[2] / "problems"


draw_motion = functools.cache(plot_motion)
"""Figures of motions, each drawn once for all tests, which do not change them."""


def period_of(script):
    return next(call_script(PROBLEMS / script, []).search(1)).motion


@pytest.fixture(scope="module")
def kneed():
    return period_of("kneed_walker.py")


@pytest.fixture(scope="module")
def hopper():
    return period_of("hopper.py")


@pytest.fixture(scope="module")
def both_feet():
    """Two feet that slide apart and one of them forward, then backward."""
    robot, th = compass_with_two_feet(), 0.5
    q = [0, 1.6 * np.cos(th), -th, th]
    v = [1.6 * np.cos(th), -1.6 * np.sin(th), -1, 0.5]
    return simulate_planar(robot, q, v, {"friction": 0.3}, duration=0.25).motion


def labels(axes):
    return [text.get_text() for text in axes.get_yticklabels()]


@pytest.mark.slow
def test_panels_of_a_hop_are_those_of_its_units_and_contacts(hop_gait, title_of):
    axes = axes_of(draw(hop_gait))
    expected = [
        "modes",
        "angles",
        "lengths",
        "torques",
        "actuator forces",
        "normal forces",
        "force ratio",
    ]
    assert [name for name in axes if name in expected] == expected
    assert "foot speed" not in axes  # no contact slips
    assert axes["actuator forces"].get_ylabel() == "force [N]"
    assert labels(axes["modes"]) == ["foot"]
    assert "flight" in [text.get_text() for text in axes["modes"].texts]
    assert "flight" in [text.get_text() for text in axes["stick figures"].texts]
    assert "'foot stick > flight |' (verified by replay)" in draw(hop_gait).get_suptitle()
    assert "'foot stick > flight |' (not replayed)" in title_of(replace(hop_gait, verification=None))


@pytest.mark.slow
@pytest.mark.parametrize("width", [3.5, 7.2])
def test_labels_of_eight_panels_lie_apart(hop_gait, width):
    stance, flight = hop_gait.motion.segments
    slip = replace(stance, state=ContactState.of(dict(stance.state.modes) | {"foot": Mode.SLIP_FORWARD}))
    gait = replace(hop_gait, motion=replace(hop_gait.motion, segments=(slip, flight)))
    figure = plot_gait(gait, title="a\nlong title", style=FigureStyle(width=width))
    figure.draw_without_rendering()
    panels = [axes for axes in figure.axes if axes.get_ylabel() and "enlarged" not in axes.get_label()]
    assert len(panels) == 7  # besides the modes
    boxes = [axes.yaxis.label.get_window_extent() for axes in panels]
    assert all(upper.y0 > lower.y1 for upper, lower in pairwise(boxes))
    assert figure.get_figheight() <= (7.8 if width < 7 else 9.0)


def test_every_foot_shows_its_force_its_cone_and_its_mode(both_feet):
    axes = axes_of(draw_motion(both_feet, title="both_feet", style=FigureStyle(width=7.2)))
    assert labels(axes["modes"]) == ["foot A", "foot B"]
    for name in ("normal forces", "force ratio", "foot speed"):
        colors = [line.get_color() for line in axes[name].lines[:2]]
        assert colors == [leg_color(0), leg_color(1)], name
    bars = {patch.get_gid() for patch in axes["modes"].patches}
    assert {"slip+", "slip-"} <= bars
    ratio = axes["force ratio"].lines[0].get_ydata()
    np.testing.assert_allclose(np.abs(ratio[np.isfinite(ratio)]), 0.3, rtol=1e-6)
    slides = [text.get_text() for text in axes["stick figures"].texts if "mm" in text.get_text()]
    assert slides[0].startswith("foot A\n\N{RIGHTWARDS ARROW} 0.3")
    assert len(slides) == 4


def test_no_force_is_drawn_while_a_foot_is_in_the_air(hop_gait):
    view, line = view_motion(hop_gait.motion), axes_of(draw(hop_gait))["normal forces"].lines[0]
    time, force = line.get_data()
    flight = (time > view.segments[1].time[0]) & np.isfinite(time)
    assert np.isnan(force[flight]).all()
    assert force[~flight & np.isfinite(force)].max() > 1


def test_joint_stops_are_drawn_among_the_angles_and_in_the_mode_bar(kneed):
    axes = axes_of(draw_motion(kneed, title="kneed", style=FigureStyle(width=7.2)))
    assert labels(axes["modes"]) == ["foot A", "knee A", "knee B"]
    assert "joint stop" in axes["angles"].get_legend_handles_labels()[1]
    levels = [line.get_ydata()[0] for line in axes["angles"].lines if len(line.get_ydata()) == 2]
    assert levels == pytest.approx([0.0], abs=1e-9)
    latched = [patch for patch in axes["modes"].patches if patch.get_gid() == "latched"]
    assert len(latched) == 2


def test_a_stop_of_two_coordinates_shows_its_gap(hopper):
    axes = axes_of(draw_motion(hopper, title="hopper", style=FigureStyle(width=7.2)))
    assert "full length, gap" in axes["lengths"].get_legend_handles_labels()[1]
    assert "force ratio" not in axes  # its sole has no tangential force


def test_round_feet_have_arcs_joined_to_their_legs():
    values = {"gravity": 1.0, "slope": 0.01}
    coordinates, rates = {"x": 0, "a": 0.19, "b": -0.19}, {"a": -0.24, "b": -0.19}
    q, v = place_planar(round_foot_walker(), coordinates, rates, values, on=("foot A",))
    figure = plot_motion(simulate_planar(round_foot_walker(), q, v, values, until="foot B closes").motion)
    lines = axes_of(figure)["stick figures"].lines
    assert sum(len(line.get_xdata()) == 49 for line in lines) == 2 * 9
    assert "modes" not in axes_of(figure)  # one foot on the ground, as in figures of other walkers


def test_a_robot_without_links_is_drawn_as_its_points(tmp_path):
    ball = drop_ball()
    axes = axes_of(plot_motion(ball))["stick figures"]
    heights = [line.get_ydata()[0] for line in axes.lines if line.get_marker() == "o"]
    assert max(heights) == pytest.approx(0.2)
    assert animate(ball, tmp_path / "ball.gif", steps=1, fps=4, slow=1.0).exists()


def drop_ball():
    """Return the fall of a point mass."""
    gravity = Parameter("gravity", 9.81, "m/s^2", "gravity")
    c = PlanarCoordinates(("height",), [gravity])
    place = ca.vertcat(0, c.coordinate("height"))
    ball = assemble_planar("ball", c, bodies=[PointMass(1.0, place)], contacts={"ground": PointContact(place)})
    return simulate_planar(ball, [0.2], [0], {}, duration=0.4).motion


def test_every_mode_has_a_colour():
    assert set(MODE_FILL) == set(Mode) - {Mode.ANY}


@pytest.mark.parametrize("width", [7.2, 3.5])
@pytest.mark.parametrize("name", ["kneed", "hopper", "both_feet"])
def test_texts_of_motions_are_large_enough_inside_the_page_and_apart(name, width, request):
    check_texts(draw_motion(request.getfixturevalue(name), title=name, style=FigureStyle(width=width)))


@pytest.mark.parametrize("width", [7.2, 3.5])
def test_a_phase_with_slips_in_both_directions_has_a_shading_of_neither(both_feet, width):
    axes = axes_of(draw_motion(both_feet, title="both_feet", style=FigureStyle(width=width)))
    shades = [patch.get_gid() for patch in axes["angles"].patches if patch.get_gid()]
    assert shades == ["slip+", "slip+ slip-"]
    key = axes["modes"] if width < 5 else axes["modes key"]
    labels_of_key = [text.get_text() for text in key.get_legend().get_texts()]
    assert [text.replace("\n", " ") for text in labels_of_key] == ["slip+ phase", "slip+ and slip\N{MINUS SIGN} phase"]
    fills = {MODE_FILL[mode] for mode in (Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD)}
    both = next(patch for patch in axes["angles"].patches if patch.get_gid() == "slip+ slip-")
    assert not any(same_color(both.get_facecolor()[:3], fill) for fill in fills)


def test_slips_of_rounding_errors_are_neither_enlarged_nor_stated_exactly(both_feet):
    """A simulation that jams may end with a phase that is shorter than any time of interest."""
    view = view_motion(both_feet)
    assert len(short_slips(view)) == 1
    first, *others = view.segments
    start = {name: value[..., :1] for name, value in vars(first).items() if isinstance(value, np.ndarray)}
    start = {name: np.concatenate([value, value], axis=-1) for name, value in start.items()}
    start |= {name: start[name] + [0, 1e-12] for name in ("time", "slides")}
    view = replace(view, segments=(replace(first, **start), *others))
    assert short_slips(view) == []
    axes = Figure().add_subplot()
    draw_stick_figures(axes, view)
    texts = [text.get_text() for text in axes.texts if "mm" in text.get_text()]
    assert texts[0] == "foot A\n\N{RIGHTWARDS ARROW} < 0.001 mm"


def test_a_sample_is_drawn_once_where_a_flight_has_few(hopper):
    instants = choose_instants(hopper)
    assert len({(id(instant.segment), instant.sample) for instant in instants}) == len(instants) < 9
    (body, *_) = axes_of(draw_motion(hopper, title="hopper", style=FigureStyle(width=7.2)))["lengths"].lines
    time, height = body.get_data()
    inside = time > hopper.segments[-1].time[0]
    fall = np.polynomial.Polynomial.fit(time[inside], height[inside], 2)
    assert inside.sum() > 3 * hopper.segments[-1].time.size
    assert fall.convert().coef[2] == pytest.approx(-9.81 / 2, rel=1e-6)
    np.testing.assert_allclose(fall(time[inside]), height[inside], atol=1e-9)


def test_modes_of_phases_too_short_for_their_names_are_in_the_legend(hop_gait):
    for width, labels_of_bars in ((7.2, []), (1.2, ["stick"])):
        axes = Figure(figsize=(width, 1.0)).add_subplot()
        draw_mode_bar(axes, view_motion(hop_gait.motion))
        assert axes.get_legend_handles_labels()[1] == labels_of_bars


def test_a_contact_and_its_mode_are_on_one_line_of_the_title(hop_gait, title_of):
    sequence = "heel A stick, toe B stick > heel A stick | heel A stick, toe A stick > toe A stick |"
    title = f"{sequence}\nslip+ stick slip- | stick"
    for width in (2.5, 3.5, 5.0):
        lines = title_of(hop_gait, title=title, style=FigureStyle(width=width)).splitlines()
        assert " ".join(lines).startswith(show_minus(title.replace("\n", " ")))
        assert not any(line.startswith(("stick,", "stick >", "stick |", "A ", "B ", "|")) for line in lines)


def test_the_sequence_has_at_most_two_lines_of_the_title(title_of):
    gait = load(ROOT / "tests/problems/bounding_quadruped.h5")
    narrowest, narrow, wide = (title_of(gait, style=FigureStyle(width=width)).splitlines() for width in (2.0, 3.5, 7.2))
    assert [len(narrow), len(wide)] == [5, 4]
    assert narrow[4] == r"step length 0.8 m, friction $\mu$ = 0.8"
    assert " ".join(narrow[1:3]) == f"'{gait.sequence}' (verified)"
    assert " ".join(narrowest[1:3]).endswith("\N{HORIZONTAL ELLIPSIS} (verified)")
    assert narrowest[1].startswith("back foot stick")
    assert wide[1] == f"'{gait.sequence}' (verified by replay)"


@pytest.mark.parametrize("duration", [0.75, 5.0])
def test_times_stand_below_the_feet_and_flight_below_a_foot_in_the_air(duration):
    walk = simulate_planar(vertical_hopper(), [0.7, 0.2], [0, 0], {}, duration=duration).motion
    axes = Figure(figsize=(7.2, 2.4)).add_subplot()
    draw_stick_figures(axes, walk)
    places = [text.xy[0] for text in axes.texts if text.get_text().endswith(" s")]
    legs = [line for line in axes.lines if line.get_linewidth() == 2.6]
    np.testing.assert_allclose(places, [leg.get_xdata()[0] for leg in legs], atol=1e-9)
    flights = {text.xy[0] for text in axes.texts if text.get_text() == "flight"}
    assert flights
    assert flights <= {place for place, leg in zip(places, legs, strict=True) if min(leg.get_ydata()) > 1e-3}


def same_color(one, other):
    from matplotlib.colors import to_rgb

    return np.allclose(to_rgb(one), to_rgb(other), atol=1e-3)


def test_the_axis_of_normal_forces_has_space_above_the_largest(kneed):
    """The space is a share of the whole axis, so that the line of a nearly constant force is not at its end."""
    figure = plot_motion(kneed, style=FigureStyle(width=3.5, font_size=8, titled=False))
    (axes,) = (axes for axes in figure.axes if axes.get_label() == "normal forces")
    low, high = axes.get_ylim()
    assert low == 0
    assert high > 1.04 * max(np.nanmax(line.get_ydata()) for line in axes.lines)


@pytest.mark.slow
def test_texts_of_a_gait_are_large_enough_inside_the_page_and_apart(hop_gait):
    check_texts(draw(hop_gait))
    narrow = plot_gait(hop_gait, style=FigureStyle(width=3.5, titled=False))
    assert every_text(narrow)


def test_the_mark_of_a_foot_on_inclined_ground_is_at_its_leg(compass):
    """The slide is along the ground, and the figure shows positions along and across the plane."""
    robot, count = adapt_to_uneven_ground(compass), 3
    q = np.array([[0.0, 0.1, 0.2], [0.0] * 3, [0.1] * 3, [-0.1] * 3])
    phase = PhaseKinematics(
        mode=Mode.SLIP_FORWARD, time=np.arange(3.0), q=q, v=np.ones((4, count)), torque=np.zeros((2, count))
    )
    motion = make_kinematic_motion(robot, {"incline": 0.2, "friction": 0.5}, [phase])
    part, foot = view_motion(motion).segments[0], view_motion(motion).foot_points[0]
    np.testing.assert_allclose(part.places[:, 0], part.points[:, foot], atol=1e-12)
    assert part.places[1, 0, -1] == pytest.approx(0.2 * np.sin(0.2))


def test_a_view_of_a_view_is_itself(slip_gait):
    view = view_motion(slip_gait.motion)
    assert isinstance(view, MotionView)
    assert view_motion(view) is view


@pytest.fixture(scope="module")
def uneven():
    """A compass in flight and after its landing on a lower step with a patch."""
    terrain = Terrain(steps=[(0.0, -0.05)], patches=[(0.1, 0.6, 0.3)])
    ground = {"friction": 0.6, "terrain": terrain}
    return simulate_planar(compass_with_two_feet(), [0, 1.7, -0.2, 0.3], [0.5, 0, 0, 0], ground, duration=0.3).motion


def test_terrain_is_drawn_below_each_figure(uneven):
    axes = plot_motion(uneven).axes[0]
    lines = [line.get_xydata() for line in axes.lines if line.get_zorder() < 2 and len(line.get_xydata()) > 1]
    rises = [np.ptp(xy[:, 1]) for xy in lines]
    assert max(rises) == pytest.approx(0.05)
    assert any(line.get_color() == PATCH for line in axes.lines)
    assert "patch" in [text.get_text() for text in axes.get_legend().get_texts()]
    profile = find_profile(uneven.terrain, -1.0, 1.0)
    np.testing.assert_allclose(profile, [[-1, 0, 0, 0.1, 0.1, 0.6, 0.6, 1], [0, 0, *[-0.05] * 6]])


def test_the_force_ratio_is_not_drawn_where_the_normal_force_is_a_rounding_error(both_feet):
    number = next(i for i, part in enumerate(both_feet.segments) if np.ptp(part.force[0, 1]) > 0)
    force = both_feet.segments[number].force.copy()
    force[0, :, -1] = 5e-12, 2e-13  # at a lift-off
    segments = list(both_feet.segments)
    segments[number] = replace(segments[number], force=force)
    motion = replace(both_feet, segments=tuple(segments))
    axes = axes_of(plot_motion(motion))["force ratio"]
    largest = max(np.nanmax(np.abs(line.get_ydata())) for line in axes.lines if len(line.get_ydata()))
    assert largest < 2
    assert axes.get_ylim()[1] < 3
    chart = next(chart for chart in time_charts(motion, {}) if chart.title == "Force ratio and friction cone")
    assert max(np.max(np.abs(y), initial=0.0) for line in chart.lines for y in line.y) < 2


def test_motions_that_cannot_be_drawn_are_refused():
    still = simulate_planar(monopod(), [0, 0.7, 0, 0, 0.6], [0, 0, 0, 0, 0], {}, duration=0.1).motion
    with pytest.raises(InputError, match="has no duration"):
        plot_motion(still.__class__(**{**vars(still), "segments": ()}))
    with pytest.raises(InputError, match="motion must be"):
        view_motion("walk")


def test_heel_and_toe_of_a_foot_have_the_colour_of_their_leg_and_dashes_of_their_own():
    angles, rates, ground = (
        {"x": 0, "a": 0.279, "b": -0.329},
        {"a": -1.184, "b": -0.718},
        {"slope": 0.04, "friction": 2.0},
    )
    robot = heel_toe_walker()
    q, v = place_planar(robot, angles, rates, ground, on=["heel a"])
    view = view_motion(simulate_planar(robot, q, v, ground, until="heel b closes").motion)
    assert [(contact.name, contact.leg, contact.leg_number) for contact in view.contacts] == [
        ("heel a", "foot a", 0),
        ("toe a", "foot a", 0),
        ("heel b", "foot b", 1),
        ("toe b", "foot b", 1),
    ]
    heel, toe = (foot_style(view, foot) for foot in (0, 1))
    assert heel["color"] == toe["color"] == leg_color(0)
    assert heel["linestyle"] != toe["linestyle"]


def test_no_force_of_a_stick_figure_extends_above_the_walker(hop_gait, slipping):
    for gait, limited in ((hop_gait, True), (slipping, False)):
        axes = Figure().add_subplot()
        draw_stick_figures(axes, gait.motion)
        forces = [line.get_ydata() for line in axes.lines if line.get_label() == FORCE_LABEL]
        view = view_motion(gait.motion)
        height = max(float(np.ptp(part.points[1], axis=0).max()) for part in view.segments)
        assert len(forces) > 1
        longest = max(float(np.ptp(force)) for force in forces)
        assert longest <= 1.01 * height
        assert (longest > 0.9 * height) == limited  # a force equal to the weight is 0.3 times as long as the walker


def test_labels_of_slides_that_lie_apart_are_level(wheel):
    parameters = {"spokes": 10.0, "slope": np.radians(13.0), "friction": 0.3}
    states = (np.array([0, 0, -np.pi / 10]), np.array([0, 0, 2.375]))  # close to its periodic gait
    motion = simulate(wheel, *states, parameters, steps=4).motion
    axes = axes_of(plot_motion(motion, style=FigureStyle(width=3.5)))["stick figures"]
    slides = [text for text in axes.texts if "mm" in text.get_text()]
    assert len(slides) == 4
    assert len({text.get_position()[1] for text in slides}) == 1
