"""Transcription of the gait of a planar robot with any contacts into an NLP.

All phases use the coordinates of the robot, so that every event is a set of rows.  Coordinates are continuous; rates
and torques are so except at impacts.  The torques are linear between nodes.
"""

import functools

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.ocp.multicontact.event_constraints import planar_end_block, planar_event_block, planar_step_block
from gaitopt.ocp.multicontact.impulse_cost import planar_impulse_block
from gaitopt.ocp.multicontact.interval_constraints import planar_interval_block
from gaitopt.ocp.multicontact.phase_grid import GridPhase, divide_phases
from gaitopt.ocp.multicontact.planar_builder import PlanarBuilder, PlanarStructure, lay_out_unknowns
from gaitopt.ocp.multicontact.planar_objective import planar_quotient_block
from gaitopt.ocp.multicontact.planar_step_cost import planar_cost_block
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.nlp.layout import Layout, Rows
from gaitopt.ocp.nlp.nlp import Nlp, assemble_nlp
from gaitopt.ocp.transcription.nlp_builder import MARGINS


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanarTranscription:
    """A compiled gait problem for all parameter values.

    Attributes
    ----------
    builder : PlanarBuilder
    variables, constraints : Layout
        Layouts of the decision vector and of the constraint rows.
    row_bounds : (2, n_constraints) array
        Lower and upper bounds of the rows; the problem replaces some of them.
    nlp : Nlp
    """

    builder: PlanarBuilder
    variables: Layout
    constraints: Layout
    row_bounds: np.ndarray
    nlp: Nlp

    @property
    def structure(self) -> PlanarStructure:
        """Choices that determine the equations."""
        return self.builder.structure

    @property
    def phases(self) -> tuple[GridPhase, ...]:
        """Phases on the grid."""
        return self.builder.phases


@functools.lru_cache(maxsize=32)
def transcribe_planar(structure: PlanarStructure) -> PlanarTranscription:
    """Transcribe a structure into an NLP; equal structures return the NLP built before."""
    robot, objective = structure.robot, structure.objective
    phases = divide_phases(robot, structure.sequence, structure.counts, infinite=structure.infinite)
    variables, rows = lay_out_unknowns(structure, phases), Rows()
    data = ca.SX.sym("z", len(robot.parameters) + len(MARGINS))
    builder = PlanarBuilder(structure, phases, variables, rows, data)
    blocks = [planar_interval_block(builder, phase) for phase in phases]
    blocks += [planar_end_block(builder, phase) for phase in phases]
    blocks += [block for phase in phases if (block := planar_event_block(builder, phase)) is not None]
    blocks += [block for phase in phases if (block := planar_impulse_block(builder, phase)) is not None]
    blocks.append(planar_step_block(builder))
    if Unknown.INTEGRAL in variables:
        blocks.append(planar_quotient_block(builder))
    step_cost = planar_cost_block(builder)
    if step_cost is not None:
        blocks.append(step_cost)
    return PlanarTranscription(
        builder=builder,
        variables=variables,
        constraints=rows.layout,
        row_bounds=rows.bounds(),
        nlp=assemble_nlp(
            blocks,
            data,
            variables.size,
            rows.layout.size,
            typical=objective.typical,
            smooth=objective.smooth,
            dissect=structure.lifted,
        ),
    )
