"""A custom contact transition in one file: adhesion ends a slide before it comes to rest.

The simulator, the NLP and the multipliers contain it.
"""

from dataclasses import dataclass

import numpy as np
import pytest

from gaitopt import (
    Collocation,
    GaitProblem,
    InputError,
    Limits,
    Mode,
    ScipyEngine,
    compass_biped,
    feedforward,
    ledger,
    load,
    replay,
    simulate,
    solve,
    verify,
)
from gaitopt.model import ContactModel, Transition
from gaitopt.model.contacts.event import EventKind, HybridEvent
from gaitopt.model.contacts.transition import TRANSITIONS, ComingToRest, Condition, NodeCondition
from gaitopt.ocp.bounds import structure
from gaitopt.ocp.nlp.keys import Group, Kind
from gaitopt.ocp.transcription.transcription import transcribe
from gaitopt.simulation import default_engine
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section


@dataclass(frozen=True)
class Adhesion(Transition):
    """A slide slower than a limit sticks; the rest of its speed is lost."""

    limit: float

    @property
    def event(self):
        return HybridEvent(EventKind.CUSTOM, name="adhesion")

    def leaves(self, mode):
        return mode.slips

    def guard(self, mode, contact):
        return mode.sign * contact.speed - self.limit

    def following(self, mode):
        return Mode.STICK

    def reset(self, slip_rate, size):
        return ComingToRest().reset(slip_rate, size)

    def conditions(self, mode, contact):
        pressing = NodeCondition(Condition.NORMAL_FORCE, contact.force[1], False)
        return [NodeCondition(Condition.CUSTOM, self.guard(mode, contact), True), pressing]


ROBOT = compass_biped().with_contact_model(ContactModel(transitions=(*TRANSITIONS, Adhesion(0.005))))
GAIT = load("docs/examples/compass_slip.h5")


@pytest.mark.parametrize("engine", [default_engine(), ScipyEngine()], ids=lambda engine: engine.name)
def test_a_slide_ends_at_the_transition(engine):
    first, law = GAIT.motion.segments[0], feedforward(ROBOT, GAIT.motion)
    walk = simulate(ROBOT, first.q[:, 0], first.v[:, 0], GAIT.motion.parameters, law=law, engine=engine)
    event = walk.events[0]
    assert (event.name, event.before, event.after) == ("adhesion", "slip+", "stick")
    assert walk.motion.segments[0].v[0, -1] == pytest.approx(0.005, abs=1e-9)
    assert walk.motion.segments[1].v[0, 0] == 0.0


def problem(robot, sequence, intervals=40):
    return GaitProblem(
        robot=robot,
        sequence=sequence,
        friction=0.14,
        speed=0.633,
        step_length=0.4713,
        limits=Limits(torque=6),
        transcription=Collocation(intervals=intervals),
    )


@pytest.fixture(scope="module")
def optimal():
    return verify(solve(problem(ROBOT, "slip+ stick | slip+", intervals=60)))


def test_an_optimal_gait_contains_the_transition_and_survives_its_replay(optimal):
    assert optimal.status.ok, optimal.status
    assert optimal.verification.passed
    assert optimal.verification.state_error < 1e-10  # 1.1e-10 with 40 intervals, 5e-12 with 80: of order 6
    assert optimal.energy.transition_loss > 0
    assert ledger(replay(optimal).motion).transition_loss == pytest.approx(optimal.energy.transition_loss, rel=1e-6)
    slide, stick = optimal.motion.segments
    assert slide.v[0, -1] == pytest.approx(0.005, abs=1e-8)
    assert stick.v[0, 0] == 0.0
    assert [event.name for event in replay(optimal).events] == ["adhesion", "touchdown"]


def test_another_limit_is_another_optimum(optimal):
    """Coulomb friction ends the slide at rest; adhesion saves a little of the slide."""
    coulomb = solve(problem(compass_biped(), "slip+ stick | slip+"))
    assert coulomb.motion.segments[0].v[0, -1] == 0.0
    assert optimal.solver.objective != pytest.approx(coulomb.solver.objective, rel=1e-6)


def test_the_row_of_the_transition_is_named_by_its_event():
    stated = problem(ROBOT, "slip+ stick | slip+")
    transcription = transcribe(structure(stated, stated.transcription))
    (row,) = transcription.constraints.find(Kind.CUSTOM, "adhesion")
    assert row in transcription.constraints[Group.END, 0]


class Bounce(Adhesion):
    """A slide slower than a limit stops with a change of every rate."""

    def reset(self, slip_rate, size):
        return 0.5 * np.eye(size)


def test_a_reset_that_an_optimisation_cannot_place_is_refused():
    robot = compass_biped().with_contact_model(ContactModel(transitions=(*TRANSITIONS, Bounce(0.005))))
    with pytest.raises(InputError, match="its reset must leave angles and rates unchanged"):
        solve(problem(robot, "slip+ stick | slip+"))


def test_a_sequence_needs_a_transition_between_its_phases():
    robot = compass_biped().with_contact_model(ContactModel(transitions=TRANSITIONS[:3]))
    with pytest.raises(InputError, match="no transition from 'stick' to 'slip-'"):
        solve(problem(robot, "stick slip- | stick"))


def test_the_multipliers_contain_its_saltation():
    first, law = GAIT.motion.segments[0], feedforward(ROBOT, GAIT.motion)
    walker = make_walker(ROBOT, law, GAIT.motion.parameters, period=GAIT.period)
    section = Section(ROBOT, walker.p, sliding=True)
    returning = ReturnMap(walker, section)
    z = section.project(np.concatenate([first.q[:, 0], first.v[:, 0]]))
    passage = returning(z)
    assert any(arc.event.name == "adhesion" for _, arc in passage.walk_steps[0].arcs)
    exact, step = returning.derivative(z, passage), 1e-6 * np.eye(z.size)
    differences = np.column_stack([(returning(z + h).end - returning(z - h).end) / 2e-6 for h in step])
    np.testing.assert_allclose(exact, differences, atol=1e-6 * np.max(np.abs(exact)))
