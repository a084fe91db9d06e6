"""The NLP of a gait problem on a fixed grid as a function of one parameter, target or limit of the problem."""

from dataclasses import replace

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.motion.motion import Array
from gaitopt.ocp.bounds import bounds, nlp_data, structure
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.optimality_system import OptimalitySystem
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.relaxable_limits import typical_sizes
from gaitopt.ocp.solution.sensitivity import Number, list_numbers
from gaitopt.ocp.transcription.guard_constraints import GuardSchedule
from gaitopt.ocp.transcription.method import Method
from gaitopt.ocp.transcription.transcription import Transcription, transcribe

ROUNDING = 1e-12
"""Relative deviation from a straight line that is due to rounding errors."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Line:
    """A vector that is an affine function of the parameter; entries may be infinite.

    Attributes
    ----------
    origin : (k,) array
        Vector at the parameter zero.
    slope : (k,) array
        Derivative.
    """

    origin: Array
    slope: Array

    def at(self, value: float) -> Array:
        """Return the vector at a value of the parameter, shape (k,)."""
        return self.origin + value * self.slope


@dataclass(frozen=True, eq=False, kw_only=True)
class ParametricNlp:
    """The NLP of a gait problem as a function of a parameter, target or limit; grid and structure are fixed.

    Attributes
    ----------
    problem : GaitProblem
    number : Number
        The parameter.
    ends : (float, float)
        Range of the parameter.
    method : Method
    transcription : Transcription
    system : OptimalitySystem
    sizes : (n_variables,) array
        Typical sizes of the unknowns.
    data, lower, upper : Line
        Data of the NLP; bounds of the unknowns, followed by those of the rows.

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, compass_biped
    >>> problem = GaitProblem(robot=compass_biped(), sequence="stick | stick", friction=0.2, speed=0.6,
    ...                       step_length=0.45, limits=Limits(torque=6), objective="torque_squared")
    >>> nlp = make_parametric_nlp(problem, "friction", (0.2, 0.1), problem.transcription)
    >>> round(nlp.problem_at(0.15).friction, 12)
    0.15
    """

    problem: GaitProblem
    number: Number
    ends: tuple[float, float]
    method: Method
    transcription: Transcription
    system: OptimalitySystem
    sizes: Array
    data: Line
    lower: Line
    upper: Line

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.transcription.variables.size

    @property
    def width(self) -> float:
        """Width of the range of the parameter."""
        return abs(self.ends[1] - self.ends[0])

    def problem_at(self, value: float) -> GaitProblem:
        """Return the problem at a value of the parameter."""
        return self.number.change(value)

    def locate_sign_changes(self, x: Array) -> "ParametricNlp":
        """Return the NLP with the sign changes of the joint powers of a solution, with which absolute work is exact.

        Parameters
        ----------
        x : (n_variables,) array
        """
        layout = self.transcription.sign_changes
        if layout is None or not layout.size:
            return self
        origin = self.data.origin.copy()
        origin[layout.first : layout.first + layout.size] = self.transcription.locate_sign_changes(x)
        return replace(self, data=replace(self.data, origin=origin))

    def bounds_at(self, value: float) -> Bounds:
        """Return the bounds at a value of the parameter."""
        lower, upper = self.lower.at(value), self.upper.at(value)
        return Bounds(lower[: self.size], upper[: self.size], lower[self.size :], upper[self.size :])

    def name_constraint(self, index: int) -> str:
        """Return the name of an unknown or row, counted after the unknowns, with its place."""
        layouts = self.transcription.variables, self.transcription.constraints
        layout, place = (layouts[0], index) if index < self.size else (layouts[1], index - self.size)
        where, what = layout.label(place)
        return f"{what} at {where}"


def find_number(problem: GaitProblem, name: str) -> Number:
    """Return a parameter, target or limit of a problem by its name.

    Raises
    ------
    InputError
        If the problem has none of this name with a finite value.

    Examples
    --------
    >>> from gaitopt import GaitProblem, compass_biped
    >>> find_number(GaitProblem(robot=compass_biped(), sequence="stick | stick", friction=0.3), "friction").value
    0.3
    """
    numbers = {number.name: number for number in list_numbers(problem)}
    if name not in numbers:
        raise InputError(
            f"The problem has no parameter, target or limit {name!r} with a finite value. {suggest(name, numbers)}"
        )
    return numbers[name]


def make_parametric_nlp(
    problem: GaitProblem,
    name: str,
    ends: tuple[float, float],
    method: Method,
    schedule: GuardSchedule | None = None,
) -> ParametricNlp:
    """Return the NLP of a problem over one of its parameters, targets or limits.

    Parameters
    ----------
    problem : GaitProblem
    name : str
        Its name, such as ``"friction"``, ``"leg_mass"`` or ``"torque_limit of hip"``.
    ends : (float, float)
        Range in SI units.
    method : Method
        Its grid is kept.
    schedule : GuardSchedule, optional
        Schedule of the touchdown guard on this grid.

    Raises
    ------
    InputError
        If the problem has none of this name, or is invalid at an end of the range.
    """
    problem = problem.without_guess()
    if problem.stability is not None:
        raise InputError(
            "Branches of optimal gaits need a problem without a bound on its stability: set stability=None."
        )
    number = find_number(problem, name)
    values = ends[0], ends[1], 0.5 * (ends[0] + ends[1])
    problems = [number.change(value) for value in values]
    structures = {structure(one, method, schedule=schedule) for one in problems}
    limited = any(one.inertia_limited for one in structures)
    structures = {replace(one, inertia_limited=limited) for one in structures}
    if len(structures) > 1:
        raise InputError(
            f"The equations of the problem must be the same over the range of {name}, {ends[0]:g} to {ends[1]:g}; "
            "a torque limit of zero, or a limit that exists at only one of the ends, changes them."
        )
    transcription = transcribe(structures.pop())
    fractions = method.fractions_for(problem.sequence)
    transcription = transcription if fractions is None else transcription.place_nodes(fractions)
    limits = [bounds(transcription, one) for one in problems]
    return ParametricNlp(
        problem=problem,
        number=number,
        ends=ends,
        method=method,
        transcription=transcription,
        system=OptimalitySystem(transcription.nlp),
        sizes=typical_sizes(transcription, problem),
        data=_fit_line(name, values, [nlp_data(transcription, one) for one in problems]),
        lower=_fit_line(name, values, [np.concatenate([one.x_lower, one.g_lower]) for one in limits]),
        upper=_fit_line(name, values, [np.concatenate([one.x_upper, one.g_upper]) for one in limits]),
    )


def _fit_line(name: str, values: tuple[float, ...], vectors: list[Array]) -> Line:
    """Return the affine function through vectors at three values of the parameter."""
    first, last, middle = vectors
    with np.errstate(invalid="ignore"):  # infinity minus infinity
        slope = np.where(np.isfinite(first) & np.isfinite(last), (last - first) / (values[1] - values[0]), 0.0)
    line = Line(origin=first - values[0] * slope, slope=slope)
    if not np.allclose(line.at(values[2]), middle, rtol=ROUNDING, atol=ROUNDING):
        raise InputError(
            f"Data and bounds of the problem must be affine functions of {name} from {values[0]:g} to {values[1]:g}; "
            "divide the range where a limit changes its form."
        )
    return line
