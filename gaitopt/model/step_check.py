"""Checks of a robot's leg exchange and touchdown guard, at configurations with both feet on the ground."""

import functools
import math
import weakref

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot

EXACT = 1e-9
"""Largest relative error of a leg exchange and of the height at touchdown, which are exact up to rounding."""

CONFIGURATIONS, TRIES, ITERATIONS = 8, 10, 40
"""Number of touchdown configurations checked before a solve, of random starts for each, and of Newton steps."""

FAR = 1.5 * math.pi
"""Largest angle at which a touchdown is looked for [rad]: a hanging leg's may be measured from the upward vertical."""


@dataclass(frozen=True)
class StepCheck:
    """Relative errors of a robot's leg exchange and touchdown guard, the largest over several touchdowns.

    Attributes
    ----------
    exchange : float
        Change of kinetic, potential and elastic energy and of angular momentum by the leg exchange, distance of the
        exchanged feet from their old places.
    guard : float
        Height of the landing foot where the guard is zero; infinite if the guard has the wrong sign or is armed
        where the landing foot is not ahead of the stance foot.
    figure : float
        Distance between the sets of points in figures before and after the exchange of two legs; 0 if not checked.
    faults : tuple of str
        Faults with their remedies, one sentence each; empty for a correct robot.
    """

    exchange: float
    guard: float
    figure: float
    faults: tuple[str, ...]


@functools.lru_cache(maxsize=64)
def _faults(robot: Robot) -> tuple[str, ...]:
    p = robot.vector(robot.resolve({"slope": 0.1}))
    check = check_step(robot, p, CONFIGURATIONS, np.random.default_rng(0))
    return () if check is None else check.faults[:1]


def require_valid_step(robot: Robot) -> None:
    """Check leg exchange and touchdown guard of a robot with its default parameters, once per robot.

    Raises
    ------
    InputError
        If the leg exchange moves the robot, or the guard does not describe the landing foot's touchdown.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> require_valid_step(compass_biped())
    """
    if robot not in _EXEMPT and (faults := _faults(robot)):
        raise InputError(f"Robot {robot.name!r}: {' '.join(faults)}")


def exempt_from_step_check(robot: Robot) -> Robot:
    """Return a robot of the catalogue, whose step the tests of gaitopt check, exempt from the check before a solve.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> exempt_from_step_check(compass_biped()).name
    'compass_biped'
    """
    _EXEMPT.add(robot)
    return robot


_EXEMPT: "weakref.WeakSet[Robot]" = weakref.WeakSet()


def check_step(
    robot: Robot, p: np.ndarray, configurations: int, rng: "np.random.Generator", *, drawn: bool = False
) -> StepCheck | None:
    """Check leg exchange and guard at random touchdown configurations.

    The exchange only renames coordinates: kinetic and potential energy and angular momentum are unchanged for all
    rates, and the landing foot becomes the stance foot.  If two exchanges restore the angles (two legs),
    the former stance foot becomes the landing foot; otherwise (a rimless wheel, whose exchange rotates it back by one
    spoke) another foot is the next to land, and it is above the ground.  The guard is zero with the landing foot on
    the ground ahead of the stance foot, and positive with the foot above the ground.

    Parameters
    ----------
    robot : Robot
    p : (n_p,) array
        Parameter vector; with a slope other than zero the potential energy depends on both directions.
    configurations : int
    rng : Generator
    drawn : bool
        Whether the points in figures are checked as well.

    Returns
    -------
    StepCheck or None
        None if no touchdown configuration is found.
    """
    poses = _Poses(robot, p)
    touchdowns = poses.sample_touchdowns(configurations, rng)
    if not touchdowns:
        return None
    exchanges = [poses.measure_exchange(*touchdown) for touchdown in touchdowns]
    guards = [
        poses.measure_guard(*touchdown, size <= EXACT)
        for touchdown, (size, _) in zip(touchdowns, exchanges, strict=True)
    ]
    figures = [poses.measure_figure(*touchdown) for touchdown in touchdowns] if drawn else [(0.0, "")]
    exchange, guard, figure = worst = [_worst(errors) for errors in (exchanges, guards, figures)]
    faults = tuple(fault for size, fault in worst if not size <= EXACT)
    return StepCheck(exchange[0], guard[0], figure[0], faults)


def _worst(errors: list[tuple[float, str]]) -> tuple[float, str]:
    """Return the largest error with its sentence; nan counts as the largest."""
    return max(errors, key=lambda entry: math.inf if math.isnan(entry[0]) else entry[0])


class _Poses:
    """The Functions of a robot that describe its touchdown, at fixed parameters."""

    def __init__(self, robot: Robot, p: np.ndarray) -> None:
        self.robot, self.angles = robot, np.eye(robot.n_q)[2:]
        self._touchdown, self._landing, self._swap = (
            FastCall(function, p) for function in (robot.touchdown, robot.landing, robot.swap)
        )
        self._energy, self._momentum = FastCall(robot.energy, p), FastCall(robot.momentum, p)
        self._powers, self._upright = FastCall(robot.force_powers, p), FastCall(robot.upright, p)
        self._p, self._mass, self._size = p, float(robot.mass(p)), 0.0
        self._gravity = p[robot.index("gravity")]

    def sample_touchdowns(self, count: int, rng: "np.random.Generator") -> list[tuple[np.ndarray, np.ndarray]]:
        """Return at most `count` states (q, v) at which the guard falls through zero while armed.

        Angles are drawn near zero first, and from the whole circle if no touchdown is found near there.
        """
        found: list[tuple[np.ndarray, np.ndarray]] = []
        for number in range(2 * TRIES * count):
            spread = 0.5 if number < TRIES * count else FAR
            if len(found) == count or (found and spread > 0.5):
                break
            q = np.concatenate([[rng.normal(), 0.0], rng.uniform(-spread, spread, self.robot.n_q - 2)])
            v = rng.normal(size=self.robot.n_q)
            self._size = float(np.maximum(self._size, np.linalg.norm(self.foot(q) - q[:2])))  # keeps a nan
            if not self._move_to_touchdown(q) or self._upright(q)[0][0] <= 0:
                continue
            if self._touchdown(q, v)[1][0] > 0:
                v = -v
            if self._touchdown(q, v)[2][0] > 0:
                found.append((q, v))
        return found

    def foot(self, q: np.ndarray) -> np.ndarray:
        """Return the position of the landing foot, shape (2,) [m]."""
        return self._landing(q, np.zeros(q.size))[0].copy()

    def measure_exchange(self, q: np.ndarray, v: np.ndarray) -> tuple[float, str]:
        """Return the largest relative error of the leg exchange in a state, and a sentence about it."""
        after, rates = (part.copy() for part in self._swap(q, v))
        again = self._swap(after, rates)[0].copy()
        pairs = zip(self._mechanics(q, v), self._mechanics(after, rates), strict=True)
        kinetic, potential, turning, elastic = pairs
        errors = {
            "kinetic energy": abs(kinetic[1] - kinetic[0]) / kinetic[0],
            "potential energy": abs(potential[1] - potential[0]) / (self._mass * self._gravity * self._size),
            "elastic energy": abs(elastic[1] - elastic[0]) / (self._mass * self._gravity * self._size),
            "angular momentum": abs(turning[1] - turning[0]) / (np.sqrt(kinetic[0] * self._mass) * self._size),
        }
        size, name = _worst([(error, name) for name, error in errors.items()])
        apart = [float(np.linalg.norm(after[:2] - self.foot(q)) / self._size)]
        if self._restores(q, again):
            apart.append(float(np.linalg.norm(self.foot(after) - q[:2]) / self._size))
        elif not self.foot(after)[1] > EXACT * self._size:
            apart.append(math.inf)
        at = self._describe(q)
        advice = f"exchange must describe the same pose with exchanged legs and the same torso; observed {at}."
        if name == "elastic energy":
            advice = f"springs and potentials must be the same for both legs; observed {at}."
        if not size <= EXACT:
            return float(np.max([size, *apart])), f"the leg exchange changes the {name} by {100 * size:.3g} %: {advice}"
        return float(np.max(apart)), f"the leg exchange does not make the stance foot the next foot to land: {advice}"

    def measure_figure(self, q: np.ndarray, v: np.ndarray) -> tuple[float, str]:
        """Return the distance of the points drawn before and after the exchange of two legs, and a sentence."""
        after, rates = (part.copy() for part in self._swap(q, v))
        if not self._restores(q, self._swap(after, rates)[0]):
            return 0.0, ""
        before, exchanged = (np.asarray(self.robot.figure(pose, self._p)) for pose in (q, after))
        apart = np.linalg.norm(before[:, :, None] - exchanged[:, None, :], axis=0)
        size = np.max([*np.min(apart, axis=0), *np.min(apart, axis=1)]) / self._size
        fault = f"the leg exchange changes the figure: draw both legs alike; observed {self._describe(q)}."
        return float(size), fault

    def _restores(self, q: np.ndarray, again: np.ndarray) -> bool:
        """Return whether two exchanges have restored the angles, up to full turns."""
        return bool(np.max(np.abs(np.sin((again[2:] - q[2:]) / 2))) <= EXACT)

    def measure_guard(self, q: np.ndarray, v: np.ndarray, exchanged: bool) -> tuple[float, str]:
        """Return the guard's error in a state at which it falls through zero, and a sentence about it.

        The start of the next step is checked only if the leg exchange is correct.
        """
        (x, height), at = self.foot(q) - [q[0], 0.0], self._describe(q)
        if not abs(height) <= EXACT * self._size:
            return float(abs(height) / self._size), (
                f"touchdown is zero with the landing foot {height:.3g} m above the ground ({at}): it must be "
                "zero only with the foot on the ground."
            )
        guard = np.array([self._touchdown(q, unit)[1][0] for unit in self.angles])
        rise = np.array([self._landing(q, unit)[1][1] for unit in self.angles])
        after, rates = (part.copy() for part in self._swap(q, v))
        following = [part[0] for part in self._touchdown(after, rates)]
        starts_armed = exchanged and following[2] > 0 and following[0] <= EXACT * np.linalg.norm(guard)
        if x <= 1e-6 * self._size or starts_armed:
            return math.inf, (
                f"touchdown is armed where the landing foot is {x:.3g} m ahead of the stance foot ({at}), so "
                "a step would also end there, for example when the legs pass each other: arm it only when the foot is "
                "well ahead, for example armed = landing_foot[0] - c.foot[0] - 0.1, or write a touchdown that is zero "
                "only at the end of the step, for example th2 - th1 for a compass biped."
            )
        if not guard @ rise > 0:
            return math.inf, (
                f"touchdown has the wrong sign: it falls through zero while the landing foot rises ({at}); it "
                "must be positive with the foot above the ground. Write it with the opposite sign."
            )
        return float(abs(height) / self._size), ""

    def _move_to_touchdown(self, q: np.ndarray) -> bool:
        """Move the angles of `q`, in place, to where the guard is zero; return whether there is such a place nearby."""
        for _ in range(ITERATIONS):
            value = self._touchdown(q, self.angles[0])[0][0]
            slope = np.array([self._touchdown(q, unit)[1][0] for unit in self.angles])
            if not (math.isfinite(value) and slope @ slope > 0):
                return False
            if abs(value) <= 1e-13 * np.linalg.norm(slope):
                return bool(np.max(np.abs(q[2:])) <= FAR)
            q[2:] -= value / (slope @ slope) * slope
        return False

    def _mechanics(self, q: np.ndarray, v: np.ndarray) -> tuple[float, float, float, float]:
        """Return kinetic energy, energy of gravity, angular momentum and elastic energy."""
        kinetic, potential = (part.item() for part in self._energy(q, v))
        elastic = self._powers(q, v)[0].item()
        return kinetic, potential - elastic, self._momentum(q, v)[1].item(), elastic

    def _describe(self, q: np.ndarray) -> str:
        pose = zip(self.robot.angles, q[2:], strict=True)
        return "at " + ", ".join(f"{name} = {angle:.3g}" for name, angle in pose)
