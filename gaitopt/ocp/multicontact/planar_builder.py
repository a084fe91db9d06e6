"""Structure and tables of the NLP of a planar robot: unknowns at nodes and inner points, and their indices."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.locks import cached_property
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.newton_euler import NewtonEuler
from gaitopt.model.planar.phase_system import group_sticking
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.actuator_impulses import MOMENTS, Moment
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.ocp.multicontact.actuator_impulse import ImpulseEntry
from gaitopt.ocp.multicontact.phase_grid import GridPhase
from gaitopt.ocp.nlp.keys import DESIGN, STEP, Group, Key, Kind, Place, StepPart, Unknown, equation
from gaitopt.ocp.nlp.layout import Index, Layout, Rows
from gaitopt.ocp.statement.objective import Objective, overrides
from gaitopt.ocp.transcription.collocation import Lobatto
from gaitopt.ocp.transcription.nlp_builder import MARGINS, BlockVariables


@dataclass(frozen=True, kw_only=True)
class PlanarStructure:
    """Choices that determine the equations of an NLP, without their numbers; equal structures share one NLP.

    Attributes
    ----------
    robot : PlanarRobot
    sequence : PhaseSequence
    objective : Objective
    scheme : Lobatto
    counts : tuple of int
        Intervals of each phase.
    powered : tuple of int
        Numbers of the actuators that are not idle.
    infinite : bool
        Whether friction is infinite.
    points : tuple of str
        Points of the robot whose height is constrained.
    lifted : bool
        Whether accelerations and forces of the joints are unknowns.
    free : tuple of str
        Names of the parameters of robot and ground that are unknowns.
    impulses : tuple of ImpulseEntry
        Impulses of actuators.
    """

    robot: PlanarRobot
    sequence: PhaseSequence
    objective: Objective
    scheme: Lobatto
    counts: tuple[int, ...]
    powered: tuple[int, ...]
    infinite: bool
    points: tuple[str, ...] = ()
    lifted: bool = False
    free: tuple[str, ...] = ()
    impulses: tuple[ImpulseEntry, ...] = ()

    def list_impulses(self, phase: int, moment: Moment) -> list[ImpulseEntry]:
        """Return the impulses of actuators just before or just after the impact that ends a phase."""
        return [entry for entry in self.impulses if entry.phase == phase and entry.moment == moment]

    def split_impulses(self, phase: int, moment: Moment) -> list[ImpulseEntry]:
        """Return those among them with positive and negative parts: of either sign, if the objective counts work."""
        entries = self.list_impulses(phase, moment) if self.objective.uses_power else []
        return [entry for entry in entries if entry.sign == 0]

    @property
    def equations(self) -> NewtonEuler:
        """Equations of motion and of impacts."""
        return self.robot.lifted if self.lifted else self.robot.recursive

    @property
    def peaks(self) -> tuple[tuple[int, Objective], ...]:
        """Numbers and parts of the objective that have a peak over the period."""
        return tuple((i, term) for i, (_, term) in enumerate(self.objective.terms()) if overrides(term, "peak"))


@dataclass(frozen=True, eq=False)
class PlanarBuilder:
    """An NLP under construction.

    Attributes
    ----------
    structure : PlanarStructure
    phases : tuple of GridPhase
    variables : Layout
        The decision vector.
    rows : Rows
        The constraint rows, to which every block appends.
    data : SX
        Parameters of robot and ground, and the margins of the friction cones.
    """

    structure: PlanarStructure
    phases: tuple[GridPhase, ...]
    variables: Layout
    rows: Rows
    data: ca.SX

    @property
    def robot(self) -> PlanarRobot:
        """The robot."""
        return self.structure.robot

    @property
    def placed(self) -> bool:
        """Whether nodes are placed by data: never, intervals are equal."""
        return False

    def names(self) -> list[str]:
        """Return the names of the parameters."""
        return [parameter.name for parameter in self.robot.parameters]

    def parameters(self, local: BlockVariables) -> ca.SX:
        """Return the vector p of parameters and switches."""
        return ca.vertcat(local.parameters(), ca.SX.zeros(len(self.robot.switches)))

    def margin(self, name: str) -> ca.SX:
        """Return a margin of the friction cones."""
        return self.data[len(self.robot.parameters) + MARGINS.index(name)]

    def integral_row(self) -> int:
        """Return the row that sums the integral of the objective."""
        if Group.INTEGRAL not in self.rows.layout:
            self.rows.add(Group.INTEGRAL, [equation(Kind.INTEGRAL)], [STEP])
        return int(self.rows.layout[Group.INTEGRAL][0, 0])

    @cached_property
    def _velocities(self) -> list[Index]:
        return _join_columns(self.variables, Unknown.COORDINATE_RATES, self.phases)

    @cached_property
    def _torques(self) -> list[Index]:
        return _join_columns(self.variables, Unknown.TORQUE, self.phases)

    def coordinates(self, phase: GridPhase) -> Index:
        """Return the indices of q at the nodes of a phase, shape (n_q, count + 1)."""
        return self.variables[Unknown.COORDINATES][:, list(phase.nodes)]

    def velocities(self, phase: GridPhase) -> Index:
        """Return the indices of v at the nodes of a phase, shape (n_q, count + 1)."""
        return self._velocities[phase.number]

    def rates_after(self, local: BlockVariables, phase: GridPhase) -> ca.SX:
        """Return the rates after the event that ends a phase, in the names of this phase, shape (n_q, 1)."""
        following = self.phases[0 if phase.is_last else phase.number + 1]
        after = local.add(f"v after event {phase.number}", self.velocities(following)[:, [0]])
        mirror = self.robot.mirror if phase.is_last else None
        return after if mirror is None else ca.DM(mirror.coordinates.T) @ after

    def torques(self, phase: GridPhase) -> Index:
        """Return the indices of the torques at the nodes of a phase, shape (n_u, count + 1)."""
        return self._torques[phase.number]


def _join_columns(variables: Layout, table: Unknown, phases: Sequence[GridPhase]) -> list[Index]:
    """Return the indices of a table at the nodes of each phase; it is continuous except at impacts."""
    columns: list[Index] = []
    for phase in phases:
        part = variables[table, phase.number]
        if part.shape[1] == phase.count:
            part = np.hstack([columns[-1][:, -1:], part])
        columns.append(part)
    return columns


def lay_out_unknowns(structure: PlanarStructure, phases: Sequence[GridPhase]) -> Layout:
    """Return the layout of the decision vector."""
    layout, robot = Layout(), structure.robot
    nodes = [phases[0].place(0), *(phase.place(k) for phase in phases for k in range(1, phase.count + 1))]
    layout.add(Unknown.COORDINATES, [Key(Kind.ANGLE, name) for name in robot.coordinates], nodes)
    rates = [Key(Kind.RATE, name) for name in robot.coordinates]
    torques = [Key(Kind.TORQUE, name) for name in robot.actuators]
    for phase in phases:
        jumps = phase.number == 0 or phases[phase.number - 1].outcome is not None
        places = [phase.place(k) for k in range(0 if jumps else 1, phase.count + 1)]
        layout.add((Unknown.COORDINATE_RATES, phase.number), rates, places)
        layout.add((Unknown.TORQUE, phase.number), torques, places)
        _add_phase(layout, structure, phase)
        if phase.outcome is not None:
            layout.add((Unknown.IMPULSE, phase.number), impulse_keys(structure, phase), [event_place(phase)])
            for moment in MOMENTS:
                if structure.list_impulses(phase.number, moment):
                    keys = stage_keys(structure, phase, moment)
                    layout.add((STAGES[moment], phase.number), keys, [event_place(phase)])
    layout.add(Unknown.DURATION, [Key(Kind.DURATION)], [phase.place() for phase in phases])
    if structure.objective.per_weight_and_travel:
        layout.add(Unknown.INTEGRAL, [Key(Kind.INTEGRAL)], [STEP])
    if structure.peaks:
        layout.add(
            Unknown.PEAK,
            [Key(Kind.PEAK, f"{term.name} {i + 1}") for i, (_, term) in enumerate(structure.peaks)],
            [STEP],
        )
    if structure.free:
        layout.add(Unknown.DESIGN, [Key(Kind.DESIGN, name) for name in structure.free], [DESIGN])
    return layout


STAGES = {"before": Unknown.IMPULSE_BEFORE, "after": Unknown.IMPULSE_AFTER}
"""Tables of the unknowns of impulses of actuators."""


def stage_keys(structure: PlanarStructure, phase: GridPhase, moment: Moment) -> list[Key]:
    """Return the keys of the impulses of actuators and their reactions, and of the rates between them and the impact.

    The order is: impulses, negative parts of those of either sign, normal reactions of the closed contacts, tangential
    ones of the sticking bodies, rates.
    """
    robot, names = structure.robot, structure.robot.contact_names
    modes = stage_modes(phase, moment)
    keys = [
        Key(Kind.ACTUATOR_IMPULSE, robot.actuators[e.actuator]) for e in structure.list_impulses(phase.number, moment)
    ]
    split = structure.split_impulses(phase.number, moment)
    keys += [Key(Kind.NEGATIVE_IMPULSE, robot.actuators[entry.actuator]) for entry in split]
    keys += [Key(Kind.IMPULSE, names[i]) for i, mode in enumerate(modes) if mode is not Mode.FREE]
    keys += [Key(Kind.IMPULSE, f"{names[first]}, tangential") for first, *_ in group_sticking(robot, modes)]
    return keys + [Key(Kind.RATE, name) for name in robot.coordinates]


def stage_modes(phase: GridPhase, moment: Moment) -> list[Mode]:
    """Return the modes of all contacts while actuators act impulsively just before or after the impact of a phase.

    After it, the contacts that stay closed have their modes in the impact.
    """
    if moment == "before":
        return list(phase.state)
    pairs = zip(phase.outcome or (), phase.after, strict=True)
    return [mode if after is not Mode.FREE else Mode.FREE for mode, after in pairs]


def _add_phase(layout: Layout, structure: PlanarStructure, phase: GridPhase) -> None:
    """Add the unknowns of a phase: accelerations and forces at all points, projections, parts of the powers."""
    robot, number, inner = structure.robot, phase.number, range(1, structure.scheme.points - 1)
    nodes = [phase.place(k) for k in range(phase.count + 1)]
    between = [phase.place(k, between=True) for k in range(phase.count)]
    keys = solution_keys(structure, phase)
    layout.add((Unknown.ACCELERATION, number), keys, nodes)
    layout.add((Unknown.INNER_ACCELERATION, number), [key.at(i) for i in inner for key in keys], between)
    rows = constraint_names(robot, phase)
    if rows:
        projections = [Key(kind, name) for kind in (Kind.POSITION_PROJECTION, Kind.RATE_PROJECTION) for name in rows]
        layout.add((Unknown.PROJECTION, number), projections, between)
    if structure.objective.uses_power and structure.powered:
        names = [robot.actuators[i] for i in structure.powered]
        powers = [Key(kind, name) for kind in (Kind.POSITIVE_POWER, Kind.NEGATIVE_POWER) for name in names]
        layout.add((Unknown.POWER, number), powers, nodes)
        layout.add((Unknown.INNER_POWER, number), [key.at(i) for i in inner for key in powers], between)


def solution_keys(structure: PlanarStructure, phase: GridPhase) -> list[Key]:
    """Return the keys of z: accelerations, normal forces, tangential forces of sticking bodies; then of the joints."""
    accelerations = [Key(Kind.ACCELERATION, name) for name in structure.robot.coordinates]
    forces = [Key(Kind.CONTACT_FORCE, name) for name in constraint_names(structure.robot, phase)]
    return accelerations + forces + joint_keys(structure, Kind.JOINT_ACCELERATION, Kind.JOINT_FORCE)


def joint_keys(structure: PlanarStructure, *kinds: Kind) -> list[Key]:
    """Return the keys of quantities of the joints, kind by kind; none in the recursive form."""
    return [Key(kind, str(k + 1)) for kind in kinds for k in range(structure.equations.n_j)]


def constraint_names(robot: PlanarRobot, phase: GridPhase) -> list[str]:
    """Return the names of the constraints of a phase: gaps, then slide coordinates of the sticking bodies."""
    names, system = robot.contact_names, phase.system
    return [names[i] for i in system.closed] + [f"{names[members[0]]}, tangential" for members in system.sticking]


def impulse_keys(structure: PlanarStructure, phase: GridPhase) -> list[Key]:
    """Return the keys of the impulses of an impact: normal, tangential of the sticking bodies, those of the joints."""
    names = structure.robot.contact_names
    bodies = group_sticking(structure.robot, list(phase.outcome or ()))
    tangential = [f"{names[members[0]]}, tangential" for members in bodies]
    impulses = [Key(Kind.IMPULSE, name) for name in [names[i] for i in impact_contacts(phase)] + tangential]
    return impulses + joint_keys(structure, Kind.JOINT_JUMP, Kind.JOINT_IMPULSE)


def impact_contacts(phase: GridPhase) -> list[int]:
    """Return the contacts that receive an impulse at the end of a phase."""
    return [i for i, mode in enumerate(phase.outcome or ()) if mode is not Mode.FREE]


def event_place(phase: GridPhase) -> Place:
    """Return the key of the event at the end of a phase."""
    return Place(StepPart.TOUCHDOWN) if phase.is_last else phase.place(phase.count)
