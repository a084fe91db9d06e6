"""A compass biped with a spring, a damper and a rotor at its hip: ledger, second integrator, and both engines."""

import dataclasses

import attrs
import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, solve_ivp

from gaitopt import Mode, ScipyEngine, ledger, passive, simulate
from gaitopt.simulation.closed_loop import ClosedLoop
from gaitopt.simulation.taylor.heyoka_engine import HeyokaEngine
from gaitopt.simulation.taylor.trigonometric_form import to_trigonometric_form
from tests.newton_euler.sprung_compass import HandSprungCompass
from tests.simulation.conftest import GAIT_A, GAIT_B, GAIT_C
from tests.simulation.test_second_integrator import compare
from tests.walkers.sprung_compass import sprung_compass

HAND = HandSprungCompass(slope=np.deg2rad(1))
FORCES = [
    ("spring",),
    ("damper",),
    ("rotor",),
    ("spring", "damper", "rotor"),
    ("potential", "damper"),
    ("hardening", "rotor"),
]
BOUND = 1e-8

every_robot = pytest.mark.parametrize("names", FORCES, ids="-".join)
every_gait = pytest.mark.parametrize("gait", [GAIT_A, GAIT_B, GAIT_C], ids="ABC")


def walk(names, gait, engine, **options):
    """Walk from the state after touchdown of a gait of the compass without forces."""
    robot, (th, w1, w2) = sprung_compass(*names), gait["z"]
    parameters = {"slope": HAND.slope, "friction": gait["mu"]}
    return simulate(robot, [0, 0, th, th], [gait["xd"], 0, w1, w2], parameters, engine=engine, **options)


@every_robot
@every_gait
def test_the_ledger_closes(names, gait, engine):
    rollout = walk(names, gait, engine, steps=2)
    energies = ledger(rollout.motion)
    assert energies.relative_residual < BOUND
    assert (energies.damping_loss > 1e-3) == ("damper" in names)
    assert (abs(energies.elastic_change) > 1e-6) == bool({"spring", "potential", "hardening"} & set(names))
    fall = sum(gravitational(segment.q[:, 0]) - gravitational(segment.q[:, -1]) for segment in rollout.motion.segments)
    assert energies.gravity == pytest.approx(fall, rel=1e-9)  # no part of it is the spring's


def gravitational(q):
    """Potential energy of the three masses, by hand."""
    moment = sum(mass * (q[:2] + position) for mass, position, _ in HAND.bodies(q[2:], np.zeros(2), np.zeros(2)))
    return HAND.gravity * (moment[1] * np.cos(HAND.slope) - moment[0] * np.sin(HAND.slope))


@every_robot
def test_damping_work_is_the_integral_of_damping_times_rate_squared(names, engine):
    fine = attrs.evolve(engine, samples=24)
    for segment in walk(names, GAIT_B, fine).motion.segments:
        hip, rate = segment.q[2] + segment.q[3], segment.v[2] + segment.v[3]
        time, keep = np.unique(segment.time, return_index=True)
        loss = cumulative_simpson(0.1 * rate[keep] ** 2, x=time, initial=0)
        np.testing.assert_allclose(segment.damping_work[keep], ("damper" in names) * loss, atol=1e-8)
        stored = {"spring": 1.5 * hip**2, "potential": 3 * (1 - np.cos(hip)), "hardening": 1.5 * hip**2 + 12 * hip**4}
        elastic = sum((stored[name] for name in names if name in stored), 0 * hip)
        np.testing.assert_allclose(segment.elastic, elastic, atol=1e-15)


@every_gait
def test_steps_agree_with_equations_written_by_hand(gait, engine):
    """Stick, slips of both directions, impacts that stick and slip, of a robot with all three forces."""
    z = (-0.14, 0.72, -0.55) if gait is GAIT_A else gait["z"]
    hand = dataclasses.replace(HAND, mu=gait["mu"])
    robot = sprung_compass("spring", "damper", "rotor")
    rollout = simulate(robot, [0, 0, z[0], z[0]], [gait["xd"], 0, z[1], z[2]], hand.parameters, engine=engine)
    compare(rollout, hand, z, gait["xd"])


def swing(engine, hand, until=2.0):
    """Return an arc of a sticking foot with guards out of reach, and the same states by solve_ivp."""
    robot = sprung_compass("spring", "damper", "rotor")
    p = robot.vector(robot.resolve(hand.parameters))
    state = np.array([0, 0, 0.02, -0.3, 0, 0, -0.04, 0.1])
    arc = engine.flow(ClosedLoop(robot, passive(robot), p), Mode.STICK, 0.0, state, until=until, record=True)

    def rate(t, y):
        return [*y[2:4], *hand.stick(y[:2], y[2:4])[0], hand.damping * (y[2] + y[3]) ** 2]

    reference = solve_ivp(
        rate, (0, arc.time[-1]), [*state[2:4], *state[6:], 0.0], "DOP853", t_eval=arc.time, rtol=1e-13, atol=1e-15
    )
    return arc, reference.y


@pytest.mark.parametrize("damping", [0.0, 0.4])
def test_swing_of_the_legs_agrees_with_solve_ivp(engine, damping):
    hand = dataclasses.replace(HAND, stiffness=40.0, damping=damping, rotor=4e-4)
    arc, reference = swing(engine, hand, 0.5)
    np.testing.assert_allclose(arc.states[[2, 3, 6, 7]], reference[:4], atol=1e-10)
    np.testing.assert_allclose(arc.energy[-1], reference[4], atol=1e-10)


def test_energy_is_constant_but_for_the_dampers(engine):
    """Kinetic, gravitational, elastic and rotor energy written by hand at the states of the engine."""
    for damping in (0.0, 0.4):
        hand = dataclasses.replace(HAND, stiffness=40.0, damping=damping, rotor=4e-4)
        arc, _ = swing(engine, hand, 0.5)
        total = []
        for th, w in zip(arc.states[2:4].T, arc.states[6:].T, strict=True):
            kinetic = w @ hand.leg_matrix(*th) @ w / 2
            total.append(kinetic + gravitational(np.array([0, 0, *th])) + hand.elastic(th))
        assert np.ptp(np.array(total) + arc.energy[-1]) < 1e-10 * abs(total[0])
        assert (arc.energy[-1, -1] > 1e-2) == (damping > 0)


@every_robot
def test_engines_agree(names):
    pytest.importorskip("heyoka")
    for gait in (GAIT_A, GAIT_B, GAIT_C):
        fast, reference = (walk(names, gait, engine, steps=2) for engine in (HeyokaEngine(), ScipyEngine()))
        assert [(e.name, e.step) for e in fast.events] == [(e.name, e.step) for e in reference.events]
        for one, other in zip(fast.motion.segments, reference.motion.segments, strict=True):
            for name in ("time", "q", "v", "friction_work", "damping_work", "kinetic", "elastic"):
                ends = getattr(one, name)[..., -1], getattr(other, name)[..., -1]
                np.testing.assert_allclose(*ends, rtol=1e-9, atol=1e-9)


def test_a_spring_is_not_trigonometric_and_is_converted_as_it_is():
    """A rotor and a potential in cosines are sums of harmonics; springs are polynomials and kept as written."""
    for name, trigonometric in (("rotor", True), ("potential", True), ("spring", False), ("hardening", False)):
        robot = sprung_compass(name)
        assert (to_trigonometric_form(robot) is not robot) == trigonometric, name


def test_a_stop_that_is_not_smooth_is_walked_by_the_reference_engine():
    """A one-sided spring has a conditional expression, which a Taylor series cannot follow."""
    robot = sprung_compass("stop", "damper")
    z = GAIT_A["z"]
    rollout = simulate(robot, [0, 0, z[0], z[0]], [0, 0, *z[1:]], {"slope": HAND.slope, "friction": 0.5})
    assert rollout.engine == "scipy"
    assert ledger(rollout.motion).relative_residual < BOUND
    assert max(segment.elastic.max() for segment in rollout.motion.segments) > 1e-4
