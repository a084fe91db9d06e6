"""Builder of the NLP: data shared by its blocks, and the local variables of a block."""

from collections.abc import Sequence
from dataclasses import field, replace
from typing import Protocol

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.locks import cached_property
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.block import Block, stack
from gaitopt.ocp.nlp.keys import STEP, Group, Kind, Row, TableKey, Unknown, equation, table_name
from gaitopt.ocp.nlp.layout import Index, Layout, Rows
from gaitopt.ocp.statement.objective import Objective, overrides
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.relaxation import Pair, Relaxation, relax
from gaitopt.ocp.transcription.scheme import Scheme
from gaitopt.ocp.transcription.sign_changes import SignChangeLayout
from gaitopt.ocp.transcription.swing_terrain import SwingTerrain

MARGINS = ("cone", "impact_cone")
"""Margins that enter the constraints as data, after the robot's parameters."""


@dataclass(frozen=True, eq=False, kw_only=True)
class NlpBuilder:
    """An NLP under construction.

    Attributes
    ----------
    robot : Robot
    objective : Objective
    scheme : Scheme
    powered : tuple of int
        Numbers of the actuators that are not idle.
    rate_limited : bool
        Whether torque rates are constrained.
    variables : Layout
        The decision vector.
    rows : Rows
        The constraint rows, to which every block appends.
    data : SX
        Robot parameters, margins, the clearance if it is constrained, and the relaxation parameter if there is one.
    cleared : bool
        Whether the clearance of the swing foot is constrained.
    inertia_limited : bool
        Whether the sliding inertia is constrained, so that slip stays well posed.
    relaxation : Relaxation or None
        Relaxation of the complementarity pairs of an open contact sequence.
    resting : set of int
        Unknown foot speeds that a transition requires to be zero; they are bounded instead of constrained.
    sign_changes : SignChangeLayout or None
        Places of the data on sign changes of the joint powers, if there are any.
    placed : bool
        Whether the fractions of the phases at which their nodes are placed are data, the first after the shared ones.
    terrain : SwingTerrain or None
        The terrain below the swing foot, if the height of the foot over it is constrained.
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
    inertia_limited: bool = False
    relaxation: Relaxation | None = None
    resting: set[int] = field(default_factory=set)
    sign_changes: SignChangeLayout | None = None
    placed: bool = False
    terrain: SwingTerrain | None = None

    @cached_property
    def terms(self) -> tuple[tuple[float, Objective], ...]:
        """Weights and parts of the objective."""
        return self.objective.terms()

    @cached_property
    def peaks(self) -> tuple[tuple[int, Objective], ...]:
        """Numbers and parts of the objective that have a peak over the step."""
        return tuple((i, term) for i, (_, term) in enumerate(self.terms) if overrides(term, "peak"))

    def names(self) -> list[str]:
        """Return the names of the robot's parameters."""
        return [parameter.name for parameter in self.robot.parameters]

    def relax(self, local: "BlockVariables", table: TableKey, pairs: list[Pair]) -> tuple[list[Row], ca.SX, ca.SX]:
        """Return rows, values and penalty of relaxed complementarity pairs.

        Parameters
        ----------
        local : BlockVariables
            Local variables of the block; the slacks of the relaxation are added to them.
        table : TableKey
            Table of the slacks, pair by pair.
        pairs : list of Pair
        """
        if self.relaxation is None:
            raise ValueError("complementarity pairs need a relaxation")
        count = len(self.relaxation.slacks)
        if count:
            slacks = local.add("slacks", self.variables[table])
            pairs = [replace(pair, slacks=slacks[i * count : (i + 1) * count]) for i, pair in enumerate(pairs)]
        return relax(self.relaxation, pairs, self.data[-1], self.objective.typical)

    def clearance(self) -> ca.SX:
        """Return the clearance of the swing foot [m]."""
        return self.data[len(self.robot.parameters) + len(MARGINS)]

    def integral_row(self) -> int:
        """Return the row that sums the integral of the objective."""
        if Group.INTEGRAL not in self.rows.layout:
            self.rows.add(Group.INTEGRAL, [equation(Kind.INTEGRAL)], [STEP])
        return int(self.rows.layout[Group.INTEGRAL][0, 0])

    def state_columns(self, phase: Phase, nodes: Sequence[int]) -> Index:
        """Return the indices of the reduced states of a phase at some nodes, shape (n_x, len(nodes))."""
        places = list(nodes)
        parts = [self.variables[Unknown.ANGLES][:, places], self.variables[Unknown.RATES][:, places]]
        return np.vstack([*parts, self.slide_columns(phase, nodes)])

    def slide_columns(self, phase: Phase, nodes: Sequence[int]) -> Index:
        """Return the indices of slide and speed of the foot, shape (2, len(nodes)); empty if it does not slide."""
        return slide_columns(self.variables, phase, nodes)

    def torque_columns(self, phase: Phase, nodes: Sequence[int]) -> Index:
        """Return the indices of the torques at some nodes, or if they belong to intervals, in those after the nodes."""
        last = self.variables[Unknown.TORQUE].shape[1] - 1
        return self.variables[Unknown.TORQUE][:, np.minimum(list(nodes), last)]

    def node_columns(self, phase: Phase, nodes: Sequence[int]) -> Index:
        """Return the indices of the further unknowns of the scheme at some nodes, shape (n_unknowns, len(nodes))."""
        if (Unknown.ACCELERATION, phase.number) not in self.variables:
            return np.empty((0, len(nodes)), dtype=np.intp)
        return self.variables[Unknown.ACCELERATION, phase.number][:, [k - phase.first for k in nodes]]

    def slides(self, local: "BlockVariables") -> list[ca.SX]:
        """Return the distances by which the foot slides in the phases, forward positive [m]."""
        tables = [table for key, table in self.variables.tables.items() if is_slide(key)]
        return [local.add("slide", table[:1, [-1]]) for table in tables]


def slide_columns(variables: Layout, phase: Phase, nodes: Sequence[int]) -> Index:
    """Return the indices of slide and speed of the foot, shape (2, len(nodes)); empty if it does not slide."""
    if Unknown.SLIDE in variables:  # one table for the whole step
        return variables[Unknown.SLIDE][:, list(nodes)]
    if (Unknown.SLIDE, phase.number) in variables:
        return variables[Unknown.SLIDE, phase.number][:, [k - phase.first for k in nodes]]
    return np.empty((0, len(nodes)), dtype=np.intp)


def is_slide(key: TableKey) -> bool:
    """Return whether a table contains slides of the foot."""
    return key is Unknown.SLIDE or (isinstance(key, tuple) and key[0] is Unknown.SLIDE)


class BlockTables(Protocol):
    """Tables and data of an NLP under construction, from which a block takes its local variables."""

    @property
    def variables(self) -> Layout:
        """The decision vector."""

    @property
    def data(self) -> ca.SX:
        """Data, which begin with the parameters of the robot."""

    @property
    def placed(self) -> bool:
        """Whether the fractions of the phases at which their nodes are placed are data."""

    def names(self) -> list[str]:
        """Return the names of the robot's parameters."""


class BlockVariables:
    """The local variables of a block under construction: symbols and the indices of their instances.

    Parameters
    ----------
    builder : NlpBuilder or another object with the same tables and data
    count : int
        Number of instances of the block.
    """

    def __init__(self, builder: BlockTables, count: int) -> None:
        self.builder, self.count = builder, count
        self._symbols: list[ca.SX] = []
        self._columns: list[Index] = []
        self._constants: list[ca.SX] = []
        self._values: list[Array] = []
        self._numbers: list[ca.SX] = []
        self._places: list[Index] = []
        self._shared: dict[TableKey, ca.SX] = {}
        self._intermediates: list[ca.SX] = []
        self._definitions: list[ca.SX] = []
        self._intervals: dict[tuple[int, ...], tuple[ca.SX, ca.SX]] = {}

    def add(self, name: str, columns: Index) -> ca.SX:
        """Return a symbol for each row of `columns`, shape (n,); a single column is common to all instances."""
        symbol = ca.SX.sym(name, columns.shape[0])
        self._symbols.append(symbol)
        self._columns.append(columns if columns.shape[1] == self.count else np.repeat(columns, self.count, axis=1))
        return symbol

    def add_constant(self, name: str, values: Array) -> ca.SX:
        """Return a symbol for a number that differs between the instances, with values of shape (count,)."""
        self._constants.append(ca.SX.sym(name))
        self._values.append(values)
        return self._constants[-1]

    def add_data(self, name: str, places: Index) -> ca.SX:
        """Return a symbol for data that differ between the instances, with indices in the data of shape (n, count)."""
        self._numbers.append(ca.SX.sym(name, places.shape[0]))
        self._places.append(places)
        return self._numbers[-1]

    def add_shared(self, key: TableKey) -> ca.SX:
        """Return a symbol for a whole table, common to all instances; added once, at its first use."""
        if key not in self._shared:
            self._shared[key] = self.add(table_name(key), self.builder.variables[key].reshape(-1, 1, order="F"))
        return self._shared[key]

    def define(self, symbols: ca.SX, expression: ca.SX) -> None:
        """Let symbols stand for an expression of the local variables."""
        self._intermediates.append(symbols)
        self._definitions.append(expression)

    def add_intervals(self, phase: Phase, nodes: Sequence[int]) -> tuple[ca.SX, ca.SX]:
        """Return start and share of the intervals after some nodes, counted from the start of a phase, as fractions."""
        key = tuple(nodes)
        if key not in self._intervals:
            if self.builder.placed:
                first = self.builder.data.numel() + phase.first + phase.number  # a phase of N intervals has N + 1 data
                ends = np.array([key, np.minimum(np.array(key) + 1, phase.count)])
                start, end = ca.vertsplit(self.add_data("fractions", first + ends))
                self._intervals[key] = start, end - start
            else:
                # Constants of an instance, so that the equations are those of any grid.
                start = self.add_constant("start", np.array(key) / phase.count)
                self._intervals[key] = start, self.add_constant("share", np.full(len(key), 1 / phase.count))
        return self._intervals[key]

    def add_length(self, phase: Phase, duration: ca.SX, nodes: Sequence[int]) -> ca.SX:
        """Return the lengths of the intervals after some nodes of a phase [s]."""
        return duration * self.add_intervals(phase, nodes)[1]

    def parameters(self) -> ca.SX:
        """Return the parameters of the robot; free ones are local variables."""
        names, variables = self.builder.names(), self.builder.variables
        p = self.builder.data[: len(names)]
        if Unknown.SLOPE in variables:
            p[names.index("slope")] = self.add("slope", variables[Unknown.SLOPE])
        if Unknown.DESIGN in variables:
            p[[names.index(key.of) for key in variables.rows[Unknown.DESIGN]]] = self.add_shared(Unknown.DESIGN)
        return p

    def block(
        self,
        name: str,
        constraints: ca.SX,
        rows: Index,
        cost: ca.SX | None = None,
        penalty: ca.SX | None = None,
        *,
        merged: bool = False,
    ) -> Block:
        """Return the finished block.

        Parameters
        ----------
        name : str
        constraints : SX, shape (m, 1)
        rows : (m, count) int array
            Indices of the constraints.
        cost, penalty : SX, optional
        merged : bool
            Whether there are few common subexpressions.
        """
        return Block(
            name=name,
            variables=stack(self._symbols),
            cost=_unless_zero(cost),
            penalty=_unless_zero(penalty),
            constraints=constraints,
            columns=np.vstack(self._columns),
            rows=rows,
            symbols=stack(self._constants),
            constants=np.array(self._values).reshape(-1, self.count),
            numbers=stack(self._numbers),
            places=np.vstack(self._places) if self._places else np.empty((0, self.count), dtype=np.intp),
            intermediates=stack(self._intermediates),
            definitions=stack(self._definitions),
            merged=merged,
        )


def _unless_zero(cost: ca.SX | None) -> ca.SX | None:
    return None if cost is None or cost.is_zero() else cost
