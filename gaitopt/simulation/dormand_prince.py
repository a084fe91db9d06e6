"""The explicit Runge-Kutta method of order 8 of Dormand and Prince with error control and dense output of order 7.

The method is DOP853 (Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, section II.5).  It takes the
steps of :class:`scipy.integrate.DOP853`, to the last bit, in less time; the import of SciPy takes longer than a short
solve and its replay.
"""

import math
from collections.abc import Callable

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.ocp.solution.runge_kutta import A, B, C

SAFETY, SMALLEST_FACTOR, LARGEST_FACTOR = 0.9, 0.2, 10.0
"""Safety factor of a new step, and bounds of its ratio to the last one."""

SMALLEST_TOLERANCE = 100 * float(np.finfo(float).eps)
"""Least relative tolerance; smaller ones are replaced by it."""

STAGES, ALL_STAGES = 12, 16
"""Number of stages of a step, and with those of the dense output."""

# fmt: off
A_DENSE = np.array([
    [0.056167502283047954, 0.0, 0.0, 0.0, 0.0, 0.0, 0.25350021021662483, -0.2462390374708025, -0.12419142326381637,
     0.15329179827876568, 0.00820105229563469, 0.007567897660545699, -0.008298, 0.0, 0.0, 0.0],
    [0.03183464816350214, 0.0, 0.0, 0.0, 0.0, 0.028300909672366776, 0.053541988307438566, -0.05492374857139099, 0.0,
     0.0, -0.00010834732869724932, 0.0003825710908356584, -0.00034046500868740456, 0.1413124436746325, 0.0, 0.0],
    [-0.42889630158379194, 0.0, 0.0, 0.0, 0.0, -4.697621415361164, 7.683421196062599, 4.06898981839711,
     0.3567271874552811, 0.0, 0.0, 0.0, -0.0013990241651590145, 2.9475147891527724, -9.15095847217987, 0.0],
])
"""Weights of the earlier stages in the states of the further stages of the dense output, shape (3, 16)."""

C_DENSE = (0.1, 0.2, 0.7777777777777778)
"""Times of the further stages as fractions of the step."""

E3 = np.array([
    -0.18980075407240762, 0.0, 0.0, 0.0, 0.0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
    -0.4226823213237919, -0.1521609496625161, 0.20136540080403034, 0.02265179219836082, 0.0,
])
"""Weights of the stages in the error estimate of order 3, shape (13,)."""

E5 = np.array([
    0.01312004499419488, 0.0, 0.0, 0.0, 0.0, -1.2251564463762044, -0.4957589496572502, 1.6643771824549864,
    -0.35032884874997366, 0.3341791187130175, 0.08192320648511571, -0.022355307863886294, 0.0,
])
"""Weights of the stages in the error estimate of order 5, shape (13,)."""

D = np.array([
    [-8.428938276109013, 0.0, 0.0, 0.0, 0.0, 0.5667149535193777, -3.0689499459498917, 2.38466765651207,
     2.117034582445028, -0.871391583777973, 2.2404374302607883, 0.6315787787694688, -0.08899033645133331,
     18.148505520854727, -9.194632392478356, -4.436036387594894],
    [10.427508642579134, 0.0, 0.0, 0.0, 0.0, 242.28349177525817, 165.20045171727028, -374.5467547226902,
     -22.113666853125306, 7.733432668472264, -30.674084731089398, -9.332130526430229, 15.697238121770845,
     -31.139403219565178, -9.35292435884448, 35.81684148639408],
    [19.985053242002433, 0.0, 0.0, 0.0, 0.0, -387.0373087493518, -189.17813819516758, 527.8081592054236,
     -11.57390253995963, 6.8812326946963, -1.0006050966910838, 0.7777137798053443, -2.778205752353508,
     -60.19669523126412, 84.32040550667716, 11.99229113618279],
    [-25.69393346270375, 0.0, 0.0, 0.0, 0.0, -154.18974869023643, -231.5293791760455, 357.6391179106141,
     93.40532418362432, -37.45832313645163, 104.0996495089623, 29.8402934266605, -43.53345659001114,
     96.32455395918828, -39.17726167561544, -149.72683625798564],
])
"""Weights of the stages in the last four coefficients of the dense output, shape (4, 16)."""
# fmt: on

STAGE_ROWS = [(s, float(C[s]), A[s, :s]) for s in range(1, STAGES)]
DENSE_ROWS = [(s, c, A_DENSE[s - STAGES - 1, :s]) for s, c in enumerate(C_DENSE, STAGES + 1)]
"""Number of each later stage, its time as a fraction of the step, and the weights of the stages before it."""

Rate = Callable[[float, Array], Array]


class StepPolynomial:
    """Interpolating polynomial of order 7 of one step.

    Attributes
    ----------
    t_old, t : float [s]
        Times of the beginning and the end of the step.
    """

    def __init__(self, t_old: float, t: float, y_old: Array, coefficients: Array) -> None:
        self.t_old, self.t = t_old, t
        self._start, self._coefficients = y_old, coefficients[::-1]
        self._table: dict[float, Array] = {}

    def __call__(self, t: float) -> Array:
        """Return the state at a time, shape (n,)."""
        known = self._table.get(t)
        if known is not None:
            return known
        x = (t - self.t_old) / (self.t - self.t_old)
        factors, y = (x, 1 - x), np.zeros_like(self._start)
        for i, coefficient in enumerate(self._coefficients):
            y += coefficient
            y *= factors[i % 2]
        y += self._start
        return y

    def tabulate(self, times: list[float]) -> None:
        """Evaluate the states at times at which they will be needed, in a fraction of the time of single calls."""
        states = self.at_times(np.array(times))
        states.flags.writeable = False
        self._table.update(zip(times, states, strict=True))

    def at_times(self, times: Array) -> Array:
        """Return the states at several times, shape (K, n); they are those of single calls to the last bit."""
        x = ((times - self.t_old) / (self.t - self.t_old))[:, None]
        factors, y = (x, 1 - x), np.zeros((times.size, self._start.size))
        for i, coefficient in enumerate(self._coefficients):
            y += coefficient
            y *= factors[i % 2]
        y += self._start
        return y


class DormandPrince:
    """Integrator of an initial value problem y' = f(t, y) forward in time, step by step.

    Parameters
    ----------
    rate : callable
        (t, y) -> f, shape (n,).
    t : float [s]
    y : (n,) array
    end : float [s]
        The last step ends there.
    relative, absolute : float
        The estimated error of a step is at most ``absolute + relative |y|``, in the root mean square.
    first_step : float, optional [s]
        Length of the first step; estimated by default.

    Attributes
    ----------
    t : float [s]
    y : (n,) array
    t_old, y_old
        Time and state before the last step.
    status : str
        ``"running"``, ``"finished"``, or ``"failed"`` if the step has become too small.

    Examples
    --------
    >>> integrator = DormandPrince(lambda t, y: -y, 0.0, np.array([1.0]), 1.0, relative=1e-10, absolute=1e-12)
    >>> while integrator.status == "running":
    ...     integrator.step()
    >>> round(float(integrator.y[0]), 9)
    0.367879441
    """

    def __init__(
        self,
        rate: Rate,
        t: float,
        y: Array,
        end: float,
        *,
        relative: float,
        absolute: float,
        first_step: float | None = None,
    ) -> None:
        self._rate, self._end = rate, end
        self._relative, self._absolute = max(relative, SMALLEST_TOLERANCE), absolute
        self.t, self.y, self.status = t, np.asarray(y, dtype=float), "running"
        self.t_old, self.y_old = t, self.y
        self._slope = rate(t, self.y)
        self._stages = np.empty((ALL_STAGES, self.y.size))
        self._earlier = [self._stages[:s].T for s in range(ALL_STAGES)]
        self._length = self._estimate_first_step() if first_step is None else first_step

    def step(self) -> None:
        """Take one step, shorter ones first if its error is too large."""
        t, y = self.t, self.y
        smallest = 10 * abs(math.nextafter(t, math.inf) - t)
        length = max(self._length, smallest)
        if t == self._end:
            self.t_old, self.y_old, self.status = t, y, "finished"
            return
        rejected = False
        while length >= smallest:
            t_new = min(t + length, self._end)
            length = t_new - t
            y_new, slope = self._advance(length)
            error = self._estimate_error(length, y_new)
            if error < 1:
                factor = LARGEST_FACTOR if error == 0 else min(LARGEST_FACTOR, SAFETY * error**-0.125)
                self._length = length * (min(1.0, factor) if rejected else factor)
                self.t_old, self.y_old, self.t, self.y, self._slope = t, y, t_new, y_new, slope
                if t_new >= self._end:
                    self.status = "finished"
                return
            length *= max(SMALLEST_FACTOR, SAFETY * error**-0.125)
            rejected = True
        self.status = "failed"

    def dense_output(self) -> StepPolynomial:
        """Return the interpolating polynomial of the last step."""
        stages, h, start = self._stages, self.t - self.t_old, self.y_old
        for s, c, weights in DENSE_ROWS:
            stages[s] = self._rate(self.t_old + c * h, start + np.dot(self._earlier[s], weights) * h)
        coefficients, change = np.empty((7, start.size)), self.y - start
        coefficients[0] = change
        coefficients[1] = h * stages[0] - change
        coefficients[2] = 2 * change - h * (self._slope + stages[0])
        coefficients[3:] = h * np.dot(D, stages)
        return StepPolynomial(self.t_old, self.t, start, coefficients)

    def _advance(self, h: float) -> tuple[Array, Array]:
        """Return the state after a step and its rate."""
        t, y, stages = self.t, self.y, self._stages
        stages[0] = self._slope
        for s, c, weights in STAGE_ROWS:
            stages[s] = self._rate(t + c * h, y + np.dot(self._earlier[s], weights) * h)
        y_new = y + h * np.dot(self._earlier[STAGES], B)
        slope = self._rate(t + h, y_new)
        stages[STAGES] = slope
        return y_new, slope

    def _estimate_error(self, h: float, y_new: Array) -> float:
        """Return the estimated error of a step in units of the tolerance; nan if it is not finite."""
        stages = self._stages[: STAGES + 1]
        scale = self._absolute + np.maximum(np.abs(self.y), np.abs(y_new)) * self._relative
        fifth, third = (_norm(np.dot(stages.T, weights) / scale) for weights in (E5, E3))
        fifth, third = fifth * fifth, third * third  # without an exception if they overflow
        if fifth == 0 and third == 0:
            return 0.0
        return h * fifth / math.sqrt((fifth + 0.01 * third) * y_new.size)

    def _estimate_first_step(self) -> float:
        """Return the length of the first step (Hairer, Norsett & Wanner, section II.4)."""
        longest, root = self._end - self.t, self.y.size**0.5
        if longest == 0:
            return 0.0
        scale = self._absolute + np.abs(self.y) * self._relative
        size, rate = _norm(self.y / scale) / root, _norm(self._slope / scale) / root
        step = min(1e-6 if size < 1e-5 or rate < 1e-5 else 0.01 * size / rate, longest)
        if step == 0:  # the rate is too large
            return 0.0
        slope = self._rate(self.t + step, self.y + step * self._slope)
        bend = _norm((slope - self._slope) / scale) / root / step
        both = max(rate, bend)
        second = max(1e-6, step * 1e-3) if both <= 1e-15 else (0.01 / both) ** 0.125
        return min(100 * step, second, longest)


def _norm(vector: Array) -> float:
    return math.sqrt(vector.dot(vector))
