"""verify_planar: replay the torques of a planar gait in the simulator, and compare the motions."""

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.torque_interpolation import interpolate_torque
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.actuator_impulses import EventImpulses
from gaitopt.motion.ground_penetration import find_penetrations
from gaitopt.motion.motion import Array
from gaitopt.motion.motion_view import name_modes
from gaitopt.motion.planar_gait import PlanarGait, PlanarVerification
from gaitopt.motion.planar_gait_summary import friction_margin
from gaitopt.motion.planar_motion import PlanarEvent, PlanarMotion, PlanarSegment
from gaitopt.motion.undecided_touchdowns import find_undecided_touchdowns
from gaitopt.parameters import check_type
from gaitopt.reductions import worst
from gaitopt.simulation.ambiguous_contact import describe_ambiguity
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_simulator import PlanarRollout, make_planar_motion, make_planar_segment
from gaitopt.simulation.planar_simulation.planar_state import PlanarArc, PlanarState
from gaitopt.simulation.replay_difference import describe_differences, describe_soft_touchdowns
from gaitopt.simulation.replay_tolerances import Tolerances
from gaitopt.status import Stop

OVERTIME = 0.02
"""Share of the period by which the replay may exceed the plan."""

TIE = 1e-6
"""Impulse [N s] below which the mode of a contact after an impact is not determined."""

SHORT_SLIP = 1e-7
"""Duration [s] below which the replay omits the slip of a foot before its lift-off; it changes speeds by 1e-10 m/s."""

FIRST_INSTANT = 1e-6
"""Time [s] after the start of the replay in which the smooth event at the boundary of two periods may occur: rounding
decides whether the first state is before or after this event."""

INSTANT = 1e-9
"""Least time [s] between a state and the next corner of the torques."""


@check_arguments
def verify_planar(gait: PlanarGait, *, tolerances: Tolerances | None = None) -> PlanarGait:
    """Replay a gait in open loop and attach the result of the comparison.

    The simulator receives the first state and the torques as functions of time, which begin again at each impact; it
    determines modes, event times and outcomes.

    Parameters
    ----------
    gait : PlanarGait
    tolerances : Tolerances, optional
        The tolerance of the cost of transport is not used.

    Returns
    -------
    PlanarGait
        The gait with its `verification`; its status is ``NOT_VERIFIED`` if the verification fails.

    Raises
    ------
    InputError
        If `gait` is not a PlanarGait.

    Examples
    --------
    >>> from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
    >>> from gaitopt.ocp import Collocation, PlanarLimits, PlanarProblem, solve_planar
    >>> gait = solve_planar(PlanarProblem(
    ...     robot=compass_with_two_feet(), sequence="foot A stick |", friction=1.0, speed=0.633, step_length=0.4713,
    ...     objective="torque_squared", limits=PlanarLimits(torque={"ankle B": 0}),
    ...     transcription=Collocation(intervals=10)))
    >>> verify_planar(gait).verification.passed
    True
    """
    check_type("gait", gait, PlanarGait, "a PlanarGait such as solve_planar(problem)")
    rollout = replay_planar(gait)
    return gait.with_verification(_compare(gait, rollout, tolerances or Tolerances()))


@check_arguments
def replay_planar(gait: PlanarGait) -> PlanarRollout:
    """Simulate one period of a gait under its torques.

    The integration restarts at the nodes inside phases, where the torques have corners.  The replay ends after as many
    events as the plan has.

    Examples
    --------
    >>> replay_planar.__name__
    'replay_planar'
    """
    return _Replay(gait).run()


class _Replay:
    """A replay: one automaton for the torques between two impacts, and the arcs and events so far."""

    def __init__(self, gait: PlanarGait) -> None:
        self.planned, self.robot = gait.motion, gait.robot
        torques, values, terrain = _torques(gait), self.planned.parameters, self.planned.terrain
        self.automata = [
            PlanarAutomaton(self.robot, values, torque, terrain, short_slip=SHORT_SLIP) for torque in torques
        ]
        self.impacts = 0
        self.segments: list[PlanarSegment] = []
        self.arcs: list[PlanarArc] = []
        self.events: list[PlanarEvent] = []

    def run(self) -> PlanarRollout:
        """Return the simulated motion."""
        start = self._pass_boundary(self._begin())
        state: PlanarState | Stop = start
        while isinstance(state, PlanarState) and len(self.events) < len(self.planned.events):
            state = self._continue(state)
        stop = state if isinstance(state, Stop) else Stop.EVENT_REACHED
        motion = replace(make_planar_motion(self.automata[0], [], self.events), segments=tuple(self.segments))
        ends = [one if isinstance(one, PlanarState) else None for one in (start, state)]
        return PlanarRollout(motion, stop, ends[0], ends[1], tuple(self.arcs))

    def _begin(self) -> PlanarState | Stop:
        """Return the first state of the plan, on its constraints, with the modes that the simulator chooses."""
        first, automaton = self.planned.segments[0], self.automata[0]
        guess = PlanarState(0.0, first.q[:, 0], first.v[:, 0], first.state, (False,) * len(self.robot.switches))
        phase, n = automaton.phase(guess), self.robot.n_q
        y = phase.project(guess.y, phase.anchors(guess.y))
        latched = tuple(name for name, mode in first.state.modes if mode is Mode.LATCHED)
        return automaton.begin(y[:n], y[n:], latched=latched)

    def _pass_boundary(self, start: PlanarState | Stop) -> PlanarState | Stop:
        """Return the state after the smooth events of the first instant if the plan has them at its end instead.

        A period that begins at the onset of slip begins on the friction cone, where stick and slip are both consistent.
        """
        first, events = self.planned.segments[0], self.planned.events
        if isinstance(start, Stop) or not events or events[-1].is_impact:
            return start
        state = start
        for _ in self.robot.contacts:  # contacts that change simultaneously change one after another
            if state.contacts == first.state:
                return state
            arc = self.automata[0].flow(state, FIRST_INSTANT)
            resolved = Stop.SINGULAR if arc.failed or arc.ended_by is None else self.automata[0].events.resolve(arc)
            if isinstance(resolved, Stop) or resolved[1].is_impact:
                return start
            state = resolved[0]
        return state if state.contacts == first.state else start

    def _continue(self, state: PlanarState) -> PlanarState | Stop:
        """Return the state after the next event, or the reason of a stop."""
        arc = self._flow(state)
        self.arcs.append(arc)
        self.segments.append(make_planar_segment(self.automata[self.impacts], arc))
        if arc.failed or arc.ended_by is None:
            return Stop.SINGULAR if arc.failed else Stop.DURATION_DONE
        planned = EventImpulses.of(self.planned.events[len(self.events)].actuator_impulses)
        resolved = self.automata[self.impacts].events.resolve(arc, planned)
        if not isinstance(resolved, Stop) and resolved[1].is_impact and self.impacts + 1 < len(self.automata):
            self.impacts += 1  # the torques after the impact determine the modes
            resolved = self.automata[self.impacts].events.resolve(arc, planned)
        if isinstance(resolved, Stop):
            return resolved
        self.events.append(resolved[1])
        return resolved[0]

    def _flow(self, state: PlanarState) -> PlanarArc:
        """Return the smooth motion from a state to its event, or to the time limit."""
        automaton, n = self.automata[self.impacts], self.robot.n_q
        limit = self.planned.period * (1 + OVERTIME)
        inside = [time for segment in self.planned.segments for time in segment.time[1:-1]]
        corners = [time for time in inside if time > state.time + INSTANT]  # not at events, where guards vanish
        times: list[Array] = []
        columns: list[Array] = []
        now = state
        works = np.zeros(automaton.phase(state).n_works)
        for until in [*sorted(set(corners)), limit]:
            arc = automaton.flow(now, float(until))
            states = arc.states.copy()
            states[2 * n :] += works[:, None]
            times.append(arc.time if not times else arc.time[1:])
            columns.append(states if not columns else states[:, 1:])
            if arc.failed or arc.ended_by is not None:
                break
            last, works = states[:, -1], states[2 * n :, -1]
            now = replace(now, time=float(arc.time[-1]), q=last[:n].copy(), v=last[n : 2 * n].copy())
        return PlanarArc(state, np.concatenate(times), np.hstack(columns), arc.ended_by, arc.failed)


def _torques(gait: PlanarGait) -> list[ca.Function]:
    """Return the torques of the plan between its impacts, and those of the next period after a final impact."""
    motion, robot = gait.motion, gait.robot
    groups: list[list[PlanarSegment]] = [[]]
    for segment, event in zip(motion.segments, motion.events, strict=True):
        groups[-1].append(segment)
        if event.is_impact:
            groups.append([])
    functions = [interpolate_torque(robot.n_q, *_table(group)) for group in groups if group]
    if not groups[-1]:
        mirror = np.eye(robot.n_u) if robot.mirror is None else robot.mirror.actuators.T
        time, torque = _table(groups[0])
        functions.append(interpolate_torque(robot.n_q, time - time[0] + motion.period, mirror @ torque))
    return functions


def _table(segments: Sequence[PlanarSegment]) -> tuple[Array, Array]:
    """Return times and torques of adjacent segments, each time once."""
    time = np.concatenate([segment.time for segment in segments])
    torque = np.concatenate([segment.torque for segment in segments], axis=1)
    time, kept = np.unique(time, return_index=True)
    return time, torque[:, kept]


def _compare(gait: PlanarGait, rollout: PlanarRollout, tolerances: Tolerances) -> PlanarVerification:
    planned, walked, reasons = gait.motion, rollout.motion, []
    if rollout.stop is not Stop.EVENT_REACHED:
        hint, remedy = rollout.stop.hint, describe_ambiguity(gait, rollout) if rollout.stop is Stop.AMBIGUOUS else ""
        if remedy:  # instead of the general one
            hint = f"{hint.partition(' Try ')[0]} {remedy}"
        reasons.append(f"the replay stopped {_describe_end(walked)}: {hint}")
    differs = bool(walked.segments) and walked.sequence != planned.sequence
    differences = describe_differences(gait.robot, planned, walked)
    reasons += differences if differs else []
    error, period_error, residual = float("inf"), float("inf"), float("inf")
    complete = rollout.end is not None and len(walked.events) == len(planned.events)
    if complete and rollout.end is not None:
        plan, real = planned.events[-1], walked.events[-1]
        error = worst(np.abs(plan.q - real.q), np.abs(plan.v_plus - rollout.end.v))
        period_error, residual = abs(plan.time - real.time), walked.ledger().relative_residual
        reasons += _compare_modes(plan, rollout.end)
    if rollout.stop is Stop.EVENT_REACHED:
        reasons += [
            penetration.describe_touchdown()
            for penetration in find_penetrations(gait.robot, walked)
            if penetration.is_touchdown_from_below
        ]
        reasons += [one.describe_failure() for one in find_undecided_touchdowns(gait.robot, walked)]
    checks = (
        ("state after the last event", error, tolerances.state, ""),
        ("period", period_error, tolerances.period, " s"),
        ("energy ledger", residual, tolerances.energy, ""),
    )
    for name, size, limit, unit in checks:
        if not size <= limit and (complete or not reasons):  # a replay that stopped early is not compared
            reasons.append(f"the {name} differs by {size:.2e}{unit}, more than {limit:g}{unit}")
    if reasons:  # with the planned sequence and end, another order of simultaneous changes is no failure
        reasons = [*describe_soft_touchdowns(planned), *(() if differs else differences), *reasons]
    replayed = gait.replace_fields(motion=walked)
    return PlanarVerification(
        passed=not reasons,
        sequence=walked.sequence,
        stop=rollout.stop.key,
        state_error=error,
        period_error=period_error,
        energy_residual=residual,
        reasons=tuple(reasons),
        cost_of_transport=replayed.cost_of_transport if walked.segments else float("nan"),
        cone_margin=friction_margin(replayed),
    )


def _describe_end(walked: PlanarMotion) -> str:
    """Return when a replay ended, after which event, and with which closed contacts."""
    if not walked.segments:
        return "at its start"
    last = walked.segments[-1]
    event = f"after '{' & '.join(walked.events[-1].names)}'" if walked.events else "before the first event"
    modes = name_modes(walked.contacts, tuple(mode for _, mode in last.state.modes))
    return f"at {last.time[-1]:.4g} s, {event}, with {modes}"


def _compare_modes(plan: PlanarEvent, end: PlanarState) -> list[str]:
    """Return the contacts whose modes after the last event differ; those without impulse may differ at an impact."""
    return [
        f"{name} is {real.value} after the last event instead of {mode.value}"
        + (": use a larger Margins.impact_cone" if plan.is_impact and mode is Mode.STICK and real.slips else "")
        for (name, mode), (_, real), impulse in zip(plan.after.modes, end.contacts.modes, plan.impulse, strict=True)
        if mode is not real and (not plan.is_impact or np.abs(impulse).max() > TIE)
    ]
