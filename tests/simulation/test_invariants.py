"""What holds in every walk: the laws of contact, checked by hand in walks from random states of random robots."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gaitopt import Mode, ScipyEngine, Stop, compass_biped, rimless_wheel, simulate
from gaitopt.model import PlasticFrictional
from gaitopt.simulation import StepLimits
from gaitopt.simulation.engine_choice import default_engine
from tests.newton_euler.compass import HandCompass
from tests.newton_euler.wheel import HandWheel

COMPASS, WHEEL = compass_biped(), rimless_wheel()


def between(lower, upper):
    """Return one of a thousand numbers; a state of 1e-300 next to an unstable equilibrium would only test rounding."""
    return st.integers(0, 1000).map(lambda part: lower + (upper - lower) * part / 1000)


ENGINES = st.sampled_from(["fast", "reference"])
FRICTION = st.one_of(between(0.05, 0.5), between(0.0, 2.0), st.just(math.inf))
SLIDE = st.one_of(st.just(0.0), between(-0.3, 0.3))
ROUNDING = 1e-9
"""Of forces, relative to the weight; of energies, relative to what there is."""


@st.composite
def compasses(draw):
    """Return a compass biped by hand, and a state at the start of a step or within one."""
    length = draw(between(0.3, 2.0))
    hand = HandCompass(
        length=length,
        com=length * draw(between(0.2, 0.9)),
        mass=draw(between(0.2, 10.0)),
        hip=draw(between(0.1, 20.0)),
        slope=draw(between(-0.02, 0.1)),
        mu=draw(FRICTION),
    )
    unit = math.sqrt(hand.gravity / length)
    part = draw(st.sampled_from(["start", "landing", "swing"]))
    if part == "start":  # both feet on the ground, as fast as a gait with such steps
        th1 = th2 = draw(between(-0.3, -0.03))
        rates = [-unit * th1 * draw(between(1.0, 2.5)), -unit * th1 * draw(between(-2.5, 0.5))]
    elif part == "swing":
        th1, th2 = draw(between(-0.4, 0.4)), draw(between(-0.4, 0.4))
        rates = [unit * draw(between(-1.0, 1.0)) for _ in range(2)]
    else:
        th1 = draw(between(0.03, 0.4))
        th2 = th1 + draw(between(0.001, 0.1))
        rates = [unit * th1 * draw(between(0.5, 3.0)), -unit * th1 * draw(between(1.0, 4.0))]
    return hand, [0, 0, th1, th2], [0.0 if math.isinf(hand.mu) else draw(SLIDE), 0, *rates]


@st.composite
def wheels(draw):
    """Return a rimless wheel by hand, and a state at the start of a step or within one."""
    hand = HandWheel(
        spokes=draw(st.integers(4, 14)),
        kappa=draw(between(0.001, 1.0)),
        slope=draw(between(0.0, 0.5)),
        mu=draw(FRICTION),
    )
    theta = hand.half * draw(st.one_of(st.just(-1.0), between(-1.0, 0.99)))
    return (
        hand,
        [0, 0, theta],
        [0.0 if math.isinf(hand.mu) else draw(SLIDE), 0, draw(st.one_of(between(0.3, 1.0), between(-0.5, 1.3)))],
    )


def walk_of(robot, hand, q, v, engine):
    """Walk three steps, and check everything that can be said of them."""
    chosen = default_engine() if engine == "fast" else ScipyEngine()
    length, gravity = (hand.length, hand.gravity) if robot is COMPASS else (1.0, 1.0)
    patience = StepLimits(duration=5 * math.sqrt(length / gravity), events=30)
    walk = simulate(robot, q, v, hand.parameters, steps=3, engine=chosen, step_limits=patience)
    weight = walk.motion.total_mass * gravity
    for segment in walk.motion.segments:
        if segment.time[-1] > segment.time[0]:  # a foot that the ground would have to pull lifts off immediately
            check_forces(segment, hand, weight)
    for jump in walk.motion.jumps:
        check_impact(robot, jump, hand, walk.motion.parameters)
    check_energy(walk)
    check_order(walk, hand, weight)
    return walk


def sticking_force(hand, q, v):
    """Return the force (f_t, f_n) that would keep the foot where it is, by hand."""
    if isinstance(hand, HandCompass):
        return hand.stick(q[2:], v[2:])[1]
    return hand.motion(q[2], v[2])[2:]


def check_forces(segment, hand, weight):
    """The ground pushes, within its cone, against the slide; the foot stays on it."""
    speed, (tangential, normal) = segment.v[0], segment.force
    assert np.all(normal >= -ROUNDING * weight)
    assert np.ptp(segment.q[1]) == 0.0
    assert not np.any(segment.v[1])
    if segment.mode is Mode.STICK:
        assert not np.any(speed)
        assert np.ptp(segment.q[0]) == 0.0
        if math.isfinite(hand.mu):
            assert np.all(np.abs(tangential) <= hand.mu * normal + ROUNDING * weight)
        by_hand = np.array([sticking_force(hand, q, v) for q, v in zip(segment.q.T, segment.v.T, strict=True)]).T
        np.testing.assert_allclose(segment.force, by_hand, rtol=ROUNDING, atol=ROUNDING * weight)
    else:
        assert np.all(segment.mode.sign * speed >= -ROUNDING)
        np.testing.assert_allclose(
            tangential, -segment.mode.sign * hand.mu * normal, rtol=ROUNDING, atol=ROUNDING * weight
        )


def check_impact(robot, jump, hand, parameters):
    """The impulse and what follows it meet the impact law, and the foot left behind leaves the ground."""
    assert jump.energy_lost >= 0
    assert jump.separation >= 0
    tangential, normal = jump.impulse
    p = robot.vector(parameters)
    v_t, v_n = np.asarray(robot.landing(jump.q, jump.v_plus, p)[1]).ravel()
    scale = abs(tangential) + normal
    assert normal >= 0
    assert abs(v_n) < ROUNDING
    if math.isinf(hand.mu):
        assert jump.mode is Mode.STICK
        return
    pairs = PlasticFrictional().pairs((normal, max(tangential, 0), max(-tangential, 0)), abs(v_t), (v_n, v_t), hand.mu)
    assert min(min(side) for side in pairs) >= -ROUNDING * max(scale, 1)
    assert max(abs(a * b) for a, b in zip(*pairs, strict=True)) <= ROUNDING * max(scale, 1)


def check_energy(walk):
    """Without torque energy never grows: it falls by the friction work while sliding, and by the impacts."""
    segments, start = walk.motion.segments, None
    for segment in segments:
        energy = segment.kinetic + segment.potential
        scale = ROUNDING * (1 + np.max(np.abs(segment.kinetic)) + np.ptp(segment.potential))
        if start is not None:
            assert abs(energy[0] - start) < scale
        np.testing.assert_allclose(energy + segment.friction_work, energy[0], rtol=0, atol=scale)
        assert np.all(np.diff(segment.friction_work) >= -scale)
        assert segment.mode.slips or not np.any(segment.friction_work)
        lost = [jump.energy_lost for jump in walk.motion.jumps if jump.time == segment.time[-1]]
        start = energy[-1] - sum(lost)


def check_order(walk, hand, weight):
    """Time runs on, and each mode follows from the one before by the law of contact."""
    segments, jumps = walk.motion.segments, walk.motion.jumps
    assert [jump.step for jump in jumps] == list(range(len(jumps)))
    for segment in segments:
        assert np.all(np.diff(segment.time) >= 0)
    begins = [a for a, b in zip(segments, [None, *segments], strict=False) if b is None or a.step > b.step]
    for first in begins:
        check_beginning(first, hand, weight)
    for before, after in itertools.pairwise(segments):
        assert after.time[0] == before.time[-1]
        assert after.step - before.step in (0, 1)
        if after.step == before.step:
            check_change(before, after, hand, weight)
    if walk.stop is Stop.LIFT_OFF and segments[-1].time[-1] > segments[-1].time[0]:
        assert abs(segments[-1].force[1, -1]) < 1e3 * ROUNDING * max(weight, np.max(np.abs(segments[-1].force)))


def check_beginning(segment, hand, weight):
    """A moving foot slides on; a foot at rest sticks if it can, else gives way to the force."""
    speed = segment.v[0, 0]
    if speed != 0:
        assert segment.mode is Mode.slipping(speed)
    elif math.isfinite(hand.mu):
        tangential, normal = sticking_force(hand, segment.q[:, 0], segment.v[:, 0])
        excess = abs(tangential) - hand.mu * normal
        if abs(excess) > ROUNDING * weight:
            assert segment.mode is (Mode.STICK if excess < 0 else Mode.slipping(-tangential))


def check_change(before, after, hand, weight):
    """A stuck foot slips off at the edge of its cone; a foot that comes to rest sticks if it can, else turns round."""
    tangential, normal = sticking_force(hand, after.q[:, 0], after.v[:, 0])
    edge = ROUNDING * max(weight, abs(tangential))
    assert after.v[0, 0] == 0.0
    if before.mode is Mode.STICK:
        assert after.mode.slips
        assert abs(after.mode.sign * tangential + hand.mu * normal) < edge
    elif after.mode is Mode.STICK:
        assert abs(tangential) <= hand.mu * normal + edge
    else:
        assert after.mode.sign == -before.mode.sign
        assert -after.mode.sign * tangential >= hand.mu * normal - edge


@pytest.mark.slow
@settings(max_examples=120)
@given(compasses(), ENGINES)
def test_compass(walker, engine):
    walk_of(COMPASS, *walker, engine)


@settings(max_examples=120)
@given(wheels(), ENGINES)
def test_wheel(walker, engine):
    walk_of(WHEEL, *walker, engine)
