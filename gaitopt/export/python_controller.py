"""write_python: a controller as a Python module that needs NumPy only."""

import re
from pathlib import Path

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.errors import InputError
from gaitopt.export.c_controller import MOST_EVENTS, law_functions
from gaitopt.export.python_code import write_function
from gaitopt.model.robot import Robot
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.motion import Array
from gaitopt.motion.printable import comment_line
from gaitopt.version import __version__

HEADING = '"""Written by gaitopt'
"""Text with which the modules begin that gaitopt writes, and replaces."""


@check_arguments
def write_python(robot: Robot, law: Law, path: str | Path) -> Path:
    """Write a controller as a Python module that imports NumPy only, with a class ``Controller``.

    As in C (:func:`gaitopt.write_c`), ``controller.begin(q, v)`` is called with the state after every touchdown and leg
    exchange, and ``controller.step(clock, q, v, slide)`` returns the torques at every sample.

    Parameters
    ----------
    robot : Robot
    law : Law
        Such as ``feedforward(robot, gait.motion)``.
    path : str or Path
        Ends in ``.py``.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the suffix is another one, the file name is not that of a module, the law belongs to another robot, or the
        file is a script that gaitopt has not written.
    ArchiveError
        If the file is not writable.

    Examples
    --------
    >>> import runpy, tempfile
    >>> from gaitopt import compass_biped, feedforward, load
    >>> robot, gait = compass_biped(), load("docs/examples/compass_slip.h5")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = write_python(robot, feedforward(robot, gait.motion), f"{folder}/controller.py")
    ...     controller = runpy.run_path(str(path))["Controller"]()
    >>> controller.step(0.1, [0, 0, -0.1, -0.1], [0, 0, 0.7, 0.7]).shape
    (2,)
    """
    path = Path(path)
    if path.suffix != ".py" or not path.stem.isidentifier():
        raise InputError(f"Cannot write {path}: a Python module needs a file such as controller.py.")
    if law.torque.size1_out(0) != robot.n_u or law.torque.size1_in(1) != robot.n_q:
        raise InputError(f"The law {law.name!r} does not belong to the robot {robot.name!r}.")
    values, events = len(law.memory.values), len(law.memory.events)
    functions = [write_function(function, f"_{function.name()}") for function in law_functions(law)]
    parts = [
        _MODULE.format(
            robot=write_literal(robot.name),
            law=write_literal(law.name),
            version=__version__,
            angles=write_literal(", ".join(robot.angles)),
            actuators=write_literal(", ".join(robot.actuators)),
            latched=write_literal(", ".join(law.memory.values) or "none"),
            events=write_literal(", ".join(law.memory.events) or "none"),
        ),
        f"BREAKPOINTS = {_array(law.breakpoints)}",
        f"TABLE = {_array(law.table.T)}.reshape({law.table.shape[1]}, {law.table.shape[0]})",
        *(f"\n\n{text}" for text in functions),
        _CONTROLLER.format(
            measure="clock" if law.index is None else f"float(np.concatenate([q, v])[{law.index}])",
            values=values,
            latch="self.latched = _latch(q, v, TABLE[0].tolist())[0]" if values else "del q, v  # nothing is latched",
            events=_EVENTS.format(values=values, most=MOST_EVENTS) if events else "",
        ),
    ]
    with write_atomically(path, heading=HEADING) as file:
        file.write_text("\n".join(parts), encoding="utf-8")
    return path


def write_literal(text: str) -> str:
    """Return a text that cannot end the docstring of the module."""
    return re.sub(r'["\\]', "'", comment_line(text))


def _array(values: Array) -> str:
    """Return numbers as a NumPy array with all digits."""
    numbers = np.asarray(values, dtype=float).ravel().tolist()
    texts = [repr(number) if np.isfinite(number) else f'float("{number}")' for number in numbers]
    return f"np.array([{', '.join(texts)}], dtype=float)"


_MODULE = '''"""Written by gaitopt {version}: controller of the robot {robot}, law {law}.  It needs NumPy only.

q: stance foot x, y [m], then {angles} [rad]; v: their rates.
Torques of {actuators} [N m].  Latched values: {latched}.  Events: {events}.
"""

import math

import numpy as np
'''

_EVENTS = """\
        for _ in range({most}):
            guards = _torque([clock], q, v, self.latched, [slide], data)[1]
            fallen = [number for number, guard in enumerate(guards) if guard < 0]
            if not fallen:
                break
            after = _reset([clock], q, v, self.latched, data)[0]
            self.latched = after[{values} * fallen[0] : {values} * (fallen[0] + 1)]
"""

_CONTROLLER = '''

class Controller:
    """The controller and its state between samples, the latched values."""

    def __init__(self):
        self.latched = [0.0] * {values}

    def begin(self, q, v):
        """Latch new values from the state (n_q arrays) after a touchdown and leg exchange."""
        {latch}

    def step(self, clock, q, v, slide=0.0):
        """Return the torques, shape (n_u,), at the time since touchdown [s]; events change the latched values first.

        slide: 1, -1 or 0 as the stance foot slides forward, backward or not.
        """
        clock, slide = float(clock), float(slide)
        q, v = [float(value) for value in q], [float(value) for value in v]
        data = self._data(clock, q, v)
{events}        torque = _torque([clock], q, v, self.latched, [slide], data)[0]
        return np.array(torque)

    def _data(self, clock, q, v):
        """Return the row of the table that applies."""
        piece = np.searchsorted(BREAKPOINTS, {measure}, side="right") - 1
        return TABLE[max(int(piece), 0)].tolist()
'''
