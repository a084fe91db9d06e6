"""Transcription: from the structure of a gait problem to an NLP.

Unknowns per node: angles, rates, torques (continuous and linear between nodes); per slip phase also the foot's slide
and slide rate; one duration per phase; the impulse at touchdown; the travel of the step; further unknowns of the
scheme.  The last node of a phase is the first node of the next.  If phases are open, the scheme is time stepping:
torques and contact forces belong to intervals, and one table contains the slide of the foot over the whole step.
"""

import functools
from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.locks import cached_property
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.model.robot import Robot
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.block import Block
from gaitopt.ocp.nlp.keys import DESIGN, GROUND, STEP, TOUCHDOWN, Key, Kind, Place, TableKey, Unknown
from gaitopt.ocp.nlp.layout import Layout, Rows
from gaitopt.ocp.nlp.nlp import Nlp, assemble_nlp
from gaitopt.ocp.statement.objective import Objective, is_curved, overrides
from gaitopt.ocp.transcription.deviation_constraints import deviation_blocks
from gaitopt.ocp.transcription.deviations import lay_out_deviations, lay_out_gains, section_names
from gaitopt.ocp.transcription.grid import Phase, divide_into_phases, node_places, place_nodes
from gaitopt.ocp.transcription.guard_constraints import GuardSchedule, guard_blocks
from gaitopt.ocp.transcription.impact_complementarity import UNKNOWNS
from gaitopt.ocp.transcription.impact_constraints import FollowingStep, touchdown_block
from gaitopt.ocp.transcription.nlp_builder import MARGINS, NlpBuilder
from gaitopt.ocp.transcription.objective_blocks import quotient_block
from gaitopt.ocp.transcription.phase_complementarity import FRICTION_PAIRS
from gaitopt.ocp.transcription.phase_constraints import last_power_block, phase_blocks
from gaitopt.ocp.transcription.radius_condition import radius_block
from gaitopt.ocp.transcription.relaxation import Relaxation, Slack
from gaitopt.ocp.transcription.scheme import Scheme
from gaitopt.ocp.transcription.sign_changes import SignChangeLayout, lay_out_sign_changes, locate_sign_changes

SLIDE = (Key(Kind.FOOT_SLIDE), Key(Kind.SPEED_OF_FOOT))
NODE_TABLES = (Unknown.ANGLES, Unknown.RATES, Unknown.TORQUE, Unknown.POWER)
"""Tables of unknowns with one column per node of the step."""


@dataclass(frozen=True, kw_only=True)
class Structure:
    """Choices that determine the equations of an NLP, without their numbers; equal structures share one NLP.

    Attributes
    ----------
    robot : Robot
    sequence : ContactSequence
    objective : Objective
    scheme : Scheme
    counts : tuple of int
        Intervals of each phase.
    powered : tuple of str
        Actuators that are not idle.
    free_slope : bool
        Whether the slope is an unknown.
    free : tuple of str
        The other parameters of robot and ground that are unknowns.
    rate_limited : bool
        Whether torque rates are constrained.
    cleared : bool
        Whether the clearance of the swing foot is constrained.
    inertia_limited : bool
        Whether the sliding inertia is constrained.
    placed : bool
        Whether the fractions of the phases at which their nodes are placed are data; otherwise intervals are equal.
    schedule : GuardSchedule or None
        Schedule of the touchdown guard during the step.
    relaxation : Relaxation or None
        Relaxation of the complementarity pairs of an open contact sequence.
    stabilised, fed_back : bool
        Whether the spectral radius of the return map is constrained, and whether feedback gains are unknowns.
    radius_weight : float
        Weight of the spectral radius in the objective.
    """

    robot: Robot
    sequence: ContactSequence
    objective: Objective
    scheme: Scheme
    counts: tuple[int, ...]
    powered: tuple[str, ...]
    free_slope: bool = False
    free: tuple[str, ...] = ()
    rate_limited: bool = False
    cleared: bool = False
    inertia_limited: bool = False
    placed: bool = False
    schedule: GuardSchedule | None = None
    relaxation: Relaxation | None = None
    stabilised: bool = False
    fed_back: bool = False
    radius_weight: float = 0.0

    def data(self) -> ca.SX:
        """Return symbols for the data of a solve; see :class:`gaitopt.ocp.transcription.nlp_builder.NlpBuilder`."""
        size = len(self.robot.parameters) + len(MARGINS) + self.cleared + (self.relaxation is not None)
        return ca.SX.sym("z", size)


@dataclass(frozen=True, eq=False, kw_only=True)
class Transcription:
    """A compiled gait problem for all parameter values.

    Attributes
    ----------
    structure : Structure
    phases : tuple of Phase
    dynamics_of_phases : tuple of PhaseDynamics
        Equations of motion of each phase.
    variables, constraints : Layout
        Layouts of the decision vector and of the constraint rows.
    row_bounds : (2, n_constraints) array
        Lower and upper bounds of the rows; the problem replaces some of them.
    resting : frozenset of int
        Unknown foot speeds that are zero because a transition ends the slip at rest.
    nlp : Nlp
    sign_changes : SignChangeLayout or None
        Places of the data on sign changes of the joint powers; None if the objective does not use them.
    """

    structure: Structure
    phases: tuple[Phase, ...]
    dynamics_of_phases: tuple[PhaseDynamics, ...]
    variables: Layout
    constraints: Layout
    row_bounds: np.ndarray
    resting: frozenset[int]
    nlp: Nlp
    sign_changes: SignChangeLayout | None = None

    def place_nodes(self, fractions: Sequence[Sequence[float]]) -> "Transcription":
        """Return the transcription, whose nodes are data, with its nodes at some fractions of each phase."""
        return replace(self, phases=place_nodes(self.phases, fractions))

    @property
    def node_fractions(self) -> Array:
        """The fractions of the phases at which their nodes are, as data of the NLP; empty if they are not data."""
        return np.concatenate([phase.fractions for phase in self.phases]) if self.structure.placed else np.empty(0)

    @property
    def slacks(self) -> tuple[Slack, ...]:
        """Unknowns that the relaxation adds to each complementarity pair."""
        return () if self.structure.relaxation is None else self.structure.relaxation.slacks

    def locate_sign_changes(self, x: Array | None = None, *, touching: bool = False) -> Array:
        """Return the data on sign changes of the joint powers in a decision vector; zeros without one.

        With `touching` they are exact at `x`, otherwise suitable for a solve from it; see
        :func:`gaitopt.ocp.transcription.sign_changes.locate_sign_changes`.
        """
        if self.sign_changes is None:
            return np.empty(0)
        if x is None:
            return np.zeros(self.sign_changes.size)
        return locate_sign_changes(self.sign_changes, self.variables, self.phases, x, touching=touching)

    @cached_property
    def n_nodes(self) -> int:
        """Number of nodes of the step."""
        return self.phases[-1].nodes[-1] + 1


@functools.lru_cache(maxsize=32)
def transcribe(structure: Structure) -> Transcription:
    """Transcribe a structure into an NLP; equal structures return the NLP built before."""
    robot, objective, nodal = structure.robot, structure.objective, structure.scheme.nodal
    phases = divide_into_phases(structure.sequence, structure.counts)
    dynamics_of_phases = tuple(_reduce_dynamics(robot, phase.mode if nodal else Mode.ANY) for phase in phases)
    variables, rows = _variables(structure, phases, dynamics_of_phases), Rows()
    data, powered, changes = structure.data(), tuple(robot.actuators.index(name) for name in structure.powered), None
    first = data.numel() + (sum(phase.count + 1 for phase in phases) if structure.placed else 0)
    if objective.uses_power and powered and nodal and structure.relaxation is None:
        changes = lay_out_sign_changes(phases, first, len(powered), structure.scheme.power_fractions.size)
    builder = _make_builder(structure, variables, rows, data, powered, changes)
    smooth = objective.smooth and structure.relaxation is None and not builder.peaks and is_curved(objective, robot)
    blocks = _blocks(builder, structure, phases, dynamics_of_phases)
    nlp = assemble_nlp(
        blocks,
        builder.data,
        variables.size,
        rows.layout.size,
        n_numbers=first - data.numel() + (0 if changes is None else changes.size),
        typical=objective.typical,
        smooth=smooth,
    )
    # Complementarity pairs, and multipliers as unknowns, make rows nearly dependent.
    independent = not (structure.sequence.is_open or structure.relaxation is not None or structure.stabilised)
    return Transcription(
        structure=structure,
        phases=phases,
        dynamics_of_phases=dynamics_of_phases,
        variables=variables,
        constraints=rows.layout,
        row_bounds=rows.bounds(),
        resting=frozenset(builder.resting),
        nlp=nlp.replace_fields(independent=independent),
        sign_changes=changes,
    )


def _make_builder(
    structure: Structure,
    variables: Layout,
    rows: Rows,
    data: ca.SX,
    powered: tuple[int, ...],
    changes: SignChangeLayout | None,
) -> NlpBuilder:
    """Return the builder of the NLP of a structure."""
    return NlpBuilder(
        robot=structure.robot,
        objective=structure.objective,
        scheme=structure.scheme,
        powered=powered,
        rate_limited=structure.rate_limited,
        variables=variables,
        rows=rows,
        data=data,
        cleared=structure.cleared,
        inertia_limited=structure.inertia_limited,
        relaxation=structure.relaxation,
        sign_changes=changes,
        placed=structure.placed,
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class StepParts:
    """The parts of the NLP of one step before its touchdown is stated, for NLPs of several steps.

    Attributes
    ----------
    structure : Structure
    builder : NlpBuilder
    phases : tuple of Phase
    dynamics_of_phases : tuple of PhaseDynamics
    """

    structure: Structure
    builder: NlpBuilder
    phases: tuple[Phase, ...]
    dynamics_of_phases: tuple[PhaseDynamics, ...]

    def blocks(self, following: FollowingStep | None = None) -> list[Block]:
        """Return the blocks of the step; its touchdown leads to its own first state or to that of the next step."""
        return _blocks(self.builder, self.structure, self.phases, self.dynamics_of_phases, following)

    def transcription(self, nlp: Nlp) -> Transcription:
        """Return the step as a transcription, with its layouts, as part of an NLP of several steps."""
        return Transcription(
            structure=self.structure,
            phases=self.phases,
            dynamics_of_phases=self.dynamics_of_phases,
            variables=self.builder.variables,
            constraints=self.builder.rows.layout,
            row_bounds=self.builder.rows.bounds(),
            resting=frozenset(self.builder.resting),
            nlp=nlp,
        )


def prepare_step(structure: Structure) -> StepParts:
    """Return the parts of the NLP of one step; the absolute work is bounded from above."""
    phases = divide_into_phases(structure.sequence, structure.counts)
    dynamics = tuple(_reduce_dynamics(structure.robot, phase.mode) for phase in phases)
    powered = tuple(structure.robot.actuators.index(name) for name in structure.powered)
    variables = _variables(structure, phases, dynamics)
    builder = _make_builder(structure, variables, Rows(), structure.data(), powered, None)
    return StepParts(structure=structure, builder=builder, phases=phases, dynamics_of_phases=dynamics)


@functools.lru_cache(maxsize=32)
def _reduce_dynamics(robot: Robot, mode: Mode) -> PhaseDynamics:
    """Return the equations of motion of a mode; grids and sequences share them, and the Functions built from them."""
    return PhaseDynamics(robot, mode)


def _blocks(
    builder: NlpBuilder,
    structure: Structure,
    phases: tuple[Phase, ...],
    dynamics_of_phases: tuple[PhaseDynamics, ...],
    following: FollowingStep | None = None,
) -> list[Block]:
    """Return the blocks of the NLP of one step."""
    blocks: list[Block] = []
    for phase, dynamics in zip(phases, dynamics_of_phases, strict=True):
        blocks += phase_blocks(builder, phase, dynamics)
    if builder.scheme.nodal and builder.objective.uses_power:
        blocks.append(last_power_block(builder, phases[-1], dynamics_of_phases[-1]))
    blocks.append(touchdown_block(builder, structure.sequence, phases, dynamics_of_phases[0], following))
    if structure.schedule is not None:
        blocks += guard_blocks(builder, phases, structure.schedule)
    if builder.objective.per_weight_and_travel:
        blocks.append(quotient_block(builder, dynamics_of_phases[0]))
    if structure.stabilised:
        section = section_names(structure.robot, structure.sequence)
        blocks += deviation_blocks(builder, section, structure.sequence, phases, dynamics_of_phases)
        blocks.append(radius_block(builder, section, structure.radius_weight, scaled=structure.fed_back))
    return blocks


def _variables(
    structure: Structure, phases: tuple[Phase, ...], dynamics_of_phases: tuple[PhaseDynamics, ...]
) -> Layout:
    layout, robot, scheme = Layout(), structure.robot, structure.scheme
    nodes = node_places(phases)
    intervals = [phase.place(k, between=True) for phase in phases for k in range(phase.count)]
    layout.add(Unknown.ANGLES, [Key(Kind.ANGLE, angle) for angle in robot.angles], nodes)
    layout.add(Unknown.RATES, [Key(Kind.RATE, angle) for angle in robot.angles], nodes)
    torques = [Key(Kind.TORQUE, actuator) for actuator in robot.actuators]
    layout.add(Unknown.TORQUE, torques, nodes if scheme.nodal else intervals)
    layout.add(Unknown.DURATION, [Key(Kind.DURATION)], [phase.place() for phase in phases])
    if not scheme.nodal:
        layout.add(Unknown.SLIDE, SLIDE, nodes)
    for phase, dynamics in zip(phases, dynamics_of_phases, strict=True):
        _add_phase(layout, structure, phase, dynamics)
    if structure.objective.uses_power and scheme.nodal:
        layout.add(Unknown.POWER, _powers(structure), nodes)
    layout.add(Unknown.IMPULSE, [Key(Kind.IMPULSE, part) for part in ("tangential", "normal")], [TOUCHDOWN])
    if structure.sequence.impact is Mode.ANY and phases[0].slides:
        layout.add(Unknown.OPEN_IMPACT, UNKNOWNS, [TOUCHDOWN])
        _add_slacks(layout, structure, Unknown.RELAXATION, len(UNKNOWNS), [TOUCHDOWN])
    layout.add(Unknown.TRAVEL, [Key(Kind.TRAVEL)], [STEP])
    if structure.free_slope:
        layout.add(Unknown.SLOPE, [Key(Kind.SLOPE)], [GROUND])
    if structure.free:
        layout.add(Unknown.DESIGN, [Key(Kind.DESIGN, name) for name in structure.free], [DESIGN])
    if structure.objective.per_weight_and_travel:
        layout.add(Unknown.INTEGRAL, [Key(Kind.INTEGRAL)], [STEP])
    peaks = [term for _, term in structure.objective.terms() if overrides(term, "peak")]
    if peaks:
        layout.add(Unknown.PEAK, [Key(Kind.PEAK, f"{term.name} {i + 1}") for i, term in enumerate(peaks)], [STEP])
    if structure.stabilised:
        lay_out_deviations(layout, section_names(robot, structure.sequence), phases, dynamics_of_phases, scheme)
    if structure.fed_back:
        lay_out_gains(layout, robot)
    return layout


def _add_phase(layout: Layout, structure: Structure, phase: Phase, dynamics: PhaseDynamics) -> None:
    """Add the tables of unknowns of one phase."""
    scheme, number = structure.scheme, phase.number
    places = [phase.place(k - phase.first) for k in phase.nodes]
    between = [phase.place(k, between=True) for k in range(phase.count)]
    if phase.mode.slips and scheme.nodal:
        layout.add((Unknown.SLIDE, number), SLIDE, places)
    if scheme.node_unknowns(dynamics):
        layout.add((Unknown.ACCELERATION, number), scheme.node_unknowns(dynamics), places)
    if scheme.inner_unknowns(dynamics):
        layout.add((scheme.inner_table, number), scheme.inner_unknowns(dynamics), between)
    if structure.objective.uses_power:
        inner = range(1, scheme.power_fractions.size - 1)
        keys = [key.at(i) for i in inner for key in _powers(structure)]
        layout.add((Unknown.INNER_POWER, number), keys, between)
    if dynamics.mode is Mode.ANY:
        _add_slacks(layout, structure, (Unknown.RELAXATION, number), FRICTION_PAIRS, between)


def _add_slacks(layout: Layout, structure: Structure, table: TableKey, pairs: int, places: Sequence[Place]) -> None:
    """Add the unknowns that the relaxation adds to each complementarity pair."""
    slacks = () if structure.relaxation is None else structure.relaxation.slacks
    if slacks:
        layout.add(table, [Key(Kind.SLACK, slack.name, i) for i in range(pairs) for slack in slacks], places)


def _powers(structure: Structure) -> list[Key]:
    kinds = (Kind.POSITIVE_POWER, Kind.NEGATIVE_POWER)
    return [Key(kind, name) for kind in kinds for name in structure.powered]
