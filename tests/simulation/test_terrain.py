"""Steps in height and patches of friction: against an integration by hand, and the events at their edges."""

import math

import numpy as np
import pytest

from gaitopt import Stop
from gaitopt.errors import InputError
from gaitopt.model import Ground, Terrain, compass_biped, compass_with_two_feet, round_foot_walker
from gaitopt.simulation import place_planar, simulate_planar
from gaitopt.stability import find_planar_cycle
from tests.newton_euler.compass_on_terrain import CompassOnTerrain
from tests.simulation.planar_examples import box, heel_toe_walker

COMPASS = compass_with_two_feet()
SLOPE = math.radians(3.0)
FOOT, STEP = 0.34163100830641796, 0.6832620166128373  # place of the first foot and step length of the gait below [m]
GAIT = {"a": 0.2151760075240752, "b": -0.2151760075240752}, {"a": -0.873174387834394, "b": -0.2274734343382672}
"""Periodic gait of the compass down a slope of 3 degrees, right after a landing (find_planar_cycle)."""

WALKS = {
    "step down": (0.6, [(FOOT + 0.3, -0.02)], []),
    "step up": (0.6, [(FOOT + 0.3, 0.004)], []),
    "slides out of a slippery patch, then down a step": (
        0.6,
        [(FOOT + STEP + 0.2, -0.01)],
        [(FOOT + 0.5 * STEP, FOOT + STEP + 0.01, 0.03)],
    ),
    "slides from one patch to the next": (
        0.6,
        [],
        [(FOOT + 0.3, FOOT + STEP + 0.004, 0.05), (FOOT + STEP + 0.004, FOOT + STEP + 0.008, 0.02)],
    ),
    "lands on a patch on a lower step": (0.6, [(FOOT + 0.3, -0.015)], [(FOOT + STEP - 0.3, FOOT + STEP + 0.04, 0.05)]),
}


def start(parameters):
    return place_planar(COMPASS, {"x": 0, **GAIT[0]}, GAIT[1], parameters, on=["foot A"])


@pytest.mark.parametrize(("friction", "steps", "patches"), WALKS.values(), ids=WALKS)
def test_the_compass_agrees_with_equations_written_by_hand(friction, steps, patches):
    ground = Ground(slope=SLOPE, friction=friction, terrain=Terrain(steps=steps, patches=patches))
    q, v = start(ground)
    walk = simulate_planar(COMPASS, q, v, ground, duration=2.6)
    hand = CompassOnTerrain(SLOPE, friction, tuple(steps), tuple(patches))
    log = hand.walk(np.concatenate([q, v]), 0, 3)
    kinds = {"closes": "lands", "crosses": "crosses", "stick": "rests", "slip+": "slips", "slip-": "slips"}
    events = walk.motion.events[: len(log)]
    assert [kinds[event.names[0].split()[-1]] for event in events] == [name for _, name, _ in log]
    for event, (time, _, y) in zip(events, log, strict=True):
        assert event.time == pytest.approx(time, abs=1e-9)
        np.testing.assert_allclose(np.concatenate([event.q, event.v_plus]), y, atol=1e-8)
    assert walk.motion.ledger().relative_residual < 1e-12


def test_the_walks_contain_the_events_that_they_are_about():
    crossings = [name for name in WALKS if "slides" in name]
    for name in crossings:
        friction, steps, patches = WALKS[name]
        ground = Ground(slope=SLOPE, friction=friction, terrain=Terrain(steps, patches))
        walk = simulate_planar(COMPASS, *start(ground), ground, duration=2.6)
        assert any("foot B crosses" in event.names for event in walk.motion.events), name


def test_the_friction_of_a_sliding_foot_changes_at_the_edge_of_a_patch():
    friction, steps, patches = WALKS["slides from one patch to the next"]
    ground = Ground(slope=SLOPE, friction=friction, terrain=Terrain(steps, patches))
    motion = simulate_planar(COMPASS, *start(ground), ground, duration=1.0).motion
    place = next(k for k, event in enumerate(motion.events) if "foot B crosses" in event.names)
    for segment, coefficient in ((motion.segments[place], 0.05), (motion.segments[place + 1], 0.02)):
        tangential, normal = segment.force[1]
        np.testing.assert_allclose(tangential / normal, -coefficient, rtol=1e-12)
    edge = motion.segments[place].kinematics.rims[0, 1, -1]
    assert edge == pytest.approx(FOOT + STEP + 0.004, abs=1e-13)


def test_a_foot_that_hits_a_step_stumbles():
    ground = Ground(slope=SLOPE, friction=0.6, terrain=Terrain(steps=[(FOOT + 0.3, 0.05)]))
    assert simulate_planar(COMPASS, *start(ground), ground, duration=2).stop is Stop.STUMBLED


def slide_box(terrain, friction, speed=1.0, duration=0.3):
    robot, ground = box(0.1, 0.02), Ground(friction=friction, terrain=terrain)
    return simulate_planar(robot, [0, 0.02, 0], [speed, 0, 0], ground, duration=duration)


def test_a_box_slides_over_a_patch_as_its_two_corners_share_the_friction():
    """Front corner on ice: each corner has its own coefficient; the equations of a box with both corners down."""
    rollout = slide_box(Terrain(patches=[(0.15, 0.6, 0.0)]), 0.2)
    first, second = rollout.motion.segments[:2]
    assert first.v[0, 0] - first.v[0, -1] == pytest.approx(0.2 * 9.81 * first.time[-1], rel=1e-9)
    (rear_t, rear_n), (front_t, front_n) = second.force[:, :, 0]
    assert front_t == 0
    assert rear_t == pytest.approx(-0.2 * rear_n)
    # moments about the centre: 0.1 (front_n - rear_n) + 0.02 rear_t = 0, and rear_n + front_n = m g
    assert 0.1 * (front_n - rear_n) + 0.02 * rear_t == pytest.approx(0, abs=1e-9)
    assert rear_n + front_n == pytest.approx(9.81)


def test_a_corner_that_slides_over_the_edge_of_a_step_down_is_free():
    rollout = slide_box(Terrain(steps=[(0.15, -0.05)]), 0.1, duration=0.06)
    assert [event.names for event in rollout.motion.events] == [("front opens",)]
    free = simulate_planar(box(0.1, 0.02), [0, 0.02, 0], [1, 0, 0], {"friction": 0.1}, duration=0.3)
    assert free.motion.segments[0].state.closed == rollout.motion.segments[0].state.closed


def test_a_corner_that_slides_against_a_step_up_stumbles():
    assert slide_box(Terrain(steps=[(0.15, 0.05)]), 0.1).stop is Stop.STUMBLED


def test_a_foot_on_two_heights_ends_the_simulation():
    robot, ground = heel_toe_walker(), {"slope": 0.04, "friction": 2.0}
    q, v = place_planar(robot, {"x": 0, "a": 0.279, "b": -0.329}, {"a": -1.184, "b": -0.718}, ground, on=["heel a"])
    heel, toe = (q[0] + math.sin(0.279) + d * math.cos(0.279) for d in (-0.04, 0.08))
    terrain = Terrain(steps=[((heel + toe) / 2, -0.001)])
    assert simulate_planar(robot, q, v, {**ground, "terrain": terrain}, duration=1).stop is Stop.UNEVEN


def test_a_foot_that_slides_onto_ground_of_infinite_friction_stumbles():
    ground = Ground(slope=SLOPE, terrain=Terrain(patches=[(FOOT + 0.2, FOOT + STEP + 0.01, 0.03)]))
    walk = simulate_planar(COMPASS, *start(ground), ground, duration=1.5)
    assert walk.stop is Stop.STUMBLED
    assert walk.end.contacts.mode("foot B").value == "slip+"


def test_a_round_foot_rolls_over_the_edge_of_a_patch():
    robot = round_foot_walker()
    cycle = find_planar_cycle(robot, *_round_start(robot), {"slope": 0.01}, section="foot B closes")
    first = cycle.motion.segments[0]
    begin = first.kinematics.rims[0, 0]
    edge = (begin[0] + begin[-1]) / 2
    ground = Ground(slope=0.01, friction=1.0, terrain=Terrain(patches=[(edge, edge + 10, 0.9)]))
    walk = simulate_planar(robot, first.q[:, 0], first.v[:, 0], ground, duration=cycle.period)
    assert walk.motion.events[0].names == ("foot A crosses",)
    assert walk.motion.segments[1].kinematics.rims[0, 0, 0] == pytest.approx(edge, abs=1e-12)


def _round_start(robot):
    z = 0.1894382832527, -0.2390109878129, -0.1876139814681  # round feet, independent integration
    return place_planar(robot, {"x": 0, "a": z[0], "b": -z[0]}, {"a": z[1], "b": z[2]}, {"slope": 0.01}, on=["foot A"])


def test_terrain_that_changes_nothing_gives_the_same_walk():
    ice = [(FOOT + 0.3, FOOT + STEP + 0.006, 0.03)]
    split = [(FOOT + 0.3, FOOT + STEP + 0.002, 0.03), (FOOT + STEP + 0.002, FOOT + STEP + 0.006, 0.03)]
    grounds = [Ground(slope=SLOPE, friction=0.6, terrain=Terrain(patches=patches)) for patches in (ice, split)]
    walks = [simulate_planar(COMPASS, *start(grounds[0]), ground, duration=2.0).motion for ground in grounds]
    first, second = ([(event.time, *event.v_plus) for event in walk.events] for walk in walks)
    assert len(second) == len(first) + 1
    np.testing.assert_allclose([second[0], *second[2:]], first, atol=1e-10)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"steps": [(0, 0.1), (0, 0.2)]}, "different positions"),
        ({"steps": [(0.1,)]}, r"sequence of \(position, rise\)"),
        ({"steps": 3}, "got 3"),
        ({"steps": [(1.0, True)]}, "with finite positions, lengths in m, got"),
        ({"steps": [("1", 0.1)]}, "with finite positions, lengths in m, got"),
        ({"ramps": [(1, 0, 0.1)]}, "A ramp must begin before it ends, got 1 to 0 m"),
        ({"ramps": [(0, 1, math.inf)]}, "rise of a ramp must be finite, got inf"),
        ({"ramps": [(0, 1, 0.1), (0.5, 2, 0.1)]}, "Ramps must not overlap"),
        ({"patches": [(1, 0, 0.1)]}, "begin before it ends, got 1 to 0 m"),
        ({"patches": [(0, 1, -0.1)]}, "friction of a patch must be at least 0, got -0.1"),
        ({"patches": [(0, 1, 0.1), (0.5, 2, 0.1)]}, "must not overlap"),
    ],
)
def test_invalid_terrain(arguments, message):
    with pytest.raises(InputError, match=message):
        Terrain(**arguments)


def test_only_simulations_of_robots_with_several_contacts_accept_terrain():
    ground = Ground(slope=SLOPE, terrain=Terrain(steps=[(1, 0.1)]))
    for robot in (COMPASS, compass_biped()):
        with pytest.raises(InputError, match="and by MultiStepProblem"):
            robot.resolve(ground)
    with pytest.raises(InputError, match="terrain must be a Terrain"):
        simulate_planar(COMPASS, [0] * 4, [0] * 4, {"terrain": 0.1})
    with pytest.raises(InputError, match=r"terrain must be a Terrain such as .*, got True"):
        Ground(terrain=True)
    with pytest.raises(InputError, match="accept a terrain without ramps"):
        simulate_planar(COMPASS, [0] * 4, [0] * 4, Ground(terrain=Terrain(ramps=[(1, 2, 0.1)])))
