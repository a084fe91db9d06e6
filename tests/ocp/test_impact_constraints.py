"""The boundary of the step against the simulator's exact impact."""

import numpy as np
import pytest

from gaitopt import ContactSequence, Mode, TorqueSquared, compass_biped
from gaitopt.model import solve_impact
from gaitopt.ocp.nlp.keys import Unknown
from tests.ocp.nlp_examples import example_nlp

ROBOT = compass_biped()
SEQUENCES = {
    Mode.STICK: (ContactSequence.parse("stick | stick"), (2,)),
    Mode.SLIP_FORWARD: (ContactSequence.parse("slip+ stick | slip+"), (2, 2)),
    Mode.SLIP_BACKWARD: (ContactSequence.parse("slip- stick | slip-"), (2, 2)),
}
MARGINS = (0.0, 0.0)


def impacts(mode, count=10):
    """Yield touchdowns whose exact outcome is `mode`: (friction, q, v, impact)."""
    rng = np.random.default_rng(3)
    found = 0
    while found < count:
        angle, friction = rng.uniform(0.05, 0.4), rng.uniform(0.05, 0.6)
        q = np.array([0, 0, angle, angle])
        v = np.array([0, 0, rng.uniform(0.3, 1.5), rng.uniform(-3, 0.3)])
        impact = solve_impact(ROBOT, q, v, ROBOT.vector(ROBOT.resolve({"friction": friction})))
        if impact.mode is mode:
            found += 1
            yield friction, q, v, impact


def place(transcription, q, v, impact, travel, durations):
    """Return a decision vector with this touchdown, zero elsewhere."""
    layout, x = transcription.variables, np.zeros(transcription.variables.size)
    q_next, v_next = (
        np.asarray(part).ravel() for part in ROBOT.swap(q, impact.v_plus, ROBOT.vector(ROBOT.resolve({})))
    )
    x[layout["angles"][:, -1]], x[layout["rates"][:, -1]] = q[2:], v[2:]
    x[layout["angles"][:, 0]], x[layout["rates"][:, 0]] = q_next[2:], v_next[2:]
    x[layout["impulse"][:, 0]] = impact.impulse
    x[layout["travel"]] = travel
    x[layout["duration"][0]] = durations
    if transcription.phases[0].mode.slips:
        x[layout[Unknown.SLIDE, 0][1, 0]] = v_next[0]
    return x


def rows(transcription, x, friction, margins=MARGINS):
    data = [*ROBOT.vector(ROBOT.resolve({"friction": friction})), *margins]
    g = np.asarray(transcription.nlp.derivatives["jac_g"](x, data)[0]).ravel()
    index = transcription.constraints["touchdown"][:, 0]
    return {transcription.constraints.label(i)[1]: g[i] for i in index}


@pytest.mark.parametrize("mode", SEQUENCES)
def test_an_exact_impact_satisfies_every_row(mode):
    sequence, counts = SEQUENCES[mode]
    transcription = example_nlp(sequence, counts, TorqueSquared())
    for friction, q, v, impact in impacts(mode):
        length = float(ROBOT.landing(q, v, ROBOT.vector(ROBOT.resolve({})))[0][0])
        durations = np.linspace(0.3, 0.4, len(sequence.phases))
        found = rows(transcription, place(transcription, q, v, impact, length, durations), friction)
        zero = {name: value for name, value in found.items() if name.startswith(("leg swap", "momentum balance"))}
        assert len(zero) == 2 + 4
        assert np.max(np.abs(list(zero.values()))) < 1e-12
        assert found["touchdown"] == pytest.approx(0, abs=1e-15)
        assert found["touchdown ahead of the stance foot"] == pytest.approx(q[2])
        assert found["touchdown direction"] == pytest.approx(v[3] - v[2])
        assert found["separation of the trailing foot"] == pytest.approx(impact.separation)
        assert found["step length"] == pytest.approx(0, abs=1e-15)
        assert found["step duration"] == pytest.approx(durations.sum())
        assert found["speed"] == pytest.approx(length / durations.sum())
        if mode.slips:
            assert found["impact friction cone"] == pytest.approx(0, abs=1e-12)
        else:
            assert found["forward impact cone"] > 0
            assert found["backward impact cone"] > 0


@pytest.mark.parametrize("mode", SEQUENCES)
def test_another_outcome_breaks_a_row(mode):
    """What the simulator would not do, the optimiser must not be able to do."""
    sequence, counts = SEQUENCES[mode]
    transcription = example_nlp(sequence, counts, TorqueSquared())
    for other in set(SEQUENCES) - {mode}:
        for friction, q, v, impact in impacts(other, count=5):
            x = place(transcription, q, v, impact, 0.4, np.full(len(sequence.phases), 0.3))
            found = rows(transcription, x, friction)
            unbalanced = max(abs(value) for name, value in found.items() if name.startswith("momentum balance"))
            outside = (
                abs(found["impact friction cone"])
                if mode.slips
                else max(0.0, -found["forward impact cone"], -found["backward impact cone"])
            )
            wrong_way = mode.slips and mode.sign * x[transcription.variables[Unknown.SLIDE, 0][1, 0]] < 0
            assert max(unbalanced, outside) > 1e-9 or wrong_way


def test_foot_slide_counts_as_travel():
    sequence, counts = SEQUENCES[Mode.SLIP_FORWARD]
    transcription = example_nlp(sequence, counts, TorqueSquared())
    friction, q, v, impact = next(impacts(Mode.SLIP_FORWARD))
    x = place(transcription, q, v, impact, 0.4, np.full(2, 0.3))
    x[transcription.variables[Unknown.SLIDE, 0][0, -1]] = 0.05
    length = float(ROBOT.landing(q, v, ROBOT.vector(ROBOT.resolve({})))[0][0])
    assert rows(transcription, x, friction)["step length"] == pytest.approx(length + 0.05 - 0.4)


def test_the_impact_margin_shrinks_the_cone():
    sequence, counts = SEQUENCES[Mode.STICK]
    transcription = example_nlp(sequence, counts, TorqueSquared())
    friction, q, v, impact = next(impacts(Mode.STICK))
    x = place(transcription, q, v, impact, 0.4, [0.3])
    tangential, normal = impact.impulse
    found = rows(transcription, x, friction, (0.0, 0.2))
    assert found["forward impact cone"] == pytest.approx(normal - tangential / (0.8 * friction))
    assert found["backward impact cone"] == pytest.approx(normal + tangential / (0.8 * friction))


def test_a_step_that_ends_sliding_takes_its_foot_speed_into_the_impact():
    sequence = ContactSequence.parse("stick slip- | stick")
    transcription = example_nlp(sequence, (2, 2), TorqueSquared())
    p = ROBOT.vector(ROBOT.resolve({"friction": 0.5}))
    q, v = np.array([0, 0, 0.15, 0.15]), np.array([-0.05, 0, 0.6, -0.1])
    impact = solve_impact(ROBOT, q, v, p)
    assert impact.mode is Mode.STICK
    x = place(transcription, q, v, impact, 0.4, np.full(2, 0.3))
    x[transcription.variables[Unknown.SLIDE, 1][1, -1]] = -0.05
    found = rows(transcription, x, 0.5)
    assert max(abs(value) for name, value in found.items() if name.startswith("momentum balance")) < 1e-12
