"""A knee strike with large friction, after which the stance foot may stick or leave the ground."""

import pytest

from gaitopt.cli.script import call_script
from gaitopt.simulation import place_planar, simulate_planar
from tests.conftest import ROOT

STICKING_RATIO = 0.0120394 / 0.0183719
"""Tangential over normal impulse of the foot at this strike if it sticks; if it leaves the ground, it has none."""


@pytest.mark.parametrize(("friction", "ambiguous"), [(0.97 * STICKING_RATIO, False), (1.03 * STICKING_RATIO, True)])
def test_the_strike_is_ambiguous_if_friction_permits_the_foot_to_stick(friction, ambiguous):
    walk = call_script(ROOT / "problems" / "kneed_walker.py", [])
    parameters = {**walk.parameters, "friction": friction}
    q, v = place_planar(
        walk.robot,
        {"x": 0, "a": 0.31008085531, "flexion_a": 0, "b": -0.33188288493, "flexion_b": 0},
        {"a": -0.92587564285, "flexion_a": 0, "b": -0.38144437939, "flexion_b": 0},
        parameters,
        on=["foot A"],
    )
    rollout = simulate_planar(walk.robot, q, v, parameters, duration=0.4)
    assert (rollout.stop.key == "ambiguous") is ambiguous
    assert ("one in which a foot sticks and one in which it leaves the ground" in rollout.stop.hint) is ambiguous
    if not ambiguous:
        assert rollout.motion.events[0].names[0] == "knee B closes"
        assert rollout.motion.events[0].outcome.mode("foot A").value == "free"
