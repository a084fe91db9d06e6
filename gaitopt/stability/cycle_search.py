"""Multistart search for periodic gaits."""

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from gaitopt.control.law import Law, passive
from gaitopt.interrupts import defer_interrupt
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.motion import Array
from gaitopt.parameters import Parameter
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import default_engine
from gaitopt.simulation.hybrid_automaton import Stride, Walker
from gaitopt.simulation.step_limits import StepLimits
from gaitopt.stability.cycle import Cycle, make_cycle, slips_throughout
from gaitopt.stability.fixed_point import FixedPointOptions, find_fixed_point
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section

STANDING = 1e-6
"""If all rates are below this fraction of the natural rate, the walker stands."""


def find_cycles(
    robot: Robot,
    parameters: Mapping[str, float],
    *,
    law: Law | None = None,
    sequence: ContactSequence | str | None = None,
    steps: int = 1,
    starts: int = 200,
    seed: int = 0,
    engine: Engine | None = None,
) -> tuple[Cycle, ...]:
    """Find periodic gaits from many starts and return every distinct one.

    Parameters
    ----------
    robot : Robot
    parameters : mapping of str to float
        Robot and ground parameters; those not named keep their defaults.
    law : Law, optional
        Passive by default.
    sequence : ContactSequence or str, optional
        Keep only gaits all of whose steps have this contact sequence.
    steps : int
        Period of the gaits in steps; gaits whose period divides it are included.
    starts : int
        Number of random starts on the section.
    seed : int
    engine : Engine, optional

    Returns
    -------
    tuple of Cycle
        Stable gaits first, then by contact sequence.

    Raises
    ------
    InputError
        If a parameter, a number or the contact sequence is invalid.

    Examples
    --------
    >>> import math
    >>> from gaitopt import find_cycles, rimless_wheel
    >>> gaits = find_cycles(rimless_wheel(), {"slope": math.radians(13)}, starts=20)
    >>> [(gait.sequence, round(gait.radius, 6)) for gait in gaits]
    [('stick | stick', 0.734042)]
    """
    requested = (
        None
        if sequence is None
        else str(ContactSequence.parse(sequence).require_closed("A search for cycles").check_periodic())
    )
    cycles = search_cycles(robot, parameters, law=law, steps=steps, starts=starts, seed=seed, engine=engine)
    return sort_cycles(
        cycle for cycle in cycles if requested is None or {str(each) for each in cycle.sequences} == {requested}
    )


def sort_cycles(cycles: Iterable[Cycle]) -> tuple[Cycle, ...]:
    """Return gaits in the order they are reported: stable ones first, then by contact sequence."""
    return tuple(sorted(cycles, key=lambda cycle: (not cycle.stable, cycle.sequence, cycle.radius)))


def search_cycles(
    robot: Robot,
    parameters: Mapping[str, float],
    *,
    law: Law | None = None,
    steps: int = 1,
    starts: int = 200,
    seed: int = 0,
    engine: Engine | None = None,
) -> Iterator[Cycle]:
    """Yield each distinct periodic gait when it is found; see :func:`find_cycles`."""
    for name, count in (("steps", steps), ("starts", starts)):
        Parameter(name, 1, "1", "", lower=1, whole=True).check(count)
    p = robot.vector(robot.resolve(parameters))
    law = law or passive(robot)
    walker = Walker(robot, law, p, engine or default_engine(law, robot), step_limits=_step_limits(robot, p))
    known: list[Cycle] = []
    for z in random_starts(walker, starts, seed):
        with defer_interrupt():
            cycle = find_cycle(walker, z, steps)
        if cycle is not None and not any(same_gait(cycle, other) for other in known):
            known.append(cycle)
            yield cycle


def find_cycle(walker: Walker, z: Array, steps: int = 1, options: FixedPointOptions | None = None) -> Cycle | None:
    """Return the periodic gait to which Newton's method converges from a point of the section, or None.

    Parameters
    ----------
    walker : Walker
    z : (n_z,) array
        Coordinates of ``Section(robot, p, sliding=True)``.
    steps : int
        Period of the gait in steps.
    options : FixedPointOptions, optional
    """
    section = Section(walker.robot, walker.p, sliding=True)
    return_map = ReturnMap(walker, section, steps)
    passage = return_map(z)
    if passage.end is None:
        return None
    if all(slips_throughout(s.modes, _outcome(s)) for s in passage.strides):
        # The foot speed drifts: search a gait that is periodic in all other coordinates.
        section, z = Section(walker.robot, walker.p, sliding=False, foot_speed=float(z[-1])), z[:-1]
        return_map = ReturnMap(walker, section, steps)
    point = find_fixed_point(return_map, z, options)
    if point is None:
        return None
    if not section.sliding and not all(slips_throughout(s.modes, _outcome(s)) for s in point.passage.strides):
        return None
    if _is_standing(walker, point.passage.states[0]):
        return None
    return make_cycle(walker, return_map, point)


def _is_standing(walker: Walker, state: Array) -> bool:
    """Return whether a walker stands with its legs together, the limit of ever smaller steps on a slope."""
    rates = state[list(walker.robot.state_entries.rates)]
    return bool(np.max(np.abs(rates)) < STANDING * _natural_rate(walker.robot, walker.p)[0])


def same_gait(one: Cycle, other: Cycle, tolerance: float = 1e-6) -> bool:
    """Return whether two cycles are the same gait, whichever of its steps comes first.

    The foot speed of complete slip is not compared.
    """
    if len(one.sequences) != len(other.sequences) or one.z.shape != other.z.shape:
        return False
    return any(bool(np.allclose(one.z, point, atol=tolerance)) for point in other.points)


def random_starts(walker: Walker, count: int, seed: int) -> Iterator[Array]:
    """Yield random points of the section with foot speed from which the walker completes at least one step.

    Small steps are slow: rates are drawn up to three times the angle determined by the touchdown condition over the
    natural time sqrt(l / g), so that pendulum-like motions of every size are sampled equally.  The foot of every other
    start is at rest.
    """
    robot, rng = walker.robot, np.random.default_rng(seed)
    section, n = Section(robot, walker.p, sliding=True), len(robot.angles)
    natural, height = _natural_rate(robot, walker.p)
    for i in range(count):
        angles = -rng.uniform(0.02, 0.5, n - 1)
        z = np.concatenate([angles, np.zeros(n + 1)])
        size = 3 * natural * abs(section.embed(z)[section.dependent_entry])
        z[n - 1 :] = rng.uniform(-1, 1, n + 1) * size
        z[-1] = z[-1] * height if i % 2 and np.isfinite(walker.contact.friction) else 0.0
        with defer_interrupt():
            completes_step = walker.stride(section.embed(z)).following is not None
        if completes_step:
            yield z


def _natural_rate(robot: Robot, p: Array) -> tuple[float, float]:
    """Return sqrt(g / l) [rad/s] and l [m], the height of the highest point drawn in the upright pose."""
    values = dict(zip([parameter.name for parameter in robot.parameters], p, strict=True))
    height = float(np.max(np.asarray(robot.figure(np.zeros(robot.n_q), p))[1]))
    return float(np.sqrt(values["gravity"] / height)), height


def _step_limits(robot: Robot, p: Array) -> StepLimits:
    return StepLimits(duration=20.0 / _natural_rate(robot, p)[0])


def _outcome(stride: Stride) -> Mode | None:
    return stride.impact.mode if stride.impact is not None else None
