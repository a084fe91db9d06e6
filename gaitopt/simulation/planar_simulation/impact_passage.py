"""The passage of an impact in the simulator: impulses of actuators before it, the plastic impact, impulses after it.

Every instant is solved by the laws of a plastic impact: impulses P of the actuators are the velocity jump M^-1 E P, to
which the closed contacts react.
"""

from typing import NamedTuple

import numpy as np

from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.mode_selection import Determinacy
from gaitopt.model.contacts.multicontact_impact import ImpactOutcome
from gaitopt.motion.actuator_impulses import ActuatorImpulses, EventImpulses, Moment, split_work
from gaitopt.motion.motion import Array
from gaitopt.simulation.planar_simulation.contact_resolution import ContactResolution
from gaitopt.simulation.planar_simulation.planar_state import PlanarState
from gaitopt.status import Stop

REST_NORMAL = 1e-5
"""Normal speed [m/s] below which a contact does not separate in an impact: it would rise by less than 1e-11 m."""

UNDETERMINED = {Determinacy.AMBIGUOUS: Stop.AMBIGUOUS, Determinacy.INCONSISTENT: Stop.INCONSISTENT}
"""Reasons of a stop if modes or impact are not unique."""


class ImpactPassage(NamedTuple):
    """An impact with the impulses of actuators before and after it.

    Attributes
    ----------
    outcome : ImpactOutcome
        Outcome of the impact alone.
    stages : tuple of ActuatorImpulses
    v_plus : (n_q,) array
        Velocity at the end.
    closed : list of int
        Contacts that do not separate.
    """

    outcome: ImpactOutcome
    stages: tuple[ActuatorImpulses, ...]
    v_plus: Array
    closed: list[int]


class _JumpEnd(NamedTuple):
    """Velocity, closed and latched contacts between two velocity jumps."""

    v: Array
    closed: list[int]
    latched: frozenset[int]


def pass_impact(
    contacts: ContactResolution,
    p: Array,
    state: PlanarState,
    touching: tuple[list[int], frozenset[int]],
    impulses: EventImpulses | None,
) -> ImpactPassage | Stop:
    """Return the passage of an impact, or the reason of a stop if an instant is not determined.

    Parameters
    ----------
    contacts : ContactResolution
    p : (n_p,) array
    state : PlanarState
        Before the impact.
    touching : (list of int, frozenset of int)
        Closed and closing contacts, and the latched stops among them.
    impulses : EventImpulses or None
    """
    q, at, stages = state.q, _JumpEnd(state.v, state.closed, state.latched), list[ActuatorImpulses]()
    if impulses is not None and np.any(impulses.before):
        jump = _jump(contacts, q, at, impulses.before)
        if isinstance(jump, Stop):
            return jump
        stages.append(_record(contacts, p, (q, at.v, jump[0].v), "before", (impulses.before, jump[1])))
        at = jump[0]
    impact = _jump(contacts, q, at._replace(closed=touching[0], latched=touching[1]), None)
    if isinstance(impact, Stop):
        return impact
    at, outcome = impact
    if outcome is None:
        raise ValueError("an impact has contacts")
    if impulses is not None and np.any(impulses.after):
        jump = _jump(contacts, q, at, impulses.after)
        if isinstance(jump, Stop):
            return jump
        stages.append(_record(contacts, p, (q, at.v, jump[0].v), "after", (impulses.after, jump[1])))
        at = jump[0]
    return ImpactPassage(outcome, tuple(stages), at.v, at.closed)


def _jump(
    contacts: ContactResolution, q: Array, at: _JumpEnd, impulse: Array | None
) -> tuple[_JumpEnd, ImpactOutcome | None] | Stop:
    """Return the instant after a velocity jump, and its outcome at the contacts, None without contacts."""
    free = at.v if impulse is None else at.v + contacts.velocity_jump(q, at.v, impulse)
    if not at.closed:
        return at._replace(v=free), None
    outcome = contacts.impact(q, free, at.closed, at.latched)
    if outcome.status is not Determinacy.UNIQUE:
        return UNDETERMINED[outcome.status]
    v, closed = _close_slow(contacts, q, outcome, at.closed)
    return _JumpEnd(v, closed, at.latched & set(closed)), outcome


def _close_slow(
    contacts: ContactResolution, q: Array, outcome: ImpactOutcome, touching: list[int]
) -> tuple[Array, list[int]]:
    """Return velocity and closed contacts after an impact.

    Contacts that would separate more slowly than `REST_NORMAL` remain closed: infinitely many impacts in a finite
    time, as of a rocking block, end in this way.
    """
    v, names = outcome.velocity_plus, contacts.robot.contact_names
    free = {i for i in touching if outcome.modes[names[i]] is Mode.FREE}
    speeds = contacts.kinematics(q, v).normal_speed
    slow = {i for i in free if speeds[i] < REST_NORMAL}
    closed = [i for i in touching if i not in free or i in slow]
    sticking = [i for i in touching if outcome.modes[names[i]] is Mode.STICK]
    return (contacts.stop_motion(q, v, closed, sticking) if slow else v), closed


def _record(
    contacts: ContactResolution,
    p: Array,
    motion: tuple[Array, Array, Array],
    moment: Moment,
    acting: tuple[Array, ImpactOutcome | None],
) -> ActuatorImpulses:
    """Return the record of impulses of actuators at q between two velocities, and of the outcome at the contacts."""
    (q, before, after), (impulse, outcome), robot = motion, acting, contacts.robot
    modes, reactions = ({}, {}) if outcome is None else (outcome.modes, outcome.impulse)
    rates = (np.array(robot.joint_rates(q, v, p)).reshape(robot.n_u) for v in (before, after))
    generated, absorbed = split_work(impulse, *rates)
    return ActuatorImpulses(
        moment=moment,
        impulse=impulse,
        reaction=np.array([reactions.get(name, (0.0, 0.0)) for name in robot.contact_names]),
        outcome=ContactState(tuple((name, modes.get(name, Mode.FREE)) for name in robot.contact_names)),
        v_minus=before,
        v_plus=after,
        generated=generated,
        absorbed=absorbed,
    )
