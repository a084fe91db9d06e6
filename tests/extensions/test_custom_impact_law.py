"""A custom impact law in one file: the friction of impacts is a fraction of that of the ground."""

from dataclasses import dataclass

import numpy as np
import pytest

from gaitopt import Collocation, GaitProblem, Limits, compass_biped, find_cycles, solve, verify
from gaitopt.model import ContactModel, ImpactLaw, PlasticFrictional, solve_impact
from gaitopt.ocp.solution.impossible_sequences import explain_impossibility
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section


@dataclass(frozen=True)
class SlipperyImpact(ImpactLaw):
    """Coulomb friction with a fraction of the ground's coefficient during impacts."""

    share: float

    def outcomes(self, velocity, mobility, friction):
        return PlasticFrictional().outcomes(velocity, mobility, self.share * friction)

    def impulse(self, outcome, velocity, mobility, friction):
        return PlasticFrictional().impulse(outcome, velocity, mobility, self.share * friction)

    def excess(self, impulse, friction, outcome, margin):
        return PlasticFrictional().excess(impulse, self.share * friction, outcome, margin)

    def pairs(self, impulse, slip_speed, velocity, friction):
        return PlasticFrictional().pairs(impulse, slip_speed, velocity, self.share * friction)


ROBOT = compass_biped().with_contact_model(ContactModel(impact=SlipperyImpact(0.5)))
STATE = np.array([0, 0, 0.15, 0.15]), np.array([0, 0, 0.6, -0.1])


def vector(friction):
    return ROBOT.vector(ROBOT.resolve({"friction": friction}))


def problem(sequence):
    return GaitProblem(
        robot=ROBOT,
        sequence=sequence,
        friction=0.2,
        speed=0.633,
        step_length=0.4713,
        limits=Limits(torque=6),
        transcription=Collocation(intervals=40),  # one grid for the open and the closed sequence
    )


@pytest.mark.parametrize("friction", [0.05, 0.2, 0.3, 0.6])
def test_the_simulator_solves_impacts_by_the_law(friction):
    custom, plain = (
        solve_impact(ROBOT, *STATE, vector(friction)),
        solve_impact(compass_biped(), *STATE, vector(friction / 2)),
    )
    assert custom.mode is plain.mode
    np.testing.assert_allclose(custom.impulse, plain.impulse, rtol=1e-13)


@pytest.fixture(scope="module")
def gait():
    return verify(solve(problem("slip+ stick | slip+")))


def test_a_gait_with_the_law_is_optimal_and_survives_its_replay(gait):
    assert gait.status.ok, gait.status
    assert gait.verification.passed
    tangential, normal = gait.motion.jumps[0].impulse
    assert -tangential == pytest.approx(0.1 * normal, rel=1e-6)  # half of the ground's 0.2


def test_an_open_impact_is_closed_by_the_law(gait):
    found = solve(problem("slip+ stick | any"))
    assert str(found.sequence) == "slip+ stick | slip+"
    assert found.cost_of_transport == pytest.approx(gait.cost_of_transport, rel=1e-5)


def test_slopes_and_slips_that_coulomb_friction_in_the_impact_excludes_are_not_refused():
    """The impulses of a custom law may balance gravity on a steep slope, or friction of a slip in one direction."""
    custom, plain = problem("slip+ | slip+"), problem("slip+ | slip+").replace(robot=compass_biped())
    steep = {"slope": 0.5, "sequence": "stick | stick"}
    for changes in ({}, steep):
        assert explain_impossibility(plain.replace(**changes).sequence, plain.replace(**changes))
        assert explain_impossibility(custom.replace(**changes).sequence, custom.replace(**changes)) == ""


def test_multipliers_contain_the_law(gait):
    from gaitopt import feedforward

    walker = make_walker(ROBOT, feedforward(ROBOT, gait.motion), gait.motion.parameters, period=gait.period)
    section = Section(ROBOT, walker.p, sliding=True)
    returning = ReturnMap(walker, section)
    jump = gait.motion.jumps[0]
    z = section.project(np.concatenate([jump.q_next, jump.v_next]))
    exact = returning.derivative(z, returning(z))
    step = 1e-6 * np.eye(z.size)
    differences = np.column_stack([(returning(z + h).end - returning(z - h).end) / 2e-6 for h in step])
    np.testing.assert_allclose(exact, differences, atol=1e-6 * np.max(np.abs(exact)))


def test_passive_gaits_land_by_the_law():
    """At friction 0.2 the impact of Gait A (impulse ratio 0.145) sticks; with half of that it must slip."""
    ground = {"slope": np.deg2rad(1), "friction": 0.2}
    plain = {cycle.sequence for cycle in find_cycles(compass_biped(), ground, starts=40)}
    custom = {cycle.sequence for cycle in find_cycles(ROBOT, ground, starts=40)}
    assert "stick | stick" in plain
    assert "stick | stick" not in custom
