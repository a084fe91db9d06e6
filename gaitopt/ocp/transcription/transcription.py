"""Transcription: from the structure of a gait problem to a nonlinear programme.

Unknowns per node: angles, rates, torques (continuous and linear between nodes); per slip phase also the foot's slide
and slide rate; one duration per phase; the landing impulse; the travel of the step; what the scheme adds.  The last
node of a phase *is* the first node of the next.
"""

import functools
from dataclasses import dataclass

import casadi as ca
import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.ocp.nlp.layout import Layout, Rows
from gaitopt.ocp.nlp.nlp import Block, Nlp, assemble_nlp
from gaitopt.ocp.statement.objective import Objective
from gaitopt.ocp.transcription.grid import Phase, divide_into_phases, node_labels
from gaitopt.ocp.transcription.guard_constraints import GuardSchedule, guard_blocks
from gaitopt.ocp.transcription.impact_complementarity import OPEN_IMPACT, UNKNOWNS
from gaitopt.ocp.transcription.impact_constraints import touchdown_block
from gaitopt.ocp.transcription.nlp_builder import MARGINS, NlpBuilder
from gaitopt.ocp.transcription.phase_constraints import (
    end_block,
    interval_block,
    last_power_block,
    quotient_block,
    start_block,
)
from gaitopt.ocp.transcription.phase_dynamics import PhaseDynamics
from gaitopt.ocp.transcription.relaxation import Relaxation
from gaitopt.ocp.transcription.scheme import Scheme, at_inner_point

NODE_TABLES = ("angles", "rates", "torque", "power")
"""Tables of unknowns with one place for each node of the step."""


@dataclass(frozen=True, kw_only=True)
class Structure:
    """What decides the equations of a programme, as against the numbers in them; equal structures share one programme.

    Attributes
    ----------
    robot : Robot
    sequence : ContactSequence
    objective : Objective
    scheme : Scheme
    counts : tuple of int
        Intervals of each phase.
    powered : tuple of str
        Actuators that may work; the others are idle.
    free_slope : bool
        Whether the slope is an unknown.
    rate_limited : bool
        Whether torque rates are constrained.
    cleared : bool
        Whether the swing foot keeps a clearance.
    landing : Landing or None
        What the touchdown's guard keeps to during the step.
    relaxation : Relaxation or None
        Of the complementarity pairs, for an open contact sequence.
    """

    robot: Robot
    sequence: ContactSequence
    objective: Objective
    scheme: Scheme
    counts: tuple[int, ...]
    powered: tuple[str, ...]
    free_slope: bool = False
    rate_limited: bool = False
    cleared: bool = False
    landing: GuardSchedule | None = None
    relaxation: Relaxation | None = None

    def data(self) -> ca.SX:
        """Return symbols for the data of a solve; see :class:`gaitopt.ocp.transcription.nlp_builder.Frame`."""
        given = len(self.robot.parameters) + len(MARGINS) + self.cleared
        return ca.SX.sym("z", given + (self.relaxation is not None))


@dataclass(frozen=True, eq=False, kw_only=True)
class Transcription:
    """A compiled gait problem; serves every parameter value.

    Attributes
    ----------
    structure : Structure
    phases : tuple of Phase
    stances : tuple of PhaseDynamics
        The continuous physics of each phase.
    variables, constraints : Layout
        Names and places of the decision vector and of the constraint rows.
    row_bounds : (2, n_constraints) array
        Lower and upper bounds of the rows; some come from the problem instead.
    nlp : Nlp
    """

    structure: Structure
    phases: tuple[Phase, ...]
    dynamics_of_phases: tuple[PhaseDynamics, ...]
    variables: Layout
    constraints: Layout
    row_bounds: np.ndarray
    nlp: Nlp

    @functools.cached_property
    def n_nodes(self) -> int:
        """Number of nodes of the step."""
        return self.phases[-1].nodes[-1] + 1


@functools.lru_cache(maxsize=32)
def transcribe(structure: Structure) -> Transcription:
    """Transcribe a structure into a nonlinear programme; equal structures return the programme built before."""
    robot = structure.robot
    phases = divide_into_phases(structure.sequence, structure.counts)
    dynamics_of_phases = tuple(PhaseDynamics(robot, phase.mode) for phase in phases)
    variables, rows = _variables(structure, phases, dynamics_of_phases), Rows()
    frame = NlpBuilder(
        robot=robot,
        objective=structure.objective,
        scheme=structure.scheme,
        powered=tuple(robot.actuators.index(name) for name in structure.powered),
        rate_limited=structure.rate_limited,
        variables=variables,
        rows=rows,
        data=structure.data(),
        cleared=structure.cleared,
        relaxation=structure.relaxation,
    )
    blocks: list[Block] = []
    for phase, stance in zip(phases, dynamics_of_phases, strict=True):
        blocks.append(interval_block(frame, phase, stance))
        blocks.append(end_block(frame, phase, stance))
        if phase.breaks_away:
            blocks.append(start_block(frame, phase, stance))
    if structure.objective.uses_power:
        blocks.append(last_power_block(frame, phases[-1], dynamics_of_phases[-1]))
    blocks.append(touchdown_block(frame, structure.sequence, phases))
    if structure.landing is not None:
        blocks += guard_blocks(frame, phases, structure.landing)
    if structure.objective.per_weight_and_travel:
        blocks.append(quotient_block(frame, dynamics_of_phases[0]))
    return Transcription(
        structure=structure,
        phases=phases,
        dynamics_of_phases=dynamics_of_phases,
        variables=variables,
        constraints=rows.layout,
        row_bounds=rows.bounds(),
        nlp=assemble_nlp(
            blocks,
            frame.data,
            variables.size,
            rows.layout.size,
            typical=structure.objective.typical,
            smooth=structure.objective.smooth and structure.relaxation is None,
        ),
    )


def _variables(
    structure: Structure, phases: tuple[Phase, ...], dynamics_of_phases: tuple[PhaseDynamics, ...]
) -> Layout:
    layout, robot, scheme = Layout(), structure.robot, structure.scheme
    nodes = node_labels(phases)
    layout.add("angles", robot.angles, nodes)
    layout.add("rates", [f"{angle} rate" for angle in robot.angles], nodes)
    layout.add("torque", [f"{actuator} torque" for actuator in robot.actuators], nodes)
    layout.add("duration", ["duration"], [phase.label for phase in phases])
    works = structure.objective.uses_power
    powers = [f"{sign} power of {name}" for sign in ("positive", "negative") for name in structure.powered]
    for phase, stance in zip(phases, dynamics_of_phases, strict=True):
        places = [f"{phase.label}, node {k - phase.first}" for k in phase.nodes]
        between = [f"{phase.label}, between nodes {k} and {k + 1}" for k in range(phase.count)]
        if phase.mode.slips:
            layout.add(f"slide {phase.number}", ["foot slide", "foot speed"], places)
        if scheme.node_unknowns(stance):
            layout.add(f"acceleration {phase.number}", scheme.node_unknowns(stance), places)
        if scheme.inner_unknowns(stance):
            layout.add(f"inner acceleration {phase.number}", scheme.inner_unknowns(stance), between)
        if works:
            names = [name + at_inner_point(i + 1) for i in range(len(scheme.inner)) for name in powers]
            layout.add(f"inner power {phase.number}", names, between)
    if works:
        layout.add("power", powers, nodes)
    layout.add("impulse", ["tangential impulse", "normal impulse"], ["touchdown"])
    if structure.sequence.impact is Mode.ANY and phases[0].slides:
        layout.add(OPEN_IMPACT, UNKNOWNS, ["touchdown"])
    layout.add("travel", ["step length"], ["step"])
    if structure.free_slope:
        layout.add("slope", ["slope"], ["ground"])
    if structure.objective.per_weight_and_travel:
        layout.add("integral", ["integral of the objective"], ["step"])
    return layout
