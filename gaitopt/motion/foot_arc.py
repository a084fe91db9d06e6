"""Round feet as they are drawn: the part of the rim that rolls on the ground, and marks that show how it turns."""

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion import Array, Segment
from gaitopt.motion.motion_view import PhaseView
from gaitopt.motion.view_motion import AnyMotion, view_motion

WIDENED, ADDED = 1.15, 0.05
"""The arc drawn extends beyond the largest angle at which it touches the ground: by a factor, and by an angle [rad]."""

SAMPLES, MARKS = 49, 5
"""Points of an arc, and radial marks on it."""

CENTRED = 1e-6
"""Distance of a drawn point from the centre of an arc over its radius, below which the leg ends there."""

MARK_LENGTH = 0.14
"""Length of a mark over the radius."""


@dataclass(frozen=True)
class FootArc:
    """The shape of a round foot.

    Attributes
    ----------
    half_opening : float [rad]
        Angle between the middle of the foot and its heel or toe; pi for a wheel.

    Examples
    --------
    >>> wheel = FootArc(np.pi)
    >>> wheel.outline(np.array([0.0, 0.3, 0.3, 0.0])).min(axis=1).round(6).tolist()
    [-0.3, 0.0]
    """

    half_opening: float

    def outline(self, rim: Array) -> Array:
        """Return the arc from heel to toe, shape (2, SAMPLES, ...) [m].

        Parameters
        ----------
        rim : (4, ...) array
            Centre [m], radius [m] and clockwise angle [rad], as in :attr:`Segment.rims`.
        """
        return self._places(rim, np.linspace(-self.half_opening, self.half_opening, SAMPLES), 1.0)

    def marks(self, rim: Array) -> Array:
        """Return radial marks fixed to the foot, shape (2, MARKS, 2, ...) [m]: each from the rim inwards."""
        spacing = 2 * self.half_opening / (MARKS if self.half_opening >= np.pi else MARKS + 1)
        angles = spacing * (np.arange(MARKS, dtype=np.float64) - (MARKS - 1) / 2)
        ends = [self._places(rim, angles, part) for part in (1.0, 1 - MARK_LENGTH)]
        return np.stack(ends, axis=2)

    def spoke(self, rim: Array) -> Array:
        """Return the line from the centre of the arc to its middle, shape (2, 2, ...) [m]."""
        middle = self._places(rim, np.zeros(1), 1.0)
        return np.concatenate([np.asarray(rim)[:2, None], middle], axis=1)

    def _places(self, rim: Array, angles: Array, share: float) -> Array:
        """Return points at angles on the foot, counted from its middle to the toe, at a share of the radius."""
        x, y, radius, turn = rim
        direction = turn - angles.reshape(-1, *(1,) * np.ndim(turn))
        return np.stack([x - share * radius * np.sin(direction), y - share * radius * np.cos(direction)])


def find_foot_arc(motion: AnyMotion) -> FootArc | None:
    """Return the shape of the feet of a motion, or None if they are points.

    The files of a gait do not state where a foot ends: the arc is as long as the motion needs.

    Examples
    --------
    >>> from gaitopt import load
    >>> find_foot_arc(load("docs/examples/compass_slip.h5").motion) is None
    True
    """
    angles = [
        segment.rims[3, number]
        for segment in view_motion(motion).segments
        if segment.rims is not None
        for number, mode in enumerate(segment.modes)
        if mode is not Mode.FREE and segment.rims[2, number, 0] > 0
    ]
    if not angles:
        return None
    reached = WIDENED * float(np.max(np.abs(np.concatenate(angles)))) + ADDED
    return FootArc(min(reached, np.pi))


def find_open_feet(points: Array, rims: Array) -> list[int]:
    """Return the feet whose leg is drawn up to the centre of the arc only.

    Parameters
    ----------
    points : (2, n_points) array [m]
    rims : (4, n_c) array

    Examples
    --------
    >>> find_open_feet(np.array([[0.0, 0.5], [0.3, 0.3]]), np.array([[0.5, 0.3, 0.3, 0.0], [1.0, 0.3, 0.3, 0.0]]).T)
    [0]
    """
    distances = np.linalg.norm(points[:, :, None] - rims[:2, None], axis=0).min(axis=0)
    return np.flatnonzero((rims[2] > 0) & (distances < CENTRED * rims[2])).tolist()


def figure_points(motion: AnyMotion, segment: Segment | PhaseView) -> Array:
    """Return everything drawn of a walker, shape (2, n, K) [m]: its points, and the arcs of its feet."""
    arc = find_foot_arc(motion)
    if arc is None or segment.rims is None:
        return segment.points
    outlines = arc.outline(segment.rims[:, segment.rims[2, :, 0] > 0])
    return np.concatenate([segment.points, *np.moveaxis(outlines, 2, 0)], axis=1)
