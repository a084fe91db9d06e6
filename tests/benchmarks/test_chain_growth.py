"""Walkers of 5 to 21 links: ``pytest tests/benchmarks/test_chain_growth.py --benchmark-only -s``, a minute.

A torso and two legs of equal links, whose coordinates are absolute angles, in PlanarProblem with lifted equations.
"""

import functools

import casadi as ca
import numpy as np
import pytest

from gaitopt import Collocation, Ipopt
from gaitopt.ocp.multicontact.planar_bounds import planar_bounds, planar_data, planar_structure
from gaitopt.ocp.multicontact.planar_start import planar_start
from gaitopt.ocp.multicontact.planar_transcription import transcribe_planar
from gaitopt.progress import silent
from tests.benchmarks.conftest import timed
from tests.ocp.multicontact_examples import march

LINKS, ROUNDS = (5, 7, 9, 13, 17, 21), 3

SPEEDS = (0.69, 0.695, 0.705, 0.71)
"""Speeds of the solves that start near an optimum, which has a speed of 0.7 m/s [m/s]."""


class Walker:
    """The NLP of a walker and its initial point."""

    def __init__(self, links, intervals, equations):
        method = Collocation(intervals=intervals, tolerance=np.inf)
        self.problem = march(links, transcription=method, equations=equations)
        self.transcription = transcribe_planar(planar_structure(self.problem))
        derivatives = self.transcription.nlp.derivatives
        jacobian, hessian = derivatives["jac_g"].nnz_out(1), derivatives["hess_lag"].nnz_out(0)
        self.nonzeros = hessian + jacobian + self.transcription.nlp.n_variables

    def factorise(self):
        """Return the numbers of entries and of operations of L D L^T with a minimum-degree ordering, from the pattern.

        A column of L with c entries below the diagonal takes c divisions, c (c + 1) / 2 products and as many sums.
        """
        derivatives = self.transcription.nlp.derivatives
        upper, jacobian = derivatives["hess_lag"].sparsity_out(0), derivatives["jac_g"].sparsity_out(1)
        system = ca.Sparsity.kkt(upper + upper.T, jacobian, True, True)
        factor, _ = system.ldl(True)
        below = np.bincount(factor.row(), minlength=system.size1())
        return int(np.sum(below + 1)), int(np.sum(below * (below + 2)))

    @functools.cached_property
    def optimum(self):
        return self._minimise(self.problem, planar_start(self.transcription, self.problem))[1].x

    def solve(self):
        """Return the processor's seconds per iteration of Ipopt from the initial guess to the optimum."""
        taken, result = self._minimise(self.problem, planar_start(self.transcription, self.problem))
        return taken / result.iterations

    def solve_at_other_speeds(self):
        """Return the processor's seconds per iteration of Ipopt from the optimum to those at other speeds."""
        runs = [self._minimise(self.problem.replace(speed=speed), self.optimum) for speed in SPEEDS]
        return sum(taken for taken, _ in runs) / sum(result.iterations for _, result in runs)

    def _minimise(self, problem, x):
        data, bounds = planar_data(problem), planar_bounds(self.transcription, problem)
        taken, _, result = timed(lambda: Ipopt().minimise(self.transcription.nlp, x, data, bounds, silent))
        assert result.status.ok
        return taken, result


def exponent(values):
    return float(np.polyfit(np.log(LINKS), np.log(values), 1)[0])


@pytest.mark.parametrize(("start", "intervals", "most"), [("guess", 4, 1.2), ("guess", 12, None), ("optimum", 4, 1.2)])
def test_time_per_iteration_of_a_chain(benchmark, record, start, intervals, most):
    """The factorisation takes most of the time; its operations grow faster than linearly on both grids.

    On the coarse grid, fronts are so small that their overhead, which grows linearly, takes a large part of the time.
    From the guess, where the Hessian is not positive definite, an iteration takes several factorisations, and with
    more links more of them do: 58 % of the iterations with 5 links, 79 % with 21.
    """
    walkers = {links: Walker(links, intervals, "lifted") for links in LINKS}
    seconds = {links: [] for links in LINKS}

    def once():
        for links, walker in walkers.items():
            seconds[links].append(walker.solve() if start == "guess" else walker.solve_at_other_speeds())

    benchmark.pedantic(once, rounds=ROUNDS, warmup_rounds=1)
    least = [min(seconds[links]) for links in LINKS]  # what other users of the machine take only adds
    nonzeros = [walkers[links].nonzeros for links in LINKS]
    growth = {"time": exponent(least), "nonzeros": exponent(nonzeros)}
    numbers = {"links": LINKS, "seconds": least, "nonzeros": nonzeros, "exponents": growth}
    near = "" if start == "guess" else ", near an optimum"
    record(f"chain of links, {intervals} intervals{near}", numbers)
    print(f"\n{intervals} intervals{near}: links, ms per iteration, KKT nonzeros")
    for links, value, count in zip(LINKS, least, nonzeros, strict=True):
        print(f"{links:3d} {1e3 * value:8.2f} {count:8d}")
    print(f"exponents: time {growth['time']:.2f}, nonzeros {growth['nonzeros']:.2f}")
    assert growth["nonzeros"] <= 1.2
    assert most is None or growth["time"] <= most


@pytest.mark.parametrize("intervals", [4, 12])
def test_operations_of_a_factorisation_of_a_chain(benchmark, record, intervals):
    """Operations are counted, so that their growth does not depend on the machine.

    They grow faster than linearly, since the largest dense blocks contain unknowns of all links at a few nodes.  A row
    that couples all links and all nodes would add to the fill.
    """
    counts = benchmark.pedantic(
        lambda: np.transpose([Walker(links, intervals, "lifted").factorise() for links in LINKS]), rounds=1
    )
    entries, operations = counts.tolist()
    growth = {"entries": exponent(entries), "operations": exponent(operations)}
    numbers = {"links": LINKS, "entries": entries, "operations": operations, "exponents": growth}
    record(f"operations of a chain, {intervals} intervals", numbers)
    print(f"\n{intervals} intervals: entries {entries}, operations {operations}, exponents {growth}")
    assert growth["entries"] <= 1.65
