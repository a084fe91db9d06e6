"""GaitLibrary: the gaits of one contact sequence of a sweep, interpolated over its axes."""

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import field
from pathlib import Path

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.gait import Gait
from gaitopt.motion.kinematic_motion import PhaseKinematics, make_kinematic_motion
from gaitopt.motion.motion import Array, Motion, Segment
from gaitopt.motion.planar_gait import AnyGait
from gaitopt.parameters import Parameter
from gaitopt.study.sweeps.sweep_file import load_sweep, read_sequence_gaits

SAMPLES = 81
"""Number of samples of each phase."""


@dataclass(frozen=True, eq=False, kw_only=True)
class GaitLibrary:
    """Gaits on a grid, of which phases, durations, motions and torques are interpolated linearly along every axis.

    Instants of a phase are matched by their fraction of its duration.

    Attributes
    ----------
    robot : Robot
    sequence : str
    axes : mapping of str to (n,) array
        Values of each axis (SI units).
    units : mapping of str to str
    parameters : tuple of str
        Parameters of robot and ground.
    values : (n_1, ..., n_parameters) array
        Their values at each point; nan at points without a verified gait.
    durations : (n_1, ..., n_phases) array [s]
    samples : (n_1, ..., n_phases, 2 n_q + n_u, K) array
        Coordinates, rates and torques at K equally spaced fractions of each phase.

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped, sweep
    >>> import tempfile
    >>> problem = GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.2, step_length=0.45, limits=Limits(torque=6),
    ...     objective="torque_squared", transcription=MultipleShooting(intervals=10))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     table = sweep(problem, {"speed": [0.6, 0.62]}, starts=1, path=f"{folder}/speeds.nc")
    ...     library = load_library(f"{folder}/speeds.nc")
    >>> round(library.motion_at(speed=0.61).travel / library.motion_at(speed=0.61).period, 3)
    0.61
    """

    robot: Robot
    sequence: str
    axes: Mapping[str, Array]
    units: Mapping[str, str]
    parameters: tuple[str, ...]
    values: Array = field(repr=False)
    durations: Array = field(repr=False)
    samples: Array = field(repr=False)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of points along each axis."""
        return tuple(values.size for values in self.axes.values())

    @property
    def modes(self) -> tuple[Mode, ...]:
        """Contact mode of each phase."""
        return ContactSequence.parse(self.sequence).phases

    def motion_at(self, **coordinates: float) -> Motion:
        """Return the interpolated step, from which laws are designed as from a gait: ``feedforward(robot, motion)``.

        Parameters
        ----------
        **coordinates : float
            Value of each axis, such as ``speed=0.6`` (SI units).

        Raises
        ------
        InputError
            If an axis is missing or unknown, a value is outside its axis, or a gait is missing beside it.
        """
        corners = self._weigh_corners(coordinates)
        values, durations, samples = (
            sum(weight * table[index] for index, weight in corners.items())
            for table in (self.values, self.durations, self.samples)
        )
        if not np.all(np.isfinite(durations)):
            place = ", ".join(f"{name} {value:g}" for name, value in coordinates.items())
            raise InputError(
                f"The library has no gait at a corner of the grid cell that contains {place}; choose other values."
            )
        n_q, phases, begin = self.robot.n_q, [], 0.0
        for mode, duration, rows in zip(self.modes, durations, samples, strict=True):
            time = begin + duration * np.linspace(0.0, 1.0, rows.shape[1])
            q, v, torque = np.split(rows, [n_q, 2 * n_q])
            phases.append(PhaseKinematics(mode=mode, time=time, q=q, v=v, torque=torque))
            begin = time[-1]
        ends = [self.values[index] for index in corners]
        values = np.clip(values, np.min(ends, axis=0), np.max(ends, axis=0))  # a bound is not exceeded by rounding
        named = dict(zip(self.parameters, values.tolist(), strict=True))
        return make_kinematic_motion(self.robot, named, phases, impact=ContactSequence.parse(self.sequence).impact)

    def midpoints(self) -> Iterator[dict[str, float]]:
        """Yield the midpoint of every cell of the grid whose corners all have a gait."""
        present = np.asarray(np.isfinite(self.durations).all(axis=-1))
        cells = [range(max(size - 1, 1)) for size in self.shape]
        for cell in itertools.product(*cells):
            block = present[tuple(slice(start, start + 2) for start in cell)]
            if np.all(block):
                pairs = zip(self.axes.items(), cell, strict=True)
                yield {name: float(np.mean(values[start : start + 2])) for (name, values), start in pairs}

    def _weigh_corners(self, coordinates: Mapping[str, float]) -> dict[tuple[int, ...], float]:
        """Return the corners of the cell around a place with their weights; corners without weight are omitted."""
        for name in coordinates:
            if name not in self.axes:
                raise InputError(f"The library has no axis {name!r}. {suggest(name, self.axes)}")
        if set(coordinates) != set(self.axes):
            raise InputError(f"A point of the library needs a value for {', '.join(self.axes)}.")
        ends = []
        for name, values in self.axes.items():
            unit, low, high = self.units[name], float(values[0]), float(values[-1])
            value = Parameter(name, low, unit, "", lower=low, upper=high).check(coordinates[name])
            start = min(int(np.searchsorted(values, value, side="right")) - 1, max(values.size - 2, 0))
            share = 0.0 if values.size == 1 else (value - values[start]) / (values[start + 1] - values[start])
            ends.append({start: 1 - share, start + 1: share})
        corners = (
            (tuple(index), math.prod(end[i] for end, i in zip(ends, index, strict=True)))
            for index in itertools.product(*ends)
        )
        return {index: float(weight) for index, weight in corners if weight > 0}


@check_arguments
def load_library(path: str | Path, sequence: str | None = None) -> GaitLibrary:
    """Read the verified gaits of a sweep as a library.

    Parameters
    ----------
    path : str or Path
        File of a sweep.
    sequence : str, optional
        Contact sequence, if the sweep has several.

    Returns
    -------
    GaitLibrary

    Raises
    ------
    InputError
        If the sequence is missing or unknown, the robot has several contacts, or no gait is verified.
    ArchiveError
        If the file is missing, damaged or of another kind.

    Examples
    --------
    >>> load_library("nowhere.nc")
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: There is no file nowhere.nc.
    """
    table = load_sweep(path)
    sequences = [str(name) for name in table.sequence.values]
    if sequence is None and len(sequences) > 1:
        raise InputError(
            f"The sweep in {path} has several sequences; specify one of {', '.join(map(repr, sequences))} by "
            "sequence=..., or --sequence."
        )
    chosen = sequences[0] if sequence is None else sequence
    if chosen not in sequences:
        raise InputError(f"The sweep in {path} has no contact sequence {chosen!r}. {suggest(chosen, sequences)}")
    axes = {str(name): np.asarray(table[name].values, dtype=float) for name in table.status.dims[1:]}
    gaits = read_sequence_gaits(Path(path), sequences.index(chosen))
    usable = {index: _require_single_support(gait, path) for index, gait in gaits.items() if _is_verified(gait)}
    if not usable:
        raise InputError(f"The sweep in {path} has no verified gait of the contact sequence {chosen!r}.")
    units = {name: str(table[name].attrs.get("units", "1")) for name in axes}
    return _tabulate(usable, chosen, axes, units)


def _is_verified(gait: AnyGait) -> bool:
    return gait.status.ok and gait.verification is not None and gait.verification.passed


def _require_single_support(gait: AnyGait, path: str | Path) -> Gait:
    if not isinstance(gait, Gait):
        raise InputError(f"{path} has gaits of a robot with several contacts, which a library does not interpolate.")
    return gait


def resample_phase(segment: Segment) -> Array:
    """Return coordinates, rates and torques at equally spaced instants of a phase, shape (2 n_q + n_u, K).

    Coordinates are cubic between the samples, with the sampled rates; rates follow a spline, torques are linear.
    """
    from scipy.interpolate import CubicHermiteSpline, CubicSpline  # whose import takes longer than a solve

    at = np.linspace(segment.time[0], segment.time[-1], SAMPLES)
    q = CubicHermiteSpline(segment.time, segment.q, segment.v, axis=1)(at)
    v = CubicSpline(segment.time, segment.v, axis=1)(at)
    return np.vstack([q, v, *(np.interp(at, segment.time, row) for row in segment.torque)])


def _tabulate(
    gaits: Mapping[tuple[int, ...], Gait], sequence: str, axes: dict[str, Array], units: dict[str, str]
) -> GaitLibrary:
    """Return the library of gaits by their index on the grid."""
    shape = tuple(values.size for values in axes.values())
    first = next(iter(gaits.values()))
    robot, parameters, phases = first.robot, tuple(first.motion.parameters), len(first.motion.segments)
    values = np.full((*shape, len(parameters)), np.nan)
    durations = np.full((*shape, phases), np.nan)
    samples = np.full((*shape, phases, 2 * robot.n_q + robot.n_u, SAMPLES), np.nan)
    for index, gait in gaits.items():
        values[index] = [gait.motion.parameters[name] for name in parameters]
        for phase, segment in enumerate(gait.motion.segments):
            durations[(*index, phase)] = segment.duration
            samples[(*index, phase)] = resample_phase(segment)
    return GaitLibrary(
        robot=robot,
        sequence=sequence,
        axes=axes,
        units=units,
        parameters=parameters,
        values=values,
        durations=durations,
        samples=samples,
    )
