"""A second replay of gaits in single support: mass matrix, SciPy's integrator, separate contact equations.

Only the symbolic equations of the robot are shared with the simulator: mass matrix, bias and actuation, the landing
foot with its Jacobian, the touchdown guard and the leg exchange.  Contact forces, contact modes, event location and the
impact are computed here.
"""

from functools import partial
from typing import Any

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.errors import GaitoptError
from gaitopt.model.contacts.contact_model import ContactModel
from gaitopt.model.coordinate_entries import ANGLES, GAP, SLIDE
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array
from gaitopt.study.audit.dense_call import DenseCall
from gaitopt.study.audit.piecewise_integration import Crossing, SmoothPiece, TorqueTable, integrate_piece

NAMES = {0: "stick", 1: "slip+", -1: "slip-"}
"""Spelling of the contact modes by the sign of the slip velocity."""

AT_REST = 1e-12
"""Slip speed below which a foot is at rest [m/s]."""

MOST_PHASES = 12
"""Largest number of phases of a replay."""

LATE = 1.5
"""Time at which a replay without touchdown ends, over the period of the plan."""

INSTANT = 1e-9
"""Time after an event that determines the interval of the torques [s]."""

START = 1e-6
"""Time after the start of a step during which the feet do not touch down [s]."""


@dataclass(frozen=True, eq=False)
class SecondReplay:
    """Result of a second replay.

    Attributes
    ----------
    sequence : str
        Contact sequence, or the part of it until the replay stopped.
    reason : str
        Reason why the replay stopped before its end; empty if it reached it.
    state_error : float
        Largest difference of the last state from the planned one (SI units); inf if the replay stopped.
    period_error : float [s]
    """

    sequence: str
    reason: str
    state_error: float
    period_error: float


def replay_again(gait: Gait) -> SecondReplay:
    """Replay the torques of a gait in single support from its first state.

    Parameters
    ----------
    gait : Gait

    Returns
    -------
    SecondReplay

    Raises
    ------
    GaitoptError
        If the robot has a custom impact law or transition, or the integrator does not reach the end.

    Examples
    --------
    >>> from gaitopt import load
    >>> second = replay_again(load("docs/examples/compass_slip.h5"))
    >>> second.sequence, second.state_error < 1e-6
    ('slip+ stick | slip+', True)
    """
    if gait.robot.contact_model != ContactModel():
        raise GaitoptError(f"The second replay supports no custom contact law, which robot {gait.robot_name!r} has.")
    return _Step(gait).run()


class _Step:
    """One step of a walker under the planned torques; the state is (q, v), the stance foot first."""

    def __init__(self, gait: Gait) -> None:
        self.gait, robot, motion = gait, gait.robot, gait.motion
        self.n, p = robot.n_q, robot.vector(motion.parameters)
        self._p = p
        self._slip, self._speeds = robot.n_q + SLIDE, [robot.n_q + SLIDE, robot.n_q + GAP]
        self._dynamics = DenseCall(robot.dynamics, p)
        self.sliding = motion.parameters["friction"]
        self.static = self.sliding * motion.parameters.get("static_friction_ratio", 1.0)
        self._begin = float(motion.segments[0].time[0])
        time = np.concatenate([segment.time for segment in motion.segments]) - self._begin
        self._torques = TorqueTable(time, np.concatenate([segment.torque for segment in motion.segments], axis=1))

    def run(self) -> SecondReplay:
        """Return the result of the replay."""
        first = self.gait.motion.segments[0]
        state = np.concatenate([first.q[:, 0], first.v[:, 0]])
        slide, now, phases = self._start_mode(state), 0.0, list[str]()
        while len(phases) < MOST_PHASES:
            phases.append(NAMES[slide])
            end = self._flow(slide, now, state)
            now, state = end.time, end.state
            if end.key == "touchdown":
                return self._land(phases, end)
            if end.key is None or end.key == "lift-off":
                reason = "no touchdown" if end.key is None else "the stance foot lifts off"
                return SecondReplay(" ".join(phases), f"{reason} at {now:.6g} s", np.inf, np.inf)
            slide = self._next_mode(end)
            if not slide:
                state[self._speeds] = 0.0
        return SecondReplay(" ".join(phases), f"more than {MOST_PHASES} phases", np.inf, np.inf)

    def _start_mode(self, state: Array) -> int:
        speed = state[self._slip]
        return int(np.sign(speed)) if abs(speed) > AT_REST else self._mode_at_rest(0.0, state)

    def _mode_at_rest(self, now: float, state: Array) -> int:
        """Return 0 if the force of a sticking foot lies in the cone, otherwise the direction of the slip."""
        tangential, normal = self._force(0, now, state, now + INSTANT)[1]
        return 0 if abs(tangential) <= self.static * normal else -int(np.sign(tangential))

    def _next_mode(self, end: Crossing) -> int:
        if end.key in ("forward", "backward"):
            return 1 if end.key == "forward" else -1
        end.state[self._slip] = 0.0
        return self._mode_at_rest(end.time, end.state)

    def _flow(self, slide: int, now: float, state: Array) -> Crossing:
        """Return the event that ends a phase."""
        piece = SmoothPiece(
            lambda t, y, middle: np.concatenate([y[self.n :], self._force(slide, t, y, middle)[0]]),
            self._guards(slide),
            self._accepts,
            ("lift-off",) if slide else ("forward", "backward", "lift-off"),
            {"touchdown": lambda t, y, middle: self._touchdown(y)[1]},
        )
        last = LATE * float(self._torques.time[-1])
        return integrate_piece(piece, state, np.array([now, *self._torques.corners(now, last), last]))

    def _accepts(self, name: str, time: float, state: Array) -> bool:
        if name != "touchdown":
            return True
        return time > START and float(self._touchdown(state)[2]) > 0

    def _touchdown(self, state: Array) -> tuple[float, ...]:
        parts = self.gait.robot.touchdown(state[: self.n], state[self.n :], self._p)
        return tuple(float(part) for part in parts)

    def _guards(self, slide: int) -> dict[str, Any]:
        """Return the guards of a contact mode by name."""

        def cone(sign: int, t: float, y: Array, middle: float) -> float:
            tangential, normal = self._force(slide, t, y, middle)[1]
            return float(self.static * normal + sign * tangential)

        guards: dict[str, Any] = {
            "touchdown": lambda t, y, middle: self._touchdown(y)[0],
            "lift-off": lambda t, y, middle: self._force(slide, t, y, middle)[1][1],
        }
        if slide:
            return guards | {"at rest": lambda t, y, middle: slide * y[self._slip]}
        return guards | {"forward": partial(cone, 1), "backward": partial(cone, -1)}

    def _force(self, slide: int, t: float, state: Array, middle: float) -> tuple[Array, Array]:
        """Return the acceleration (n_q,) and the contact force (f_t, f_n) in a mode.

        The unknowns of the linear system are the acceleration and the force; M a - (f_t, f_n, 0, ...) = E u - h.
        """
        mass, bias, actuation = self._dynamics(state[: self.n], state[self.n :])
        n = self.n
        system, right = np.zeros((n + 2, n + 2)), np.zeros(n + 2)
        system[:n, :n], system[SLIDE, n], system[GAP, n + 1] = mass, -1.0, -1.0
        right[:n] = actuation @ self._torques.evaluate(t, middle) - bias
        system[n + 1, GAP] = 1.0  # the foot stays on the ground
        if slide:
            system[n, n], system[n, n + 1] = 1.0, slide * self.sliding
        else:
            system[n, SLIDE] = 1.0
        solution = np.linalg.solve(system, right)
        return np.asarray(solution[:n]), np.asarray(solution[n:])

    def _land(self, phases: list[str], end: Crossing) -> SecondReplay:
        """Return the result at a touchdown: the impact of the landing foot and the leg exchange."""
        slide, v_plus = self._collide(end.state)
        sequence = f"{' '.join(phases)} | {'none' if slide is None else NAMES[slide]}"
        if v_plus is None:
            return SecondReplay(sequence, "the impact has no outcome", np.inf, np.inf)
        if v_plus[GAP] < 0:
            return SecondReplay(sequence, "the trailing foot does not separate", np.inf, np.inf)
        planned = self.gait.motion.jumps[0]
        q, v = (np.asarray(part).ravel() for part in self.gait.robot.swap(end.state[: self.n], v_plus, self._p))
        errors = np.concatenate([q[ANGLES] - planned.q_next[ANGLES], v - planned.v_next])
        late = abs(end.time - (planned.time - self._begin))
        return SecondReplay(sequence, "", float(np.max(np.abs(errors))), float(late))

    def _collide(self, state: Array) -> tuple[int | None, Array | None]:
        """Return the slip direction of the landing foot after its impact, and the rates."""
        q, v = state[: self.n], state[self.n :]
        mass = self._dynamics(q, v)[0]
        jacobian = np.asarray(self.gait.robot.landing(q, v, self._p)[2])
        mobility, before = jacobian @ np.linalg.solve(mass, jacobian.T), jacobian @ v
        for slide in (0, 1, -1):
            ratio = -slide * self.sliding  # of the impulses, tangential over normal
            system = mobility if not slide else np.array([mobility[1], [1.0, -ratio]])
            impulse = np.linalg.solve(system, -before if not slide else np.array([-before[1], 0.0]))
            after = before + mobility @ impulse
            consistent = abs(impulse[0]) <= self.sliding * impulse[1] if not slide else slide * after[0] > 0
            if impulse[1] >= 0 and consistent:
                return slide, v + np.linalg.solve(mass, jacobian.T @ impulse)
        return None, None
