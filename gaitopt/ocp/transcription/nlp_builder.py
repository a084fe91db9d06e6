"""What the blocks of one programme share."""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from gaitopt.model.robot import Robot
from gaitopt.ocp.nlp.layout import Index, Layout, Rows
from gaitopt.ocp.statement.objective import Objective
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.phase_dynamics import Row
from gaitopt.ocp.transcription.relaxation import Pair, Relaxation, relax
from gaitopt.ocp.transcription.scheme import Scheme

MARGINS = ("cone", "impact_cone")
"""Margins that enter the constraints as data, after the robot's parameters."""


@dataclass(frozen=True, eq=False, kw_only=True)
class NlpBuilder:
    """The programme under construction.

    Attributes
    ----------
    robot : Robot
    objective : Objective
    scheme : Scheme
    powered : tuple of int
        Actuators that may work.
    rate_limited : bool
        Whether torque rates are constrained.
    variables : Layout
        The decision vector.
    rows : Rows
        The constraint rows so far; every block appends its own.
    data : SX
        Robot parameters, then the margins, the clearance where one is asked for, and the relaxation's parameter where
        there is one.
    cleared : bool
        Whether the swing foot keeps a clearance.
    relaxation : Relaxation or None
        Of the complementarity pairs of an open contact sequence.
    """

    robot: Robot
    objective: Objective
    scheme: Scheme
    powered: tuple[int, ...]
    rate_limited: bool
    variables: Layout
    rows: Rows
    data: ca.SX
    cleared: bool = False
    relaxation: Relaxation | None = None

    def names(self) -> list[str]:
        """Return the names of the robot's parameters."""
        return [parameter.name for parameter in self.robot.parameters]

    def relax(self, pairs: list[Pair]) -> tuple[list[Row], ca.SX, ca.SX]:
        """Return rows, values and cost that stand for complementarity pairs."""
        if self.relaxation is None:
            raise ValueError("complementarity pairs need a relaxation")
        return relax(self.relaxation, pairs, self.data[-1], self.objective.typical)

    def clearance(self) -> ca.SX:
        """Return the clearance of the swing foot [m]."""
        return self.data[len(self.robot.parameters) + len(MARGINS)]

    def integral_row(self) -> int:
        """Return the row that sums the integral of the objective."""
        if "integral" not in self.rows.layout:
            self.rows.add("integral", [("integral of the objective", 0.0, 0.0)], ["step"])
        return int(self.rows.layout["integral"][0, 0])

    def state_columns(self, phase: Phase, nodes: Sequence[int]) -> Index:
        """Return where a phase's reduced states at some nodes are, shape (n_x, len(nodes))."""
        nodes, variables = list(nodes), self.variables
        parts = [variables["angles"][:, nodes], variables["rates"][:, nodes]]
        if phase.mode.slips:
            parts.append(variables[f"slide {phase.number}"][:, [k - phase.first for k in nodes]])
        return np.vstack(parts)

    def node_columns(self, phase: Phase, nodes: Sequence[int]) -> Index:
        """Return where the scheme's own unknowns at some nodes are, shape (n_unknowns, len(nodes))."""
        name = f"acceleration {phase.number}"
        if name not in self.variables:
            return np.empty((0, len(nodes)), dtype=np.intp)
        return self.variables[name][:, [k - phase.first for k in nodes]]


class BlockVariables:
    """The local variables of a block under construction: symbols, and where their instances live.

    Parameters
    ----------
    frame : Frame
    count : int
        Number of instances of the block.
    """

    def __init__(self, frame: NlpBuilder, count: int) -> None:
        self.frame, self.count = frame, count
        self._symbols: list[ca.SX] = []
        self._columns: list[Index] = []

    def add(self, name: str, columns: Index) -> ca.SX:
        """Return a symbol for each row of `columns`, shape (n,); a single column serves all instances."""
        symbol = ca.SX.sym(name, columns.shape[0])
        self._symbols.append(symbol)
        self._columns.append(np.broadcast_to(columns, (columns.shape[0], self.count)))
        return symbol

    def parameters(self) -> ca.SX:
        """Return the robot's parameters, among them the slope as a local variable where it is free."""
        p = self.frame.data[: len(self.frame.robot.parameters)]
        if "slope" in self.frame.variables:
            p[self.frame.names().index("slope")] = self.add("slope", self.frame.variables["slope"])
        return p

    @property
    def variables(self) -> ca.SX:
        """All symbols so far, one below the other."""
        return ca.vertcat(*self._symbols)

    @property
    def columns(self) -> Index:
        """Where they live, shape (n, count)."""
        return np.vstack(self._columns)
