"""Which engine runs."""

import functools
from importlib.util import find_spec

from gaitopt.errors import InputError, suggest
from gaitopt.simulation.arc import Engine
from gaitopt.simulation.heyoka_engine import HeyokaEngine
from gaitopt.simulation.heyoka_expressions import heyoka_module
from gaitopt.simulation.scipy_engine import ScipyEngine

NAMES = ("auto", "heyoka", "scipy")


@functools.cache
def default_engine() -> Engine:
    """Return the fastest engine installed: heyoka where it is, else scipy.

    Examples
    --------
    >>> default_engine().name in ("heyoka", "scipy")
    True
    """
    return HeyokaEngine() if find_spec("heyoka") else ScipyEngine()


def engine_named(name: str | None = None) -> Engine:
    """Return an engine by name: ``"heyoka"``, ``"scipy"``, or ``"auto"`` (also None) for the fastest installed.

    Raises
    ------
    InputError
        If the name is unknown, or the engine is not installed.

    Examples
    --------
    >>> engine_named("scipy").name
    'scipy'
    """
    if name in (None, "auto"):
        return default_engine()
    if name == "scipy":
        return ScipyEngine()
    if name == "heyoka":
        heyoka_module()
        return HeyokaEngine()
    raise InputError(f"There is no engine {name!r}. {suggest(str(name), NAMES)}")
