"""Return maps on a section after touchdown, with exact derivatives."""

from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array
from gaitopt.simulation.hybrid_automaton import Walker, WalkStep
from gaitopt.stability.fall_prediction import FallPrediction
from gaitopt.stability.linearisation import Linearisation
from gaitopt.stability.section import Section
from gaitopt.status import Stop

_FALL = WalkStep((), Stop.FELL, None, None)
"""A step that is not simulated because a fall is predicted."""


@dataclass(frozen=True, eq=False)
class Passage:
    """Steps from a point of the section.

    Attributes
    ----------
    end : (n_z,) array or None
        Point of the section after the last step; None if a step did not reach its touchdown.
    states : tuple of (2 n_q,) arrays
        State at the start of each step.
    walk_steps : tuple of WalkStep
    """

    end: Array | None
    states: tuple[Array, ...]
    walk_steps: tuple[WalkStep, ...]

    @property
    def stop(self) -> Stop | None:
        """Reason for which the steps ended early, or None."""
        return self.walk_steps[-1].stop


class ReturnMap:
    """Map of a section to itself by a number of steps.

    Parameters
    ----------
    walker : Walker
    section : Section
    steps : int
        Steps per return: n for gaits of period n.
    linearisation : Linearisation, optional
        Derivatives of the walker's steps, if several maps share them.
    prediction : FallPrediction, optional
        If given, steps from states it excludes are not simulated.
    """

    def __init__(
        self,
        walker: Walker,
        section: Section,
        steps: int = 1,
        linearisation: Linearisation | None = None,
        prediction: FallPrediction | None = None,
    ) -> None:
        self.walker, self.section, self.steps, self._prediction = walker, section, steps, prediction
        self._linearisation = linearisation or Linearisation(walker)

    def on_section(self, section: Section) -> "ReturnMap":
        """Return the map of another section by the same number of steps."""
        return ReturnMap(self.walker, section, self.steps, self._linearisation, self._prediction)

    def __call__(self, z: Array) -> Passage:
        """Simulate the steps from a point of the section, shape (n_z,)."""
        state, states, walk_steps = self.section.embed(z), [], []
        for _ in range(self.steps):
            excluded = self._prediction is not None and self._prediction.excludes(state)
            walk_step = _FALL if excluded else self.walker.walk_step(state)
            states.append(state)
            walk_steps.append(walk_step)
            if walk_step.following is None:
                return Passage(None, tuple(states), tuple(walk_steps))
            state = walk_step.following
        return Passage(self.section.project(state), tuple(states), tuple(walk_steps))

    def derivative(self, z: Array, passage: Passage) -> Array:
        """Return the derivative of the map at the point where a passage starts, shape (n_z, n_z)."""
        matrix = self.section.tangent(z)
        for state, walk_step in zip(passage.states, passage.walk_steps, strict=True):
            matrix = self._linearisation.derivative(state, walk_step) @ matrix
        return matrix[self.section.places]
