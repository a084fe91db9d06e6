"""Impulses of actuators at an impact: their reactions at the contacts, and the work that they generate and absorb."""

from collections.abc import Iterable
from typing import Literal, NamedTuple

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.motion.motion import Array

Moment = Literal["before", "after"]
MOMENTS: tuple[Moment, ...] = ("before", "after")
"""Just before an impact, with the contacts closed until then, or just after it, with those that stay closed."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ActuatorImpulses:
    """The simultaneous impulses of actuators just before or just after an impact.

    Attributes
    ----------
    moment : {"before", "after"}
    impulse : (n_u,) array
        Impulse of each actuator [N s or N m s], zero for those without one.
    reaction : (n_c, 2) array
        Impulse (Lambda_t, Lambda_n) of each contact [N s].
    outcome : ContactState
        Mode of each contact in this instant; free if it has no impulse.
    v_minus, v_plus : (n_q,) arrays
    generated, absorbed : (n_u,) arrays [J]
        Positive and negative work of each actuator, both >= 0.

    Examples
    --------
    >>> pushed = ActuatorImpulses(
    ...     moment="before", impulse=np.array([0.1]), reaction=np.array([[0.0, 0.1]]),
    ...     outcome=ContactState.of({"foot": "stick"}), v_minus=np.zeros(1), v_plus=np.array([0.1]),
    ...     generated=np.array([0.005]), absorbed=np.array([0.0]),
    ... )
    >>> pushed.work
    0.005
    """

    moment: Moment
    impulse: Array
    reaction: Array
    outcome: ContactState
    v_minus: Array
    v_plus: Array
    generated: Array
    absorbed: Array

    @property
    def work(self) -> float:
        """Work of all actuators [J]: generated minus absorbed."""
        return float(self.generated.sum() - self.absorbed.sum())


class EventImpulses(NamedTuple):
    """Impulses of all actuators [N s or N m s] just before and just after an impact, shape (n_u,) each."""

    before: Array
    after: Array

    @classmethod
    def of(cls, stages: Iterable[ActuatorImpulses]) -> "EventImpulses | None":
        """Return the impulses of an event; None if it has none."""
        values = {stage.moment: stage.impulse for stage in stages}
        if not values:
            return None
        zero = np.zeros_like(next(iter(values.values())))
        return cls(values.get("before", zero), values.get("after", zero))


def split_work(impulse: Array, before: Array, after: Array) -> tuple[Array, Array]:
    """Return the generated and the absorbed work of impulses, both >= 0, shape (n_u,) each [J].

    While simultaneous impulses act, the rates of the joints change linearly with the share of the impulses that has
    acted.  The work is thus impulse (before + after) / 2, and if a rate changes its sign, one part of the impulse
    absorbs energy and the other part generates it.

    Parameters
    ----------
    impulse : (n_u,) array [N s or N m s]
    before, after : (n_u,) arrays
        Rates on which the actuators do work, before and after [m/s or rad/s].

    Examples
    --------
    >>> generated, absorbed = split_work(np.array([2.0, 2.0]), np.array([0.0, -1.0]), np.array([1.0, 1.0]))
    >>> generated.tolist(), absorbed.tolist()
    ([1.0, 0.5], [0.0, 0.5])
    """
    power = np.sort(np.stack([impulse * before, impulse * after]), axis=0)
    low, high = power
    mixed = (low < 0) & (high > 0)
    width = np.where(mixed, high - low, 1.0)
    mean = (low + high) / 2
    generated = np.where(mixed, high**2 / (2 * width), np.maximum(mean, 0.0))
    return generated, generated - mean
