"""The fast engine of robots with several contacts against the reference engine, on states, times and derivatives."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from gaitopt import InputError
from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.control.signature import control_function, law_inputs, make_memory
from gaitopt.control.torque_saturation import limit_torque
from gaitopt.model import PointContact, RigidLink, Terrain, compass_with_two_feet, monopod
from gaitopt.model.planar.planar_assembly import assemble_planar
from gaitopt.model.planar.planar_coordinates import PlanarCoordinates
from gaitopt.model.robots.kneed_walker import kneed_walker
from gaitopt.model.robots.round_foot_walker import round_foot_walker
from gaitopt.model.robots.vertical_hopper import vertical_hopper
from gaitopt.model.terrain import separate_terrain
from gaitopt.simulation import planar_engine_named
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_engine import ReferenceEngine
from gaitopt.simulation.planar_simulation.planar_simulator import follow
from gaitopt.simulation.taylor import planar_taylor_engine
from gaitopt.simulation.taylor.planar_programs import eliminate
from gaitopt.stability import find_planar_cycle
from gaitopt.stability.planar_gaits.planar_linearisation import planar_derivative
from gaitopt.status import Stop
from tests.simulation.planar_examples import GRAVITY, box
from tests.simulation.test_planar_properties import ROBOTS, lift
from tests.stability.test_planar_cycles import COMPASS_STATES, HOPPER, KNEES, ROUND_FEET, begin

pytest.importorskip("heyoka")
FAST, REFERENCE = planar_engine_named("heyoka"), planar_engine_named("scipy")
AGREEMENT = 1e-9


def simulate_with(engine, robot, q, v, parameters, *, torque=None, latched=None, duration=10.0, until=None):
    """Simulate as `simulate_planar` does, with an engine."""
    values, terrain = separate_terrain(parameters)
    automaton = PlanarAutomaton(robot, robot.resolve(values), torque, terrain, engine=engine)
    state = automaton.begin(np.array(q, dtype=float), np.array(v, dtype=float), latched=latched)
    return follow(automaton, state, duration=duration, until=until)


def assert_same_motion(robot, q, v, parameters, **options):
    """Simulate with both engines, compare everything, and return the reference."""
    reference, fast = (simulate_with(engine, robot, q, v, parameters, **options) for engine in (REFERENCE, FAST))
    assert fast.stop is reference.stop
    assert fast.motion.sequence == reference.motion.sequence
    for one, other in zip(fast.motion.events, reference.motion.events, strict=True):
        assert one.names == other.names
        assert one.time == pytest.approx(other.time, abs=AGREEMENT)
    for one, other in zip(fast.arcs, reference.arcs, strict=True):
        size = np.maximum(1, np.abs(other.states).max(axis=1))
        assert one.time[-1] == pytest.approx(other.time[-1], abs=AGREEMENT)
        assert np.max(np.abs(one.states[:, -1] - other.states[:, -1]) / size) < AGREEMENT
    return reference


def uses_taylor_series(robot, q, v, parameters, torque=None):
    """Return whether the fast engine integrates the first phase itself."""
    automaton = PlanarAutomaton(robot, robot.resolve(parameters), torque, engine=FAST)
    state = automaton.begin(q, v)
    phase = automaton.phase(state)
    y = np.concatenate([state.y, np.zeros(phase.n_works)])
    integrator = FAST.begin(phase, 0.0, y, 0.1, 1e-13)
    return isinstance(integrator, planar_taylor_engine.TaylorSteps)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("name", [name for name in ROBOTS if name not in ("monopod", "quadruped")])
def test_robots_of_the_catalogue_move_in_the_same_way(name, seed):
    robot, generator = ROBOTS[name], np.random.default_rng(seed)
    friction = float(generator.choice([0.2, 0.7, np.inf]))
    parameters = {"friction": friction, "slope": float(generator.uniform(0, 0.08))}
    q, v = generator.normal(0, 0.25, robot.n_q), generator.normal(0, 1, robot.n_q)
    q, v[1] = lift(robot, q, robot.vector(robot.resolve(parameters))), -1.5
    assert assert_same_motion(robot, q, v, parameters, duration=0.6).motion.events
    assert uses_taylor_series(robot, q, v, parameters)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "duration"), [("monopod", 0.4), ("quadruped", 0.25)])
def test_robots_with_springs_land_in_the_same_way(name, duration):
    """Later they fall and spin, which magnifies differences."""
    robot, parameters = ROBOTS[name], {"friction": 0.7}
    lengths = [0.6 if "length" in coordinate or coordinate == "s" else 0.05 for coordinate in robot.coordinates]
    q = lift(robot, np.array(lengths), robot.vector(robot.resolve(parameters)))
    reference = assert_same_motion(robot, q, np.zeros(robot.n_q), parameters, duration=duration)
    assert any(event.is_impact for event in reference.motion.events)


def walker_start(robot, gait):
    parameters = {"slope": gait["slope"]}
    return *begin(robot, gait["z"], parameters), parameters


def compass_start(gait):
    """Return the state of a published gait of the compass and its parameters."""
    friction, (th1, th1_rate, th2_rate, slip), _ = COMPASS_STATES[gait]
    q = [1.6 * np.sin(th1), 1.6 * np.cos(th1), -th1, th1]
    v = [slip + 1.6 * np.cos(th1) * th1_rate, -1.6 * np.sin(th1) * th1_rate, -th1_rate, th2_rate]
    return np.array(q), np.array(v), {"slope": np.deg2rad(1), "friction": friction}


@pytest.mark.slow
@pytest.mark.parametrize("gait", COMPASS_STATES)
def test_stick_slip_gaits_have_the_published_multipliers(gait):
    """Gamus & Or (2015): A sticks, B slips and sticks and slips, C lands with a slip."""
    q, v, parameters = compass_start(gait)
    robot, published = compass_with_two_feet(), COMPASS_STATES[gait][2]
    found = find_planar_cycle(robot, q, v, parameters, section="foot B closes", engine=FAST)
    assert np.abs(found.multipliers)[: len(published)] == pytest.approx(np.abs(published), abs=6e-5)
    assert uses_taylor_series(robot, q, v, parameters)


CYCLES = {
    "kneed": (kneed_walker(), lambda: walker_start(kneed_walker(), KNEES), "foot B closes"),
    "round": (round_foot_walker(), lambda: walker_start(round_foot_walker(), ROUND_FEET), "foot B closes"),
    "hopper": (vertical_hopper(), lambda: ([0.7, 0.2], [0, 0], HOPPER), "sole closes"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CYCLES)
def test_periodic_gaits_have_the_same_multipliers(name):
    robot, start, section = CYCLES[name]
    q, v, parameters = start()
    reference, fast = (
        find_planar_cycle(robot, q, v, parameters, section=section, engine=engine) for engine in (REFERENCE, FAST)
    )
    assert fast.sequence == reference.sequence
    assert fast.period == pytest.approx(reference.period, abs=AGREEMENT)
    np.testing.assert_allclose(list(fast.state.values()), list(reference.state.values()), atol=AGREEMENT)
    np.testing.assert_allclose(fast.multipliers, reference.multipliers, atol=1e-8)
    assert fast.motion.ledger().relative_residual == pytest.approx(0, abs=1e-11)


def test_the_hopper_has_the_multiplier_of_the_closed_form():
    hop = find_planar_cycle(vertical_hopper(), [0.7, 0.2], [0, 0], HOPPER, section="sole closes", engine=FAST)
    assert hop.multipliers[0] == pytest.approx(0.78107619584119, abs=1e-10)
    assert uses_taylor_series(vertical_hopper(), [0.7, 0.2], [0, 0], HOPPER)


def latched_law(robot):
    """Return a law with two pieces whose torque depends on the clock, the state and a rate latched at the section."""
    inputs = law_inputs(robot, data=1, latched=1)
    ankle = inputs.data[0] * ca.sin(3 * inputs.clock) - 0.4 * (inputs.v[2] - inputs.latched[0])
    control = control_function(inputs, ca.vertcat(ankle, 0, 0.1 * inputs.q[3]))
    memory = make_memory(inputs, inputs.v[2], values=["rate after the section"])
    part = Law("latched", control, np.array([0.0, 0.3]), np.array([[0.2, -0.1]]), memory=memory)
    return PlanarLaw("latched", "foot B closes", (part,))


@pytest.mark.slow
def test_a_law_acts_on_both_legs_in_turn_in_the_same_way():
    robot, (q, v, parameters) = compass_with_two_feet(), compass_start("A")
    law = latched_law(robot)
    assert uses_taylor_series(robot, q, v, parameters, law)
    rollouts, derivatives = [], []
    for engine in (REFERENCE, FAST):
        automaton = PlanarAutomaton(robot, robot.resolve(parameters), law, engine=engine)
        start = automaton.begin(q, v)
        rollouts.append(follow(automaton, start, duration=3.0, until="foot B closes", steps=2))
        derivatives.append(planar_derivative(automaton, follow(automaton, start, duration=3.0, until="foot B closes")))
    reference, fast = rollouts
    assert reference.stop is fast.stop is Stop.EVENT_REACHED
    assert fast.motion.sequence == reference.motion.sequence
    assert len({arc.start.memory.mirrored for arc in fast.arcs}) == 2
    assert fast.end.time == pytest.approx(reference.end.time, abs=AGREEMENT)
    np.testing.assert_allclose(fast.end.y, reference.end.y, atol=AGREEMENT)
    assert derivatives[0].shape == (8, 9)
    assert np.max(np.abs(derivatives[0][:, 8])) > 1e-3
    np.testing.assert_allclose(*derivatives, rtol=1e-8, atol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize(("limit", "is_reached"), [(0.9, False), (0.3, True)])
def test_limits_of_torques_act_in_the_same_way(limit, is_reached, monkeypatch):
    """Taylor series integrate the steps in which no torque reaches its limit, the reference engine the others."""
    robot, (q, v, parameters) = compass_with_two_feet(), compass_start("A")
    (part,) = latched_law(robot).parts
    part = replace(part, table=np.full((1, 2), 0.4))  # the limit is reached within a piece
    law = PlanarLaw("limited", "foot B closes", (limit_torque(part, np.full(3, limit)),))
    assert uses_taylor_series(robot, q, v, parameters, law)
    integrate, fallbacks = ReferenceEngine.derivative, []
    monkeypatch.setattr(
        ReferenceEngine,
        "derivative",
        lambda engine, phase, span, y: fallbacks.append(span) or integrate(engine, phase, span, y),
    )
    rollouts, derivatives, largest = [], [], []
    for engine in (FAST, REFERENCE):
        automaton = PlanarAutomaton(robot, robot.resolve(parameters), law, engine=engine)
        rollout = follow(automaton, automaton.begin(q, v), duration=3.0, until="foot B closes")
        rollouts.append(rollout)
        derivatives.append(planar_derivative(automaton, rollout))
        largest.append(float(np.abs(rollout.motion.channel("torque")).max()))
        if engine is FAST:
            assert bool(fallbacks) is is_reached
    assert [size == pytest.approx(limit, rel=1e-12) for size in largest] == [is_reached] * 2
    assert rollouts[0].end.time == pytest.approx(rollouts[1].end.time, abs=AGREEMENT)
    np.testing.assert_allclose(rollouts[0].end.y, rollouts[1].end.y, atol=AGREEMENT)
    np.testing.assert_allclose(*derivatives, rtol=1e-8, atol=1e-8)


@pytest.mark.slow
def test_torques_of_time_and_state_have_the_same_derivative():
    robot, (q, v) = compass_with_two_feet(), ([0, 1.5, -0.2, 0.3], [0.3, 0.1, 0.2, 0.4])
    t, s, r = ca.SX.sym("t"), ca.SX.sym("q", 4), ca.SX.sym("v", 4)
    torque = ca.Function("torque", [t, s, r], [ca.vertcat(0.3 * ca.sin(4 * t), -0.2 * r[2], 0.5 * s[3] - r[3])])
    q = lift(robot, np.array(q), robot.vector(robot.resolve({})))
    assert uses_taylor_series(robot, q, np.array(v), {"friction": 0.6}, torque)
    derivatives = []
    for engine in (REFERENCE, FAST):
        automaton = PlanarAutomaton(robot, robot.resolve({"friction": 0.6}), torque, engine=engine)
        rollout = follow(automaton, automaton.begin(q, np.array(v)), duration=2.0, until="foot B closes")
        derivatives.append(planar_derivative(automaton, rollout))
    np.testing.assert_allclose(*derivatives, rtol=1e-8, atol=1e-8)


def test_a_torque_that_is_not_smooth_is_integrated_by_the_reference_engine(caplog):
    planar_taylor_engine._warn_of_reference.cache_clear()
    robot, q, v = vertical_hopper(), np.array([0.7, 0.2]), np.zeros(2)
    assert uses_taylor_series(robot, q, v, {})
    assert not caplog.messages
    robot, q, v = monopod(), np.array([0, 0.7, 0, 0, 0.6]), np.zeros(5)
    t, s, r = ca.SX.sym("t"), ca.SX.sym("q", 5), ca.SX.sym("v", 5)
    torque = ca.Function("torque", [t, s, r], [ca.vertcat(ca.fabs(r[4]), 0)])
    assert not uses_taylor_series(robot, q, v, {}, torque)
    assert_same_motion(robot, q, v, {}, torque=torque, duration=0.1)
    assert [message.partition(",")[0] for message in caplog.messages] == [
        "heyoka does not support the torques of this law"
    ]


def test_dependent_constraints_are_left_to_the_reference_engine():
    c = PlanarCoordinates(("x", "y", "angle"), [GRAVITY])
    centre, angle = ca.vertcat(c.coordinate("x"), c.coordinate("y")), c.coordinate("angle")
    ahead, up = ca.vertcat(ca.cos(angle), -ca.sin(angle)), ca.vertcat(ca.sin(angle), ca.cos(angle))
    corners = {name: centre + side * ahead - 0.1 * up for name, side in (("rear", -0.1), ("middle", 0), ("front", 0.1))}
    slab = assemble_planar(
        "slab",
        c,
        bodies=[RigidLink(1.0, centre, 0.01, angle)],
        contacts={name: PointContact(corner, body="slab") for name, corner in corners.items()},
    )
    motion = assert_same_motion(slab, [0, 0.1, 0], [1, 0, 0], {"friction": 0.3}, duration=0.5).motion
    assert motion.segments[0].q[0, -1] == pytest.approx(1 / (2 * 0.3 * 9.81), abs=1e-12)  # v^2 / (2 mu g)
    assert not uses_taylor_series(slab, np.array([0, 0.1, 0]), np.array([1.0, 0, 0]), {"friction": 0.3})


@pytest.mark.slow
def test_a_box_slides_to_rest_on_ground_of_several_frictions():
    ground = {"friction": 0.5, "terrain": Terrain(patches=[(0.05, 0.2, 0.1)])}
    assert_same_motion(box(0.1, 0.02), [0, 0.02, 0], [1.2, 0, 0], ground, duration=0.4)


def test_elimination_solves_a_system_whose_last_diagonal_entry_is_zero():
    generator = np.random.default_rng(0)
    root, rows = generator.normal(size=(4, 4)), generator.normal(size=(2, 4))
    matrix = np.block([[root @ root.T, -rows.T], [rows, np.zeros((2, 2))]])
    right = generator.normal(size=6)
    symbols = ca.SX.sym("K", 6, 6), ca.SX.sym("r", 6)
    solution = ca.Function("solution", [*symbols], [eliminate(*symbols)])(matrix, right)
    np.testing.assert_allclose(np.array(solution).ravel(), np.linalg.solve(matrix, right), rtol=1e-12)


def test_an_unknown_engine_is_an_error():
    with pytest.raises(InputError, match="There is no engine 'heyoca'"):
        planar_engine_named("heyoca")
