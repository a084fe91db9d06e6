"""The engine for many walks of an optimised gait: heyoka if the feedback of the law is stiff."""

import itertools
from collections.abc import Iterator
from importlib.util import find_spec

from attrs import field, frozen

from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.simulation.engine_choice import planar_engine_named
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine, ReferenceEngine, StepIntegrator
from gaitopt.simulation.planar_simulation.planar_phase import PlanarPhase, make_integrator
from gaitopt.simulation.planar_simulation.planar_simulator import follow

STIFF = 6000
"""Evaluations of the equations of motion in a period beyond which the feedback is stiff.

heyoka compiles the contact states of a walker with ankles for about ten seconds.  DOP853 evaluates its equations about
700 times in a period without feedback, and 8,000 to 130,000 times under feedback at the ankles.  The multipliers then
take 3 to 48 s, with heyoka 1 to 3 s.
"""


class _FeedbackIsStiff(Exception):
    """Ends the walk in which evaluations are counted."""


@frozen
class _CountingEngine(ReferenceEngine):
    """The reference engine, which raises an exception after `STIFF` evaluations of the equations of motion."""

    evaluations: Iterator[int] = field(factory=itertools.count)

    def begin(self, phase: PlanarPhase, t: float, y: Array, end: float, relative: float) -> StepIntegrator:
        """See :class:`PlanarEngine`."""

        def rates(t: float, y: Array) -> Array:
            if next(self.evaluations) > STIFF:
                raise _FeedbackIsStiff
            return phase.rates(t, y)

        return make_integrator(rates, t, y, end, relative=relative)


def planar_engine_for_walks(gait: PlanarGait, law: PlanarLaw) -> PlanarEngine:
    """Return the engine for many walks of a gait: heyoka if it is installed and the feedback is stiff, else scipy.

    Examples
    --------
    >>> from gaitopt import load
    >>> from gaitopt.control.planar_laws.planar_feedback import planar_feedforward
    >>> gait = load("docs/examples/heel_toe.h5")
    >>> planar_engine_for_walks(gait, planar_feedforward(gait)).name
    'scipy'
    """
    fast = bool(find_spec("heyoka")) and is_stiff(gait, law)
    return planar_engine_named("heyoka" if fast else "scipy")


def is_stiff(gait: PlanarGait, law: PlanarLaw) -> bool:
    """Return whether a period of a gait under a law takes more than `STIFF` evaluations of the equations of motion."""
    first = gait.motion.segments[0]
    automaton = PlanarAutomaton(gait.robot, gait.robot.resolve(gait.motion.parameters), law, engine=_CountingEngine())
    try:
        follow(automaton, automaton.begin(first.q[:, 0], first.v[:, 0]), duration=2 * gait.period, until=law.section)
    except _FeedbackIsStiff:
        return True
    return False
