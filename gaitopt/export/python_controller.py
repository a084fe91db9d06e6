"""write_python: a controller as a Python module that needs NumPy only."""

from pathlib import Path

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.errors import InputError
from gaitopt.export.c_controller import MOST_EVENTS, law_functions
from gaitopt.export.law_robot import require_law, require_planar_law
from gaitopt.export.planar_python import write_planar_module
from gaitopt.export.python_code import write_array, write_function, write_literal
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.atomic import write_atomically
from gaitopt.version import __version__

HEADING = '"""Written by gaitopt'
"""Text with which the modules begin that gaitopt writes, and replaces."""


@check_arguments
def write_python(robot: Robot | PlanarRobot, law: Law | PlanarLaw, path: str | Path) -> Path:
    """Write a controller as a Python module that imports NumPy only, with a class ``Controller``.

    As in C (:func:`gaitopt.write_c`), ``controller.begin(q, v)`` is called with the state after every touchdown and leg
    exchange, and ``controller.step(clock, q, v, slide)`` returns the torques at every sample.

    The controller of a robot with several contacts accepts the state of the robot, regardless of which leg is in front:
    ``controller.begin(q, v)`` is called with the first state and with that after every impact of the contact
    ``controller.section``, which ends a period and exchanges the legs; ``controller.impact()`` after every other impact
    of a contact; ``controller.step(clock, q, v)`` returns the torques at the time since the period began.

    Parameters
    ----------
    robot : Robot or PlanarRobot
    law : Law or PlanarLaw
        Such as ``feedforward(robot, gait.motion)``, or ``planar_feedforward(gait)`` for several contacts.
    path : str or Path
        Ends in ``.py``.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the suffix is not ``.py``, the file name is not that of a module, the law belongs to another robot, or the
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
        raise InputError(
            f"Cannot write {path}: a Python module needs a file such as controller.py, whose name begins with a letter "
            "and contains only letters, digits and underscores."
        )
    if isinstance(robot, PlanarRobot):
        text = write_planar_module(robot, require_planar_law(robot, law))
    else:
        text = _module(robot, require_law(robot, law))
    with write_atomically(path, heading=HEADING) as file:
        file.write_text(text, encoding="utf-8")
    return path


def _module(robot: Robot, law: Law) -> str:
    """Return the text of the module of a robot with one foot on the ground."""
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
        f"BREAKPOINTS = {write_array(law.breakpoints)}",
        f"TABLE = {write_array(law.table.T)}.reshape({law.table.shape[1]}, {law.table.shape[0]})",
        *(f"\n\n{text}" for text in functions),
        _CONTROLLER.format(
            measure="clock" if law.index is None else f"float(np.concatenate([q, v])[{law.index}])",
            values=values,
            latch="self.latched = _latch(q, v, TABLE[0].tolist())[0]" if values else "del q, v  # nothing is latched",
            events=_EVENTS.format(values=values, most=MOST_EVENTS) if events else "",
        ),
    ]
    return "\n".join(parts)


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
