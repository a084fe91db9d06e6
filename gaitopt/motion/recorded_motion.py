"""read_motion: a motion of another program, or a few postures, as an initial guess or a reference to track."""

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.coordinate_entries import ANGLES, full_coordinates
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.column_table import ColumnTable, read_columns
from gaitopt.motion.kinematic_motion import PhaseKinematics, make_kinematic_motion
from gaitopt.motion.motion import Array, Motion
from gaitopt.motion.motion_fit import CoordinateFit, MotionFit, fit_curve
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.motion.recorded_columns import (
    ANGLE_UNITS,
    RecordedColumns,
    RecordedQuantity,
    assign_columns,
    is_time,
    require_coordinates,
)
from gaitopt.motion.standing_base import derive_base
from gaitopt.parameters import Parameter

SAMPLES = 65
"""Number of samples of the fitted motion."""
MOST_PIECES = 1000


@dataclass(frozen=True, eq=False, kw_only=True)
class RecordedMotion:
    r"""One step or period of a recorded motion, fitted by smooth curves.

    Attributes
    ----------
    robot : Robot or PlanarRobot
    parameters : mapping of str to float
        Parameters of robot and ground (SI units).
    time : (K,) array [s]
        From 0.
    q, rates : (n, K) arrays
        Angles of a Robot, or coordinates of a PlanarRobot, and their rates (SI units).
    slide, slide_rate : (K,) arrays [m, m/s]
        Displacement of the stance foot of a Robot; zero if it was not recorded.
    torque : (n_u, K) array [N m or N]
        Zero for actuators that were not recorded.
    fit : MotionFit

    Examples
    --------
    >>> import tempfile
    >>> from gaitopt import compass_biped
    >>> from gaitopt.ocp import FromMotion
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "poses.csv")
    ...     _ = path.write_text("time_s,th1_deg,th2_deg\n0,-8,-8\n0.4,0,6\n0.7,8,8\n")
    ...     recorded = read_motion(path, compass_biped())
    >>> recorded.fit.samples, round(recorded.motion.period, 3), FromMotion(recorded.motion).describe()
    (3, 0.7, 'a previous motion')
    """

    robot: Robot | PlanarRobot
    parameters: Mapping[str, float]
    time: Array
    q: Array = field(repr=False)
    rates: Array = field(repr=False)
    slide: Array = field(repr=False)
    slide_rate: Array = field(repr=False)
    torque: Array = field(repr=False)
    fit: MotionFit

    @property
    def motion(self) -> Motion:
        """The step as a motion of the robot, for ``FromMotion`` and ``Tracking``.

        Raises
        ------
        InputError
            If the robot has several contacts; its guesses are ``PlanarKeyframes``.
        """
        if not isinstance(self.robot, Robot):
            raise InputError(
                f"Robot {self.robot.name!r} has several contacts: use PlanarKeyframes(recorded.time, "
                "recorded.coordinates) as its guess."
            )
        q, v = full_coordinates(self.q, self.slide), full_coordinates(self.rates, self.slide_rate)
        phase = PhaseKinematics(mode=Mode.STICK, time=self.time, q=q, v=v, torque=self.torque)
        return make_kinematic_motion(self.robot, self.parameters, [phase])

    @property
    def coordinates(self) -> dict[str, list[float]]:
        """Samples by coordinate, for ``PlanarKeyframes``."""
        names = self.robot.angles if isinstance(self.robot, Robot) else self.robot.coordinates
        return dict(zip(names, self.q.tolist(), strict=True))


@check_arguments
def read_motion(
    path: str | Path,
    robot: Robot | PlanarRobot,
    *,
    parameters: Mapping[str, float] | None = None,
    angle_unit: str | None = None,
    columns: Mapping[str, str] | None = None,
    span: tuple[float, float] | None = None,
    pieces: int | None = None,
    sequence: PhaseSequence | str | None = None,
) -> RecordedMotion:
    """Read one step from a file of another program, or a few postures with their times.

    Columns are named as in the files of :func:`gaitopt.write_csv`: ``time_s``, ``th1_rad`` or ``th1_deg``, and if they
    are known ``th1_rate_rad_per_s``, ``hip_torque_Nm`` and, for a foot that slips, ``x_m``.  Up to 12 samples are
    interpolated by monotone cubics, more are approximated by least-squares splines.

    Parameters
    ----------
    path : str or Path
        ``.csv`` (comma, semicolon or tab), ``.mat`` (vectors, or a structure of vectors), ``.sto`` or ``.mot``.
    robot : Robot or PlanarRobot
    parameters : mapping of str to float, optional
        Parameters of robot and ground (SI units), for the check of the landing and the energies.
    angle_unit : str, optional
        ``"rad"`` or ``"deg"``, for columns without a unit; OpenSim files state it themselves.
    columns : mapping of str to str, optional
        Columns of coordinates, and of the time, with other names in the file, such as ``{"th1": "hip_flexion_r",
        "time": "Time"}``.  A time without unit is in seconds.
    span : (float, float), optional
        First and last instant of the step in the time of the file [s]; the whole file by default, or the first step of
        a file with the column ``step``.
    pieces : int, optional
        Number of pieces of the splines; by default 16, or a quarter of the number of samples if that is less.
    sequence : PhaseSequence or str, optional
        Contact sequence of a robot with several contacts.  If a foot stands in all phases, the position of the base may
        be missing in the file: it is derived from this foot, and `fit` reports it.

    Returns
    -------
    RecordedMotion
        Its `fit` reports the difference of every curve from the samples, and where in the step it is largest.

    Raises
    ------
    InputError
        If a column, its unit or the time is missing or invalid; the message names the nearest column.
    ArchiveError
        If the file is unreadable.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> read_motion("nowhere.csv", compass_biped())
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: There is no file nowhere.csv.
    """
    path = Path(path)
    if angle_unit not in (None, *ANGLE_UNITS):
        raise InputError(f"angle_unit must be 'rad' or 'deg', got {angle_unit!r}.")
    if pieces is not None:
        Parameter("pieces", 1, "1", "", lower=1, upper=MOST_PIECES, whole=True).check(pieces)
    table = _select_step(read_columns(path, _time_column(columns or {})), span is None)
    names, units = _coordinates(robot)
    extra = [RecordedQuantity("x", "m")] if isinstance(robot, Robot) else []
    quantities = [*map(RecordedQuantity, names, units), *extra]
    recorded = assign_columns(table, path, quantities, robot.actuators, columns or {}, angle_unit)
    recorded, values = _cut(recorded, path, span), robot.resolve(parameters or {})
    if isinstance(robot, PlanarRobot) and sequence is not None:
        recorded = derive_base(robot, values, PhaseSequence.parse(sequence, robot), recorded)
    require_coordinates(recorded, path, quantities[: len(names)])
    return _fit(robot, values, recorded, pieces)


def _time_column(columns: Mapping[str, str]) -> str | None:
    """Return the column that is stated as the time, or None."""
    return next((column for name, column in columns.items() if is_time(name)), None)


def _coordinates(robot: Robot | PlanarRobot) -> tuple[tuple[str, ...], tuple[str, ...]]:
    if isinstance(robot, PlanarRobot):
        return robot.coordinates, robot.units
    return robot.angles, ("rad",) * len(robot.angles)


def _select_step(table: ColumnTable, whole: bool) -> ColumnTable:
    """Return the rows of the first step of a file that numbers its steps."""
    steps = table.columns.get("step")
    if steps is None or not whole:
        return table
    chosen = steps == steps[0]
    columns = {name: values[chosen] for name, values in table.columns.items() if name != "step"}
    return ColumnTable(columns, table.texts, table.angle_unit)


def _cut(recorded: RecordedColumns, path: Path, span: tuple[float, float] | None) -> RecordedColumns:
    """Return the samples of a span of time, from 0; of equal instants, where phases meet, the first."""
    time, first = np.unique(recorded.time, return_index=True)
    if np.any(np.diff(recorded.time) < 0) or not np.all(np.isfinite(time)):
        raise InputError(f"{path}: the time must increase from row to row and be finite.")
    begin, end = (time[0], time[-1]) if span is None else span
    chosen = first[(time >= begin) & (time <= end)]
    if chosen.size < 2:
        raise InputError(f"{path}: span must contain two samples between {time[0]:g} and {time[-1]:g} s, got {span!r}.")

    def select(rows: Mapping[str, Array]) -> dict[str, Array]:
        for name, values in rows.items():
            if not np.all(np.isfinite(values[chosen])):
                raise InputError(f"{path}: the values of {name} must be finite numbers.")
        return {name: values[chosen] for name, values in rows.items()}

    return RecordedColumns(
        recorded.time[chosen] - recorded.time[chosen][0],
        select(recorded.coordinates),
        select(recorded.rates),
        select(recorded.torques),
        recorded.ignored,
        recorded.warnings,
    )


def _fit(
    robot: Robot | PlanarRobot, values: dict[str, float], recorded: RecordedColumns, pieces: int | None
) -> RecordedMotion:
    names, units = _coordinates(robot)
    time = np.linspace(0.0, recorded.time[-1], SAMPLES)
    curves = {name: fit_curve(recorded.time, samples, pieces) for name, samples in recorded.coordinates.items()}
    q, rates = (np.array([curves[name](time, order) for name in names]) for order in (0, 1))
    foot = curves.get("x") if isinstance(robot, Robot) else None
    slide, slide_rate = (np.zeros(SAMPLES) if foot is None else foot(time, order) for order in (0, 1))
    torque = np.zeros((robot.n_u, SAMPLES))
    for number, actuator in enumerate(robot.actuators):
        if actuator in recorded.torques:
            torque[number] = np.interp(time, recorded.time, recorded.torques[actuator])
    closure, height = _close_step(robot, values, q, rates)
    fits = [
        _compare(name, unit, curves[name], recorded, float(gap))
        for name, unit, gap in zip(names, units, closure, strict=True)
    ]
    duration = float(recorded.time[-1])
    report = MotionFit(tuple(fits), recorded.time.size, duration, height, recorded.ignored, recorded.warnings)
    return RecordedMotion(
        robot=robot,
        parameters=values,
        time=time,
        q=q,
        rates=rates,
        slide=slide - slide[0],
        slide_rate=slide_rate,
        torque=torque,
        fit=report,
    )


def _compare(name: str, unit: str, curve: Any, recorded: RecordedColumns, closure: float) -> CoordinateFit:
    """Return the report on the curve of a coordinate."""
    difference = np.abs(curve(recorded.time) - recorded.coordinates[name])
    worst = int(np.argmax(difference))
    rate = float("nan")
    if name in recorded.rates:
        rate = float(np.max(np.abs(curve(recorded.time, 1) - recorded.rates[name])))
    return CoordinateFit(
        name=name,
        unit=unit,
        rms=float(np.sqrt(np.mean(difference**2))),
        largest=float(difference[worst]),
        place=float(recorded.time[worst] / recorded.time[-1]),
        closure=closure,
        rate_error=rate,
    )


def _close_step(robot: Robot | PlanarRobot, values: dict[str, float], q: Array, rates: Array) -> tuple[Array, float]:
    """Return the difference of the exchanged end from the start, and the height of the landing foot at the end."""
    if isinstance(robot, PlanarRobot):
        mirror = np.eye(robot.n_q) if robot.mirror is None else robot.mirror.coordinates
        difference = mirror @ q[:, -1] - q[:, 0]
        if robot.travel is not None:
            difference[robot.coordinates.index(robot.travel)] = 0.0
        return difference, float("nan")
    p = robot.vector(values)
    last, speed = full_coordinates(q[:, -1]), full_coordinates(rates[:, -1])
    exchanged = np.asarray(robot.swap(last, speed, p)[0]).ravel()[ANGLES]
    return exchanged - q[:, 0], float(robot.landing(last, speed, p)[0][1])
