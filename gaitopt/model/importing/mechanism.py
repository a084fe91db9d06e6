"""The bodies and joints of a URDF or MJCF file in its zero pose, as plain data; MuJoCo reads the file."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, describe_missing_file

Vector = NDArray[np.float64]

MASSLESS = 1e-12
"""Mass [kg] below which a body has none."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ImportedJoint:
    """A joint in the zero pose.

    Attributes
    ----------
    name : str
    kind : str
        ``"hinge"``, ``"slide"``, ``"ball"`` or ``"free"``.
    anchor, axis : (3,) arrays
        In the frame of the ground [m, 1].
    zero : float
        Value of the coordinate in the zero pose [rad or m].
    limits : (float, float) or None
        Range of the coordinate.
    stiffness, rest, damping, armature, friction : float
        Spring and its rest value, damper, reflected inertia, and dry friction.
    """

    name: str
    kind: str
    anchor: Vector
    axis: Vector
    zero: float
    limits: tuple[float, float] | None
    stiffness: float
    rest: float
    damping: float
    armature: float
    friction: float


@dataclass(frozen=True, eq=False, kw_only=True)
class ImportedBody:
    """A body in the zero pose, in the frame of the ground.

    Attributes
    ----------
    name : str
    parent : int or None
        Number of the body to which it is joined; None for the ground.
    origin : (3,) array
        Origin of its frame [m].
    rotation : (3, 3) array
        From its frame to that of the ground.
    mass : float [kg]
    centre : (3,) array
        Centre of mass [m].
    inertia : (3, 3) array
        About the centre of mass [kg m^2].
    joints : tuple of ImportedJoint
        From the parent outwards; none if the body is fixed to its parent.
    """

    name: str
    parent: int | None
    origin: Vector
    rotation: Vector
    mass: float
    centre: Vector
    inertia: Vector
    joints: tuple[ImportedJoint, ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class Mechanism:
    """A robot of a file.

    Attributes
    ----------
    name : str
    bodies : tuple of ImportedBody
        A parent before its children.
    actuators : mapping of str to str
        Joints by the names of their actuators.
    gravity : float [m/s^2]
    others : mapping of str to int
        Numbers of further elements, by kind: shapes, tendons and equality constraints.
    """

    name: str
    bodies: tuple[ImportedBody, ...]
    actuators: dict[str, str]
    gravity: float
    others: dict[str, int]


def read_mechanism(source: str | Path) -> Mechanism:
    """Read a URDF or MJCF file, or its text.

    Raises
    ------
    InputError
        If MuJoCo is not installed, or the file is missing or invalid.

    Examples
    --------
    >>> read_mechanism("nowhere.urdf")
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: There is no file nowhere.urdf.
    """
    text = str(source).lstrip()
    if not text.startswith("<") and not Path(source).is_file():
        raise InputError(describe_missing_file(source))
    try:
        import mujoco
    except ImportError:
        raise InputError("The import of robots requires the package mujoco: pip install 'gaitopt[import]'.") from None
    try:
        spec = mujoco.MjSpec.from_string(text) if text.startswith("<") else mujoco.MjSpec.from_file(str(source))
        spec.compiler.fusestatic = False  # a body that is fixed to another one keeps its mass
        spec.compiler.discardvisual = True
        spec.compiler.boundmass = spec.compiler.boundinertia = MASSLESS / 2  # MuJoCo rejects moving parts without mass
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"MuJoCo cannot read the robot: {error}") from None
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    kinds = {int(kind): kind.name.removeprefix("mjJNT_").lower() for kind in mujoco.mjtJoint.__members__.values()}
    joint_motors = [k for k in range(model.nu) if model.actuator_trntype[k] == mujoco.mjtTrn.mjTRN_JOINT]
    joints = [_read_joint(model, data, j, kinds) for j in range(model.njnt)]
    return Mechanism(
        name=spec.modelname or "robot",
        bodies=tuple(_read_body(model, data, number, joints) for number in range(1, model.nbody)),
        actuators={model.actuator(k).name or joints[j].name: joints[j].name for k, j in _motors(model, joint_motors)},
        gravity=float(-model.opt.gravity[2]),
        others={"shapes": model.ngeom, "tendons": model.ntendon, "equality constraints": model.neq},
    )


def _motors(model: Any, numbers: list[int]) -> list[tuple[int, int]]:
    """Return the numbers of actuators and of their joints."""
    return [(k, int(model.actuator_trnid[k, 0])) for k in numbers]


def _read_joint(model: Any, data: Any, j: int, kinds: dict[int, str]) -> ImportedJoint:
    place, degree = int(model.jnt_qposadr[j]), int(model.jnt_dofadr[j])
    per_degree = {
        label: float(np.ravel(getattr(model, name)[degree])[0])
        for label, name in (("damping", "dof_damping"), ("armature", "dof_armature"), ("friction", "dof_frictionloss"))
    }
    return ImportedJoint(
        name=model.joint(j).name or f"joint_{j}",
        kind=kinds[int(model.jnt_type[j])],
        anchor=data.xanchor[j].copy(),
        axis=data.xaxis[j].copy(),
        zero=float(model.qpos0[place]),
        limits=tuple(model.jnt_range[j].tolist()) if model.jnt_limited[j] else None,
        stiffness=float(np.ravel(model.jnt_stiffness[j])[0]),
        rest=float(model.qpos_spring[place]),
        **per_degree,
    )


def _read_body(model: Any, data: Any, number: int, joints: list[ImportedJoint]) -> ImportedBody:
    first, parent = int(model.body_jntadr[number]), int(model.body_parentid[number])
    mass = float(model.body_mass[number])
    turn = data.ximat[number].reshape(3, 3)
    return ImportedBody(
        name=model.body(number).name or f"body_{number}",
        parent=parent - 1 if parent else None,
        origin=data.xpos[number].copy(),
        rotation=data.xmat[number].reshape(3, 3).copy(),
        mass=mass if mass > MASSLESS else 0.0,
        centre=data.xipos[number].copy(),
        inertia=turn @ np.diag(model.body_inertia[number]) @ turn.T,
        joints=tuple(joints[first : first + int(model.body_jntnum[number])]) if first >= 0 else (),
    )
