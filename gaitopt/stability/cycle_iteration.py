"""Newton's method from one start to a periodic gait."""

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion import Array
from gaitopt.simulation.hybrid_automaton import Walker, WalkStep
from gaitopt.stability.cycle import Cycle, make_cycle, slips_throughout
from gaitopt.stability.deflation import Deflation
from gaitopt.stability.fixed_point import FixedPointOptions, find_fixed_point
from gaitopt.stability.return_map import Passage, ReturnMap
from gaitopt.stability.section import Section
from gaitopt.stability.section_walk import natural_rate

STANDING = 1e-6
"""If all rates are below this fraction of the natural rate, the walker stands."""


def search_section(walker: Walker) -> Section:
    """Return the section on which gaits are sought: with foot speed, unless the foot cannot slip."""
    return Section(walker.robot, walker.p, sliding=bool(np.isfinite(walker.contact.friction)))


def find_cycle(
    walker: Walker,
    z: Array,
    steps: int = 1,
    *,
    options: FixedPointOptions | None = None,
    deflation: Deflation | None = None,
    passage: Passage | None = None,
    return_map: ReturnMap | None = None,
) -> Cycle | None:
    """Return the periodic gait to which Newton's method converges from a point of the section, or None.

    Parameters
    ----------
    walker : Walker
    z : (n_z,) array
        Coordinates of ``Section(robot, p, sliding=True)``; the foot speed is not used if friction is infinite.
    steps : int
        Steps after which the gait repeats itself; its period may be a divisor.
    options : FixedPointOptions, optional
    deflation : Deflation, optional
        Known gaits, to which the iteration does not converge; ignored for complete slip.
    passage : Passage, optional
        The steps from the start, if they have already been simulated.
    return_map : ReturnMap, optional
        The map of this number of steps on :func:`search_section`, if several calls share it.
    """
    return_map = return_map or ReturnMap(walker, search_section(walker), steps)
    z = z[: len(return_map.section.names)]
    passage = passage or return_map(z)
    if passage.end is None:
        return None
    complete_slip = _slips_completely(passage)
    if complete_slip:
        # The foot speed drifts: search a gait that is periodic in all other coordinates.
        section, z = Section(walker.robot, walker.p, sliding=False, foot_speed=float(z[-1])), z[:-1]
        return_map, passage = return_map.on_section(section), None
    deflation = None if complete_slip else deflation
    point = find_fixed_point(return_map, z, options, deflation=deflation, passage=passage)
    if point is None or (complete_slip and not _slips_completely(point.passage)):
        return None
    if _is_standing(walker, point.passage.states[0]):
        return None
    return make_cycle(walker, return_map, point)


def same_gait(one: Cycle, other: Cycle, tolerance: float = 1e-6) -> bool:
    """Return whether two cycles are the same gait, whichever of its steps comes first.

    The foot speed of complete slip is not compared.
    """
    if len(one.sequences) != len(other.sequences) or one.z.shape != other.z.shape:
        return False
    return any(bool(np.allclose(one.z, point, atol=tolerance)) for point in other.points)


def shortest_period(cycle: Cycle, tolerance: float = 1e-6) -> int:
    """Return the smallest number of steps, a divisor of those of a cycle, after which the gait repeats itself."""
    steps = len(cycle.points)
    divisors = (n for n in range(1, steps) if steps % n == 0)
    return next((n for n in divisors if np.allclose(cycle.points[n], cycle.z, atol=tolerance)), steps)


def _slips_completely(passage: Passage) -> bool:
    return all(slips_throughout(walk_step.modes, _outcome(walk_step)) for walk_step in passage.walk_steps)


def _outcome(walk_step: WalkStep) -> Mode | None:
    return walk_step.impact.mode if walk_step.impact is not None else None


def _is_standing(walker: Walker, state: Array) -> bool:
    """Return whether a walker stands with its legs together, the limit of ever smaller steps on a slope."""
    rates = state[list(walker.robot.state_entries.rates)]
    return bool(np.max(np.abs(rates)) < STANDING * natural_rate(walker.robot, walker.p)[0])
