"""Record of a branch of optimal gaits while it is followed."""

import math
from typing import Any

import numpy as np

from gaitopt.continuation.optimal.cost_extremum import has_flat_cost, locate_cost_extremum
from gaitopt.continuation.optimal.kkt_point import KktLinearisation
from gaitopt.continuation.optimal.optimal_branch import OptimalBranch, OptimalSpecialPoint
from gaitopt.continuation.optimal.optimum_replay import OptimumReplay, Replayer
from gaitopt.continuation.optimal.parametric_nlp import ParametricNlp
from gaitopt.continuation.optimal.path_items import PathChange, PathKind, PathPoint
from gaitopt.ocp.solution.node_placement import read_ramps
from gaitopt.simulation.engine import Engine

COLUMNS = ("values", "costs", "cost_slopes", "cost_errors", "negative", "dependent", "strictness", "active")
"""Arrays of a branch with one number per gait."""

SIDES = {True: "active", False: "inactive"}


class BranchRecorder:
    """Points and special points of one side of a branch.

    Parameters
    ----------
    nlp : ParametricNlp
    every : int
        Number of points from one replayed gait to the next; 0 for no replay.
    engine : Engine or None
        Engine of the replays.
    cost_factor : float
        Estimated error of the objective per variation of the torques on this grid; nan if it is unknown.

    Attributes
    ----------
    points : list of KktLinearisation
    special : list of OptimalSpecialPoint
    """

    def __init__(self, nlp: ParametricNlp, every: int, engine: Engine | None, cost_factor: float) -> None:
        self.nlp, self.every, self.cost_factor = nlp, every, cost_factor
        self._replayer = Replayer(nlp, engine)
        self.points, self.special = list[KktLinearisation](), list[OptimalSpecialPoint]()
        self._rows, self._replays = list[dict[str, float]](), list[OptimumReplay | None]()
        self._states = list[np.ndarray]()
        self._last: KktLinearisation | None = None
        self._dependent: int | None = None

    def add_point(self, point: PathPoint) -> None:
        """Add a point, and the extremum of the cost before it if there is one."""
        optimum = point.optimum
        self._add_extremum(optimum)
        if self._dependent is None:
            self._dependent = optimum.dependent
        replay = self.every and len(self.points) % self.every == 0
        self._replays.append(self._replayer.replay(optimum) if replay else None)
        self._states.append(self._replayer.project(optimum))
        self._rows.append(
            {
                "values": optimum.point.value,
                "costs": optimum.cost,
                "cost_slopes": optimum.cost_slope,
                "cost_errors": self._cost_error(optimum),
                "negative": optimum.negative,
                "dependent": self._dependent,
                "strictness": optimum.strictness,
                "active": optimum.active.inequalities.size,
            }
        )
        self.points.append(optimum)

    def add_change(self, change: PathChange) -> None:
        """Add a special point."""
        optimum = change.optimum
        if change.kind is not PathKind.TURNING_POINT:
            self._add_extremum(optimum)
            leaves = change.kind is PathKind.DEACTIVATION
            self._dependent = 0 if leaves and self._dependent == 0 else None  # a subset is as independent
            sides, name = (SIDES[leaves], SIDES[not leaves]), self.nlp.name_constraint(change.index)
        else:
            sides, name = (str(self.nlp.problem.sequence),) * 2, ""
        self._add_special(change.kind.key, optimum, change.width, sides, name, turns=change.turns)
        self._last = None if change.turns else self._last

    def _add_extremum(self, optimum: KktLinearisation) -> None:
        if has_flat_cost(optimum):
            return
        extremum = None if self._last is None else locate_cost_extremum(self._last, optimum)
        if extremum is not None:
            sequence = str(self.nlp.problem.sequence)
            width = float(np.spacing(abs(extremum.point.value)))
            self._add_special("cost_extremum", extremum, width, (sequence, sequence), "")
        self._last = optimum

    def _add_special(
        self,
        kind: str,
        optimum: KktLinearisation,
        width: float,
        sides: tuple[str, str],
        name: str,
        *,
        turns: bool = False,
    ) -> None:
        self.special.append(
            OptimalSpecialPoint(
                kind=kind,
                value=optimum.point.value,
                width=width,
                cost=optimum.cost,
                constraint=name,
                before=sides[0],
                after=sides[1],
                state=self._replayer.project(optimum),
                turns=turns,
                place=len(self.points),
            )
        )

    def _cost_error(self, optimum: KktLinearisation) -> float:
        """Return the estimated relative error of the cost on this grid."""
        if math.isnan(self.cost_factor):
            return math.nan
        ramps = read_ramps(self.nlp.transcription, optimum.point.x)
        typical = 1e-6 * self.nlp.problem.objective.typical
        return math.nan if ramps is None else self.cost_factor * ramps.variation / max(abs(optimum.cost), typical)

    def finish(self, end: str, parent: int | None = None) -> OptimalBranch:
        """Return the branch recorded so far."""
        columns: dict[str, Any] = {name: np.array([row[name] for row in self._rows]) for name in COLUMNS}
        names = self._replayer.names
        size = len(names)
        multipliers = np.full((len(self._rows), size), np.nan, dtype=complex)
        for row, replay in zip(multipliers, self._replays, strict=True):
            if replay is not None:
                row[: replay.multipliers.size] = replay.multipliers[:size]
        return OptimalBranch(
            sequence=str(self.nlp.problem.sequence),
            names=names,
            **columns,
            states=np.array(self._states).reshape(-1, size),
            multipliers=multipliers,
            replayed=np.array([replay is not None for replay in self._replays], dtype=bool),
            passed=np.array([replay is not None and replay.passed for replay in self._replays], dtype=bool),
            state_errors=np.array([math.nan if replay is None else replay.state_error for replay in self._replays]),
            special=tuple(self.special),
            end=end,
            parent=parent,
        )
