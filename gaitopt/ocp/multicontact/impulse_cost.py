"""The work of the impulses of actuators in the objective."""

from typing import Any

import casadi as ca
import numpy as np

from gaitopt.errors import InputError
from gaitopt.ocp.multicontact.impulse_stages import ImpulseStage, list_instants, stage_works
from gaitopt.ocp.multicontact.phase_grid import GridPhase
from gaitopt.ocp.multicontact.planar_builder import PlanarBuilder
from gaitopt.ocp.multicontact.planar_objective import make_instant
from gaitopt.ocp.multicontact.planar_point import PlanarPoint
from gaitopt.ocp.nlp.block import Block
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.transcription.nlp_builder import BlockVariables


def planar_impulse_block(builder: PlanarBuilder, phase: GridPhase) -> Block | None:
    """Return the block with the work of the impulses at the end of a phase; None if the objective counts no work.

    The integrand of an objective is linear in the parts of the joint powers, so that its integral over an impulse is
    its value with the generated and the absorbed work in their places.
    """
    structure = builder.structure
    if not structure.objective.uses_power or not any(entry.phase == phase.number for entry in structure.impulses):
        return None
    local = BlockVariables(builder, 1)
    p, last = builder.parameters(local), [phase.count]
    q, v = (
        local.add(name, part(phase)[:, last]) for name, part in (("q", builder.coordinates), ("v", builder.velocities))
    )
    u = local.add("u", builder.torques(phase)[:, last])
    z = local.add("z", builder.variables[Unknown.ACCELERATION, phase.number][:, last])
    instants = list_instants(builder, local, phase, (q, v, builder.rates_after(local, phase), p))
    parts = sum(
        (_sum_parts(builder, stage, stage_works(builder, stage, instants)) for stage in instants.stages), ca.SX(0)
    )
    plain, relative = _count_work(builder, phase, PlanarPoint(q, v, u, z, p), parts)
    if not structure.objective.per_weight_and_travel:
        return local.block(f"impulses_{phase.number}", ca.SX(0, 1), np.empty((0, 1), dtype=int), plain)
    return local.block(f"impulses_{phase.number}", relative, np.array([[builder.integral_row()]]), plain)


def _sum_parts(builder: PlanarBuilder, stage: ImpulseStage, works: tuple[ca.SX, ca.SX]) -> ca.SX:
    """Return generated, then absorbed work of all actuators that are not idle."""
    powered = builder.structure.powered
    parts = ca.SX.zeros(2 * len(powered))
    for k, entry in enumerate(stage.entries):
        place = powered.index(entry.actuator)
        parts[place] += works[0][k]
        parts[len(powered) + place] += works[1][k]
    return parts


def _count_work(builder: PlanarBuilder, phase: GridPhase, point: PlanarPoint, works: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return the cost of the work, plain and per weight and travel."""
    plain, relative, rate = ca.SX(0), ca.SX(0), ca.SX.zeros(builder.robot.n_u)
    symbols = ca.SX.sym("work", works.numel())
    for weight, objective in builder.structure.objective.terms():
        term: Any = objective  # an instant of a planar robot has the fields of one with a single foot
        if not term.uses_power:
            continue
        integrand = ca.SX(term.integrand(make_instant(builder, phase, point, rate, symbols)))
        slope = ca.jacobian(integrand, symbols)
        if ca.depends_on(slope, symbols):
            raise InputError(
                f"The objective {term.name!r} is not linear in the parts of the joint powers, so that the work of an "
                "ActuatorImpulse has no cost; use an objective such as positive_work or cost_of_transport."
            )
        if term.per_weight_and_travel:
            relative += weight * slope @ works
        else:
            plain += weight * slope @ works
    return plain, relative
