"""Basins of robots with several contacts."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

    from gaitopt.cli.inputs import Request
    from gaitopt.motion.motion import Array
    from gaitopt.motion.planar_gait import PlanarGait
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem


def read_planar_subject(request: "Request") -> "PlanarWalkProblem | PlanarGait | None":
    """Return the walking problem or the optimised gait of a robot with several contacts; None for any other input.

    Raises
    ------
    InputError
        If the engine is unknown or not installed, or the gait is not a solution.
    """
    from gaitopt.cli.planar_gait_walk import find_planar_gait, is_planar_gait
    from gaitopt.simulation.engine_choice import planar_engine_named
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem

    planar_engine_named(request.engine)  # which rejects an unknown one before a gait is solved
    stated = request.stated if request.is_script else request.gait
    if is_planar_gait(stated):
        return find_planar_gait(stated)
    if isinstance(stated, PlanarWalkProblem) and isinstance(request.problem, PlanarWalkProblem):
        return request.problem
    return None


def find_planar_basin(
    subject: "PlanarWalkProblem | PlanarGait",
    choice: tuple[str, list[str], float | None, bool],
    axes: "Mapping[str, Array]",
    base: Mapping[str, float],
    **options: Any,
) -> "xr.Dataset":
    """Return the basin of a robot with several contacts.

    Parameters
    ----------
    subject : PlanarWalkProblem or PlanarGait
    choice : tuple
        Name, gains, torque limit and phase variable of the law, as in :class:`PlanarLawOption`.
    axes : mapping of str to array
    base : mapping of str to float
    options : dict
        Those of :func:`gaitopt.basin`.
    """
    from gaitopt.cli.planar_law_option import PlanarLawOption
    from gaitopt.motion.planar_gait import PlanarGait
    from gaitopt.study.basins.basin import basin

    chosen = PlanarLawOption(*choice).make(subject) if isinstance(subject, PlanarGait) else None
    return basin(subject, base, axes, law=chosen, **options)


def compute_gait_share(table: "xr.Dataset", subject: "PlanarWalkProblem | PlanarGait") -> float | None:
    """Return the share of the starts that end in a saved gait; None for a script, or if parameters vary."""
    from gaitopt.motion.planar_gait import PlanarGait
    from gaitopt.study.basins.basin_file import basin_key, fraction_at

    names = [str(name) for name in table.coordinate.values]
    if not isinstance(subject, PlanarGait) or any(str(name) not in names for name in table.ending.dims):
        return None
    return fraction_at(table, basin_key(table)["method"]["gait"], names)
