"""Arguments of a custom law's function: the state of the robot and its plan, with named entries."""

from collections.abc import Iterator, Mapping, Sequence

import casadi as ca

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.motion.motion import Motion
from gaitopt.motion.planar_motion import PlanarMotion

PLACES = {
    "coordinate": "state.q",
    "rate": "state.v",
    "planned coordinate": "plan.q",
    "planned rate": "plan.v",
    "planned torque": "plan.torque",
}
"""Where a custom law finds each kind of entries."""


class NamedEntries(Mapping[str, ca.SX]):
    """Expressions by name, such as the coordinates of a robot.

    Parameters
    ----------
    kind : str
        What an entry is, for messages: ``"coordinate"`` or ``"planned torque"``.
    names : sequence of str
    vector : SX, shape (n, 1)
        The entries in the order of the names.
    absence : str
        Reason why there are no entries.

    Examples
    --------
    >>> q = NamedEntries("coordinate", ["left", "right"], ca.SX.sym("q", 2))
    >>> q["right"], q.vector.shape
    (SX(q_1), (2, 1))
    >>> q["rigth"]
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: There is no coordinate 'rigth'. Did you mean 'right'? Known: left, right.
    """

    def __init__(self, kind: str, names: Sequence[str], vector: ca.SX, absence: str = "") -> None:
        self.kind, self.names, self.vector, self.absence = kind, tuple(names), vector, absence

    def __getitem__(self, name: str) -> ca.SX:
        """Return the entry of this name, shape (1, 1)."""
        if name not in self.names:
            reason = self.absence or suggest(str(name), self.names)
            raise InputError(f"There is no {self.kind} {name!r}. {reason}")
        return self.vector[self.names.index(name)]

    def __getattr__(self, name: str) -> ca.SX:
        """Raise AttributeError, which states how an entry is written."""
        names = self.__dict__.get("names", ())  # which a copy has only later
        reason = "" if name in names else f" {suggest(name, names)}"
        place = PLACES.get(self.__dict__.get("kind", ""), "...")
        raise AttributeError(f"write {place}[{name!r}] in place of {place}.{name}.{reason}")

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


@dataclass(frozen=True, eq=False)
class FeedbackState:
    """The state of the robot as expressions: the first argument of a custom law's function.

    Attributes
    ----------
    time : SX [s]
        Time since the last touchdown; for a robot with several contacts, since the impact that ends the period.
    q, v : NamedEntries
        Coordinates and their rates by the names of the coordinates; ``state.q.vector`` is the whole vector.

    Examples
    --------
    >>> q, v = (NamedEntries(kind, ["th"], ca.SX.sym(kind)) for kind in ("coordinate", "rate"))
    >>> FeedbackState(ca.SX.sym("t"), q, v).v["th"]
    SX(rate)
    """

    time: ca.SX
    q: NamedEntries
    v: NamedEntries


@dataclass(frozen=True, eq=False)
class FeedbackPlan:
    """The planned motion at the time of the state: the second argument of a custom law's function.

    Attributes
    ----------
    q, v : NamedEntries
        Planned coordinates and rates as expressions.  The plan of a robot with one foot on the ground contains its
        angles, and the rate ``"x"`` of the stance foot along the ground.
    torque : NamedEntries [N m or N]
        Planned torques by the names of the actuators.
    motion : Motion, PlanarMotion or None
        The motion as numbers, for example to fit a polynomial to its samples.
    part : int
        Number of the part of the period, counted from 0; the parts are divided by the impacts within the period.

    Examples
    --------
    >>> nothing = NamedEntries("planned torque", [], ca.SX(0, 1), "The law has no plan.")
    >>> FeedbackPlan(nothing, nothing, nothing, None, 0).torque["hip"]
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: There is no planned torque 'hip'. The law has no plan.
    """

    q: NamedEntries
    v: NamedEntries
    torque: NamedEntries
    motion: Motion | PlanarMotion | None
    part: int
