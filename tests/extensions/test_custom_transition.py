"""A custom contact transition in one file: adhesion ends a slide before it comes to rest."""

from dataclasses import dataclass

import numpy as np
import pytest

from gaitopt import Mode, ScipyEngine, compass_biped, feedforward, load, simulate
from gaitopt.model import ContactModel, Transition
from gaitopt.model.contacts.event import EventKind, HybridEvent
from gaitopt.model.contacts.transition import TRANSITIONS, ComingToRest, Condition, NodeCondition
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
        return [NodeCondition(Condition.CUSTOM, self.guard(mode, contact), True)]


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


def test_the_multipliers_contain_its_saltation():
    first, law = GAIT.motion.segments[0], feedforward(ROBOT, GAIT.motion)
    walker = make_walker(ROBOT, law, GAIT.motion.parameters, period=GAIT.period)
    section = Section(ROBOT, walker.p, sliding=True)
    returning = ReturnMap(walker, section)
    z = section.project(np.concatenate([first.q[:, 0], first.v[:, 0]]))
    passage = returning(z)
    assert any(arc.event.name == "adhesion" for _, arc in passage.strides[0].arcs)
    exact, step = returning.derivative(z, passage), 1e-6 * np.eye(z.size)
    differences = np.column_stack([(returning(z + h).end - returning(z - h).end) / 2e-6 for h in step])
    np.testing.assert_allclose(exact, differences, atol=1e-6 * np.max(np.abs(exact)))
