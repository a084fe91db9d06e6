"""Event-driven integration of a walker with one foot on the ground, and fixed points of its return map.

A walker has the attributes and methods of `tests.references.compass_passive.Compass`: a state whose entry ``speed`` is
the speed of the foot along the ground, ``motion(mode, y)`` -> (rate of y, f_t, f_n) with mode 0 for stick and +1 or -1
for slip, a mode at the start that may be fixed (``stick_at_start``), a touchdown ``guard`` that falls through zero
where the walker is ``armed``, and ``impact(y, mode)`` -> (state of the next step, impulse), which slips where the
impulse is outside a cone ``impact_mu``.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

TOLERANCE = {"rtol": 1e-12, "atol": 1e-13}
NAMES = {0: "stick", 1: "slip+", -1: "slip-"}


@dataclass(frozen=True)
class Step:
    """One step: state after its impact, duration, contact sequence, impulse, and phases (mode, times, states)."""

    after: np.ndarray
    period: float
    sequence: str
    impulse: np.ndarray
    phases: list


def choose_mode(walker, y):
    """Return the mode of a foot with this state: a resting foot sticks where the force lies in its friction cone."""
    speed = y[walker.speed]
    if speed != 0:
        return int(np.sign(speed))
    _, tangential, normal = walker.motion(0, y)
    return 0 if abs(tangential) <= walker.mu * normal else -int(np.sign(tangential))


def take_step(walker, y, method="DOP853", longest=5.0):
    """Return the step from a state just after an impact."""
    clock, phases, mode = 0.0, [], 0 if walker.stick_at_start else choose_mode(walker, y)
    while clock < longest and len(phases) < 10:
        duration, y, landed, run = _run_phase(walker, mode, y, method)
        phases.append((mode, clock + run[0], run[1]))
        clock += duration
        if landed:
            after, impulse, outcome = _impact(walker, y)
            sequence = " ".join(NAMES[phase[0]] for phase in phases)
            return Step(after, clock, f"{sequence} | {NAMES[outcome]}", impulse, phases)
        if mode:
            y[walker.speed] = 0.0
            mode = choose_mode(walker, y)
        else:
            mode = -int(np.sign(walker.motion(0, y)[1]))
    raise RuntimeError(f"no touchdown within {longest} s and 10 phases")


def _run_phase(walker, mode, y, method, chunk=0.1):
    """Integrate until touchdown or a change of mode; return duration, end, whether it is touchdown, and the samples."""

    def rate(t, y):
        return walker.motion(mode, y)[0]

    def touchdown(t, y):
        return walker.guard(y)

    def change(t, y):
        if mode:
            return mode * y[walker.speed]
        _, tangential, normal = walker.motion(0, y)
        return walker.mu * normal - abs(tangential)

    events = (touchdown, change) if np.isfinite(walker.mu) else (touchdown,)
    for event in events:
        event.direction = -1
    clock, times, states = 0.0, [], []
    while clock < 10:
        part = solve_ivp(rate, (0, chunk), y, method, events=events, **TOLERANCE)
        found = [
            (time, event)
            for event, at, where in zip(events, part.t_events, part.y_events, strict=True)
            for time, state in zip(at, where, strict=True)
            if event is change or walker.armed(state)
        ]
        times.append(clock + part.t)
        states.append(part.y)
        if found:
            time, event = min(found, key=lambda pair: pair[0])
            end, shift = _land_on(rate, event, y, time, method)
            times[-1] = np.append(times[-1][part.t < time], clock + time)
            states[-1] = np.column_stack([part.y[:, part.t < time], end])
            return clock + time + shift, end, event is touchdown, (np.concatenate(times), np.hstack(states))
        clock, y = clock + chunk, part.y[:, -1]
    raise RuntimeError(f"a phase '{NAMES[mode]}' does not end")


def _land_on(rate, event, y, time, method):
    """Integrate to an event located by interpolation, then correct its time by Newton's method."""
    end = solve_ivp(rate, (0, time), y, method, **TOLERANCE).y[:, -1] if time > 0 else y.copy()
    flow = rate(0, end)
    slope = (event(0, end + 1e-6 * flow) - event(0, end - 1e-6 * flow)) / 2e-6
    shift = -event(0, end) / slope
    return end + shift * flow, shift


def _impact(walker, y):
    """Return state after the impact, impulse and outcome: stick where the impulse lies in the cone, otherwise slip."""
    after, impulse = walker.impact(y, 0)
    if abs(impulse[0]) <= walker.impact_mu * impulse[1]:
        after[walker.speed] = 0.0
        return after, impulse, 0
    sign = -int(np.sign(impulse[0]))
    after, impulse = walker.impact(y, sign)
    assert sign * after[walker.speed] > 0, "the impact neither sticks nor slips"
    return after, impulse, sign


def derivative(image, z, step=5e-5):
    """Return the derivative of a map by central differences of sixth order."""
    columns = []
    for unit in np.eye(len(z)):
        one, two, three = (image(z + k * step * unit) - image(z - k * step * unit) for k in (1, 2, 3))
        columns.append((45 * one - 9 * two + three) / (60 * step))
    return np.array(columns).T


def fixed_point(image, z, tolerance=1e-11):
    """Return a fixed point of a map by Newton's method, and the derivative there."""
    for _ in range(20):
        matrix = derivative(image, z)
        change = np.linalg.solve(np.eye(len(z)) - matrix, image(z) - z)
        z = z + change
        if np.max(np.abs(change)) < 1e-4:
            break
    for _ in range(10):  # a derivative from this near gains four digits at each repetition
        change = np.linalg.solve(np.eye(len(z)) - matrix, image(z) - z)
        z = z + change
        if np.max(np.abs(change)) < tolerance:
            return z, derivative(image, z)
    raise RuntimeError(f"no fixed point: the last correction is {change}")


def force_ratio(walker, step):
    """Return (largest |f_t| / f_n, its time, least f_n) over the samples of a step."""
    rows = []
    for mode, times, states in step.phases:
        for time, y in zip(times, states.T, strict=True):
            _, tangential, normal = walker.motion(mode, y)
            rows.append((abs(tangential) / normal, time, normal))
    ratio, time, _ = max(rows)
    return ratio, time, min(row[2] for row in rows)
