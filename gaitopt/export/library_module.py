"""write_library: an interpolated gait library as a Python module that needs NumPy only."""

from pathlib import Path

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.export.python_code import write_literal
from gaitopt.export.python_controller import HEADING
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.motion import Array
from gaitopt.study.libraries.gait_library import GaitLibrary
from gaitopt.version import __version__


@check_arguments
def write_library(library: GaitLibrary, path: str | Path) -> Path:
    """Write a gait library as a Python module with the function ``step_at``, which interpolates without gaitopt.

    Parameters
    ----------
    library : GaitLibrary
    path : str or Path
        Ends in ``.py``.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the file name is not that of a module, or the file is a script that gaitopt has not written.
    ArchiveError
        If the file is not writable.

    Examples
    --------
    >>> import runpy, tempfile
    >>> from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped, sweep
    >>> from gaitopt.study import load_library
    >>> problem = GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.2, step_length=0.45, limits=Limits(torque=6),
    ...     objective="torque_squared", transcription=MultipleShooting(intervals=10))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     table = sweep(problem, {"speed": [0.6, 0.62]}, starts=1, path=f"{folder}/speeds.nc")
    ...     path = write_library(load_library(f"{folder}/speeds.nc"), f"{folder}/speeds.py")
    ...     step = runpy.run_path(str(path))["step_at"](speed=0.61)
    >>> step["torque"].shape, round(0.45 / float(step["time"][-1]), 3)
    ((2, 81), 0.61)
    """
    path = Path(path)
    if path.suffix != ".py" or not path.stem.isidentifier():
        raise InputError(
            f"Cannot write {path}: a Python module needs a file such as library.py, whose name begins with a letter "
            "and contains only letters, digits and underscores."
        )
    robot, sizes = library.robot, (library.robot.n_q, library.robot.n_u)
    text = _MODULE.format(
        heading=HEADING,
        version=__version__,
        robot=write_literal(robot.name),
        sequence=library.sequence,
        angles=write_literal(", ".join(robot.angles)),
        actuators=write_literal(", ".join(robot.actuators)),
        axes="{" + ", ".join(f"{name!r}: np.array({values.tolist()})" for name, values in library.axes.items()) + "}",
        units=dict(library.units),
        durations=_table(library.durations),
        samples=_table(library.samples),
        n_q=sizes[0],
    )
    with write_atomically(path, heading=HEADING) as file:
        file.write_text(text, encoding="utf-8")
    return path


def _table(values: Array) -> str:
    """Return an array with ten digits of each number."""
    numbers = ", ".join(f"{number:.10g}" for number in np.asarray(values, dtype=float).ravel())
    return f"np.array([{numbers}], dtype=float).reshape({values.shape})"


_MODULE = '''{heading} {version}: gait library of the robot {robot}.  It needs NumPy only.

Contact sequence {sequence}.  q: stance foot x, y [m], then {angles} [rad]; v: their rates; torques of
{actuators} [N m].
"""

import itertools

import numpy as np

nan = float("nan")
AXES = {axes}
UNITS = {units}
DURATIONS = {durations}
SAMPLES = {samples}


def step_at(**place):
    """Return the step at a value of each axis: time [s], q, v, torque, and the durations of the phases [s].

    Linear interpolation along every axis.  ValueError: a value is outside its axis, or a gait is missing at a corner
    of its grid cell.
    """
    if set(place) != set(AXES):
        raise ValueError(f"a value is needed for each of {{', '.join(AXES)}}, got {{sorted(place)}}")
    ends = []
    for name, values in AXES.items():
        if not values[0] <= place[name] <= values[-1]:
            raise ValueError(f"{{name}} must be from {{values[0]:g}} to {{values[-1]:g}}, got {{place[name]:g}}")
        start = min(int(np.searchsorted(values, place[name], side="right")) - 1, max(values.size - 2, 0))
        share = 0.0 if values.size == 1 else (place[name] - values[start]) / (values[start + 1] - values[start])
        ends.append(((start, 1.0 - share), (start + 1, share)))
    durations, rows = 0.0, 0.0
    for corner in itertools.product(*ends):
        index, weight = tuple(i for i, _ in corner), float(np.prod([w for _, w in corner]))
        if weight > 0:
            durations, rows = durations + weight * DURATIONS[index], rows + weight * SAMPLES[index]
    if not np.all(np.isfinite(durations)):
        raise ValueError(f"there is no gait at a corner of the grid cell that contains {{place}}")
    fractions = np.linspace(0.0, 1.0, rows.shape[-1])
    begins = np.concatenate([[0.0], np.cumsum(durations)[:-1]])
    time = np.concatenate([begin + length * fractions for begin, length in zip(begins, durations)])
    rows = np.concatenate(list(rows), axis=1)
    parts = np.split(rows, [{n_q}, 2 * {n_q}])
    return dict(zip(("q", "v", "torque"), parts)) | {{"time": time, "durations": durations}}
'''
