"""Solution of an NLP as named tables, for warm starts."""

from collections.abc import Mapping
from dataclasses import field

from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array


@dataclass(frozen=True, eq=False)
class Table:
    """Quantities along the gait.

    Attributes
    ----------
    rows : tuple of str
        Names of the quantities.
    values : (n_rows, n_places) array
    multipliers : (n_rows, n_places) array
        Multipliers of their bounds.
    keys : tuple of str
        Identifiers of the rows in warm starts, independent of their printed names; `rows` by default.

    Examples
    --------
    >>> import numpy as np
    >>> Table(("th1",), np.zeros((1, 5)), np.zeros((1, 5))).rows
    ('th1',)
    """

    rows: tuple[str, ...]
    values: Array = field(repr=False)
    multipliers: Array = field(repr=False)
    keys: tuple[str, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        if not self.keys:
            object.__setattr__(self, "keys", self.rows)


@dataclass(frozen=True, eq=False, kw_only=True)
class Solution:
    """Unknowns and constraints of an optimised gait.

    Attributes
    ----------
    intervals : tuple of int
        Intervals of each phase.
    fractions : tuple of tuple of float, optional
        Instants of the nodes of each phase as fractions of its duration; None for equal intervals.
    cost_factor : float
        Estimated error of the objective per variation of the torques on the grid; nan if it is unknown.
    unknowns : mapping of str to Table
        Values and multipliers of the decision vector.
    constraints : mapping of str to Table
        Values and multipliers of the constraint rows.

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, compass_biped, solve
    >>> gait = solve(GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.2, speed=0.6, step_length=0.45,
    ...     limits=Limits(torque=6), objective="torque_squared",
    ... ))
    >>> gait.solution.unknowns["torque"].rows, gait.solution.unknowns["torque"].values.shape
    (('ankle torque', 'hip torque'), (2, 41))
    """

    intervals: tuple[int, ...]
    unknowns: Mapping[str, Table] = field(repr=False)
    constraints: Mapping[str, Table] = field(repr=False)
    fractions: tuple[tuple[float, ...], ...] | None = field(default=None, repr=False)
    cost_factor: float = field(default=float("nan"), repr=False)
