"""The ground: a slope with Coulomb friction, independent of the robot."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.terrain import TERRAIN, Terrain, check_terrain
from gaitopt.parameters import Parameter

GROUND = (
    Parameter("slope", 0.0, "rad", "downhill slope", lower=-math.pi / 2, upper=math.pi / 2),
    Parameter("friction", math.inf, "1", "coefficient of kinetic friction", lower=0.0, infinite=True),
    Parameter("static_friction_ratio", 1.0, "1", "static over kinetic friction", lower=1.0),
)
"""Parameters of the ground, the last entries of the parameter vector of every robot."""


@check_arguments
@dataclass(frozen=True)
class Ground(Mapping[str, Any]):
    """A plane with Coulomb friction, as a mapping from the names of the ground's parameters to their values.

    A contact at rest sticks while abs(f_t) <= static_friction f_n; for a sliding contact abs(f_t) = friction f_n.  The
    impulses of impacts, sticking or slipping, have the coefficient `friction`.

    Parameters
    ----------
    slope : float
        Downhill slope [rad].
    friction : float
        Coefficient of kinetic friction; ``inf`` for a foot that does not slip.
    static_friction : float, optional
        Coefficient of static friction, at least `friction`; by default equal to it.
    terrain : Terrain, optional
        Steps, ramps and patches of other friction.

    Raises
    ------
    InputError
        If a value is outside its range.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> ground = Ground(slope=0.02, friction=0.5, static_friction=0.6)
    >>> compass_biped().resolve({"leg_mass": 5, **ground})["static_friction_ratio"]
    1.2
    """

    slope: float = 0.0
    friction: float = math.inf
    static_friction: float | None = None
    terrain: Terrain | None = None

    def __post_init__(self) -> None:
        check_terrain(self.terrain)
        for parameter in GROUND[:2]:
            parameter.check(getattr(self, parameter.name))
        if self.static_friction is not None and not self.static_friction >= self.friction:
            raise InputError(
                f"static_friction must be at least friction = {self.friction:g}, got {self.static_friction!r}."
            )

    @property
    def static_friction_ratio(self) -> float:
        """Static over kinetic friction."""
        if self.static_friction is None or self.static_friction == self.friction:
            return 1.0
        if self.friction == 0:
            raise InputError(
                "friction must be greater than 0 if static_friction is, got 0: the ratio of the two is a parameter."
            )
        return self.static_friction / self.friction

    def __getitem__(self, name: str) -> Any:
        if name not in list(self):
            raise KeyError(name)
        return self.terrain if name == TERRAIN else float(getattr(self, name))

    def __iter__(self) -> Iterator[str]:
        names = [parameter.name for parameter in GROUND]
        return iter(names if self.terrain is None else [*names, TERRAIN])

    def __len__(self) -> int:
        return len(list(iter(self)))
