"""The reference engine: accuracy, events at known times, and sensitivities against finite differences."""

import dataclasses

import casadi as ca
import numpy as np
import pytest

from gaitopt import Law, Mode, ScipyEngine, feedforward, passive
from gaitopt.control.signature import torque_function
from gaitopt.simulation.active_piece import pieces
from gaitopt.simulation.closed_loop import ClosedLoop


def start(q, v):
    return np.concatenate([q, v]).astype(float)


@pytest.fixture
def compass_p(compass):
    return compass.vector(compass.resolve({"slope": 0.02, "friction": 0.14}))


def test_a_pendulum_swings_through_in_its_own_time(wheel):
    """From rest at a small lean, theta grows as cosh(t / tau): linear theory, with its error of the cube."""
    p = wheel.vector(wheel.resolve({"inertia_ratio": 0.5, "friction": np.inf}))
    lean, rate = 1e-4, np.sqrt(9.8 / 1.5)
    arc = ScipyEngine().flow(
        ClosedLoop(wheel, passive(wheel), p), Mode.STICK, 0.0, start([0, 0, lean], [0, 0, 0]), until=1.0, record=True
    )
    np.testing.assert_allclose(arc.states[2], lean * np.cosh(rate * arc.time), rtol=1e-6)


def test_no_time_is_no_motion(wheel):
    p = wheel.vector(wheel.resolve({}))
    state = start([0, 0, 0.1], [0, 0, 1.0])
    arc = ScipyEngine().flow(ClosedLoop(wheel, passive(wheel), p), Mode.STICK, 0.3, state, until=0.3)
    assert arc.event is None
    np.testing.assert_array_equal(arc.states[:, -1], state)


def test_energy_is_kept_to_the_tolerance_over_a_long_swing(compass):
    """A stance leg held by no torque and a swing leg: the double pendulum keeps its energy."""
    p = compass.vector(compass.resolve({}))
    state = start([0, 0, 0.01, 0.3], [0, 0, 0.0, 0.0])
    arc = ScipyEngine().flow(ClosedLoop(compass, passive(compass), p), Mode.STICK, 0.0, state, until=1.0, record=True)
    energies = [sum(float(part) for part in compass.energy(y[:4], y[4:], p)) for y in arc.states.T]
    np.testing.assert_allclose(energies, energies[0], rtol=1e-12)


def test_recording_does_not_change_the_motion(compass, compass_p):
    state = start([0, 0, -0.15, -0.15], [0.1, 0, 0.7, -0.5])
    engine = ScipyEngine()
    short, full = (
        engine.flow(
            ClosedLoop(compass, passive(compass), compass_p), Mode.SLIP_FORWARD, 0.0, state, until=1.0, record=record
        )
        for record in (False, True)
    )
    assert short.event.label == full.event.label == "at rest"
    assert short.time[-1] == pytest.approx(full.time[-1], abs=1e-11)
    np.testing.assert_allclose(short.states[:, -1], full.states[:, -1], atol=1e-10)
    assert short.energy is None
    assert full.energy.shape == (3, full.time.size)


def test_tighter_tolerances_move_the_event_by_less(compass, compass_p):
    state = start([0, 0, -0.15, -0.15], [0.1, 0, 0.7, -0.5])

    def end(relative):
        engine = ScipyEngine(relative=relative, absolute=relative / 100)
        return engine.flow(
            ClosedLoop(compass, passive(compass), compass_p), Mode.SLIP_FORWARD, 0.0, state, until=1.0
        ).time[-1]

    best = end(1e-13)
    assert abs(end(1e-6) - best) < 1e-6
    assert abs(end(1e-10) - best) < 1e-10


def test_an_arc_may_start_late_on_the_clock_of_a_law(compass, slip_gait):
    """Two halves of a swing, the second with the clock where the first left it, are the whole."""
    p = compass.vector(slip_gait.motion.parameters)
    law, engine = feedforward(compass, slip_gait.motion), ScipyEngine()
    stuck = slip_gait.motion.segments[1]
    state, clock = start(stuck.q[:, 0], stuck.v[:, 0]), float(stuck.time[0])

    def flow(clock, state, until):
        return engine.flow(ClosedLoop(compass, law, p), Mode.STICK, clock, state, until=until)

    whole = flow(clock, state, 0.5)
    half = flow(clock, state, 0.3)
    rest = flow(0.3, half.states[:, -1], 0.5)
    np.testing.assert_allclose(rest.states[:, -1], whole.states[:, -1], atol=1e-11)
    assert (whole.event, half.time[-1]) == (None, 0.3)


def test_pieces_cover_the_clock_without_gaps(compass):
    law = dataclasses.replace(passive(compass), breakpoints=np.array([0.0, 0.2, 0.5]), table=np.zeros((0, 3)))
    assert list(pieces(law, 0.1, 0.9)) == [(0, 0.1, 0.2), (1, 0.2, 0.5), (2, 0.5, 0.9)]
    assert list(pieces(law, 0.2, 0.4)) == [(1, 0.2, 0.4)]
    assert list(pieces(law, 0.6, 0.7)) == [(2, 0.6, 0.7)]
    assert list(pieces(law, 0.7, 0.7)) == []


@pytest.mark.parametrize("mode", [Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD])
def test_sensitivity_is_the_derivative_of_the_flow(compass, compass_p, slip_gait, mode):
    """Central differences of the flow between fixed times, across pieces of a law, for every state that may move."""
    law, engine = feedforward(compass, slip_gait.motion), ScipyEngine()
    state = start([0.1, 0, -0.1, -0.05], [5.0 * mode.sign, 0, 0.6, -0.3])
    span = {"until": 0.2}
    exact = engine.sensitivity(ClosedLoop(compass, law, compass_p), mode, 0.05, state, **span)
    for j in (2, 3, 6, 7, *((0, 4) if mode.slips else ())):
        shift = 1e-5 * np.eye(8)[j]
        ends = [
            engine.flow(ClosedLoop(compass, law, compass_p), mode, 0.05, state + s, **span) for s in (shift, -shift)
        ]
        assert [end.event for end in ends] == [None, None]
        difference = (ends[0].states[:, -1] - ends[1].states[:, -1]) / 2e-5
        np.testing.assert_allclose(exact[:, j], difference, atol=2e-8)


@pytest.mark.parametrize("torque", [lambda t, v: ca.sqrt(0.3 - t), lambda t, v: ca.sqrt(v[3])], ids=["path", "slope"])
def test_sensitivity_of_a_motion_that_cannot_go_on_is_not_a_number(compass, compass_p, torque):
    """The path ends at 0.3 s; the torque's slope is infinite where the swing leg is at rest."""
    function = torque_function(compass, ca.SX.sym("data", 0), lambda clock, q, v: ca.vertcat(0, torque(clock, v)))
    law = Law("ending", function, np.zeros(1), np.zeros((0, 1)))
    state, engine = start([0, 0, -0.15, -0.15], [0, 0, 0.7, 0.0]), ScipyEngine(relative=1e-6, absolute=1e-8)
    matrix = engine.sensitivity(ClosedLoop(compass, law, compass_p), Mode.STICK, 0.0, state, until=0.5)
    assert not np.any(np.isfinite(matrix[[2, 3, 6, 7]][:, [2, 3, 6, 7]]))
