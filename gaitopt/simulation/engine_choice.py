"""Selection of the simulation engine."""

import functools
from importlib.util import find_spec
from typing import TYPE_CHECKING, cast

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.scipy_engine import ScipyEngine

if TYPE_CHECKING:
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine

NAMES = ("auto", "heyoka", "scipy")


@check_arguments
def default_engine(law: Law | None = None, robot: Robot | None = None) -> Engine:
    """Return the fastest engine that supports a law and a robot: heyoka if it is installed, otherwise scipy.

    If heyoka is installed but cannot be imported, a warning is logged once.

    Parameters
    ----------
    law : Law, optional
        Passive by default.  heyoka does not support torques or guards that are not smooth, such as ``fabs`` or
        ``if_else``.
    robot : Robot, optional
        By default one whose forces are smooth; a potential such as that of a stop at a knee may not be.

    Examples
    --------
    >>> default_engine().name in ("heyoka", "scipy")
    True
    """
    if (
        find_spec("heyoka")
        and _imports_heyoka()
        and (law is None or _is_smooth(law.control))
        and (robot is None or _is_smooth(robot.dynamics))
    ):
        return _make_heyoka_engine()
    return ScipyEngine()


@functools.cache
def _imports_heyoka() -> bool:
    """Return whether heyoka, which is installed, can be imported; log why it cannot."""
    from gaitopt.simulation.taylor.expression_conversion import heyoka_module

    try:
        heyoka_module()
    except InputError as error:
        import logging  # whose import takes as long as that of ten other modules

        logging.getLogger("gaitopt").warning("%s The engine scipy is used, which is slower.", error)
        return False
    return True


@functools.lru_cache(maxsize=64)
def _is_smooth(function: ca.Function) -> bool:
    """Return whether heyoka supports a function."""
    from gaitopt.simulation.taylor.expression_conversion import can_follow

    return can_follow(function)


def _make_heyoka_engine() -> Engine:
    from gaitopt.simulation.taylor.heyoka_engine import HeyokaEngine  # the import of its parts takes long

    return HeyokaEngine()


def engine_named(name: str = "auto", law: Law | None = None, robot: Robot | None = None) -> Engine:
    """Return an engine by name: ``"heyoka"``, ``"scipy"``, or ``"auto"`` for the fastest one that supports a law.

    Raises
    ------
    InputError
        If the name is unknown, or the engine is not installed.

    Examples
    --------
    >>> engine_named("scipy").name
    'scipy'
    """
    if name == "auto":
        return default_engine(law, robot)
    if name == "scipy":
        return ScipyEngine()
    if name == "heyoka":
        from gaitopt.simulation.taylor.expression_conversion import heyoka_module

        heyoka_module()
        return _make_heyoka_engine()
    raise InputError(f"There is no engine {name!r}. {suggest(name, NAMES)}")


@check_arguments
def planar_engine_named(name: str = "auto") -> "PlanarEngine":
    """Return the engine of robots with several contacts by name: ``"heyoka"``, or ``"scipy"`` (also ``"auto"``).

    heyoka compiles each contact state first, which takes seconds, once on a machine; see the page on stability.

    Raises
    ------
    InputError
        If the name is unknown, or the engine is not installed.

    Examples
    --------
    >>> planar_engine_named("auto").name
    'scipy'
    """
    if name in ("auto", "scipy"):
        from gaitopt.simulation.planar_simulation.planar_engine import REFERENCE  # imports scipy

        return REFERENCE
    if name == "heyoka":
        from gaitopt.simulation.taylor.expression_conversion import heyoka_module
        from gaitopt.simulation.taylor.planar_taylor_engine import PlanarTaylorEngine

        heyoka_module()
        return PlanarTaylorEngine()
    raise InputError(f"There is no engine {name!r}. {suggest(name, NAMES)}")


def choose_engine(engine: "Engine | PlanarEngine | None", law: Law, robot: Robot) -> Engine:
    """Return an engine of walkers with one foot on the ground: the given one, or the one of the same name.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> from gaitopt.control import passive
    >>> choose_engine(planar_engine_named("scipy"), passive(compass_biped()), compass_biped()).name
    'scipy'
    """
    if engine is None or hasattr(engine, "flow"):
        return cast("Engine | None", engine) or default_engine(law, robot)
    return engine_named(engine.name, law, robot)


def choose_planar_engine(engine: "Engine | PlanarEngine | None") -> "PlanarEngine":
    """Return an engine of robots with several contacts: the given one, or the one of the same name; scipy for None.

    Examples
    --------
    >>> choose_planar_engine(ScipyEngine()).name
    'scipy'
    """
    if hasattr(engine, "begin"):
        return cast("PlanarEngine", engine)
    return planar_engine_named("auto" if engine is None else engine.name)


def engine_for(robot: "Robot | PlanarRobot", name: str) -> "Engine | PlanarEngine | None":
    """Return the engine of a robot by name; None for ``"auto"``.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> engine_for(compass_biped(), "scipy").name, engine_for(compass_biped(), "auto")
    ('scipy', None)
    """
    if name == "auto":
        return None
    return engine_named(name) if isinstance(robot, Robot) else planar_engine_named(name)


def faster_walks(engine: Engine) -> str | None:
    """Return advice on a faster engine, or None if no installation makes walks faster.

    Examples
    --------
    >>> faster_walks(default_engine()) is None or "gaitopt[fast]" in faster_walks(default_engine())
    True
    """
    if engine.name != "scipy" or find_spec("heyoka"):
        return None
    return "The heyoka engine simulates walks about a hundred times faster. On Linux: pip install 'gaitopt[fast]'."


def faster_planar_walks(engine: "PlanarEngine") -> str | None:
    """Return advice for slow walks of a robot with several contacts; None if they do not use scipy.

    Examples
    --------
    >>> faster_planar_walks(planar_engine_named("scipy")).partition(":")[0]
    'With stiff feedback the heyoka engine is about ten times faster, after a compilation that may \
take some minutes'
    """
    if engine.name != "scipy":
        return None
    install = "" if find_spec("heyoka") else "; on Linux, install it by pip install 'gaitopt[fast]'"
    return (
        "With stiff feedback the heyoka engine is about ten times faster, after a compilation that may take some "
        f"minutes: --engine heyoka{install}."
    )
