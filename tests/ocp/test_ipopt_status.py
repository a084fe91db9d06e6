import itertools
import json
import math
import mmap
import os
import signal
import threading
from contextlib import contextmanager

import numpy as np
import pytest

from gaitopt import Collocation, InputError, Ipopt, MultipleShooting, StabilityBound, Status, solve
from gaitopt.interrupts import defer_interrupt
from gaitopt.motion import summarise
from gaitopt.ocp.bounds import structure
from gaitopt.ocp.nlp import ipopt
from gaitopt.ocp.nlp.nlp import Nlp
from gaitopt.ocp.transcription.relaxation import Scholtes
from gaitopt.ocp.transcription.transcription import transcribe


@pytest.mark.skipif(not hasattr(mmap, "MAP_PRIVATE"), reason="allocates as POSIX does")
def test_memory_without_room_for_linear_algebra_is_an_error(monkeypatch):
    """OpenBLAS would try to allocate its buffer for ever."""
    monkeypatch.setattr(ipopt, "BLAS_BUFFER", 2**60)
    with pytest.raises(MemoryError, match="insufficient for the linear algebra"):
        ipopt._require_memory_of_blas.__wrapped__()


@pytest.fixture(scope="module")
def problem(reference_problem):
    return reference_problem(intervals=10)


def interrupter(number):
    def observe(iteration):
        if iteration.number == number:
            raise KeyboardInterrupt

    return observe


def test_progress_counts_iterations_and_ends_feasible(problem):
    seen = []
    gait = solve(problem, observer=seen.append)
    assert gait.status is Status.SOLVED
    numbers = [step.number for step in seen]
    # With a refinement of the integration the count starts again.
    assert all(number in (0, before + 1) for before, number in itertools.pairwise(numbers))
    assert numbers[0] == 0
    assert len(seen) == gait.solver.iterations + numbers.count(0)
    assert seen[0].infeasibility > 1e-2
    assert seen[-1].infeasibility < 1e-6
    assert seen[-1].objective == pytest.approx(gait.solver.objective, rel=1e-4)


@pytest.mark.parametrize("number", [0, 4])
def test_an_interrupt_keeps_the_iterate(problem, number):
    gait = solve(problem, observer=interrupter(number))
    assert gait.status is Status.INTERRUPTED
    assert gait.solver.message == "User_Requested_Stop"
    assert gait.solver.iterations == number
    assert np.all(np.isfinite(gait.solution.unknowns["angles"].values))
    assert np.any(gait.solution.unknowns["angles"].values)
    json.dumps(summarise(gait), allow_nan=False)


def test_ctrl_c_stops_the_solver_and_gives_the_signal_back(problem):
    former = signal.getsignal(signal.SIGINT)

    def observe(iteration):
        if iteration.number == 3:
            os.kill(os.getpid(), signal.SIGINT)

    gait = solve(problem, observer=observe)
    assert gait.status is Status.INTERRUPTED
    assert gait.solver.iterations in (3, 4)  # the signal is seen at this iteration's callback or at the next
    assert signal.getsignal(signal.SIGINT) is former


def test_a_solve_after_an_interrupt_is_whole(problem):
    solve(problem, observer=interrupter(2))
    assert solve(problem).status is Status.SOLVED


def test_a_solve_in_another_thread(problem):
    found = []
    thread = threading.Thread(target=lambda: found.append(solve(problem)))
    thread.start()
    thread.join()
    assert found[0].status is Status.SOLVED


def test_what_the_next_thread_begins_is_not_mixed_up_with_what_was_found(problem, monkeypatch):
    callbacks, build = [], ipopt._compile

    @contextmanager
    def lock():
        yield
        for callback in callbacks:  # a thread that has waited for its turn
            callback.interrupted, callback.failure, callback.best = True, ValueError("of another thread"), None

    def recorded(*arguments):
        callbacks.append(build(*arguments)[1])
        return build(*arguments)

    monkeypatch.setattr(ipopt, "ONE_AT_A_TIME", lock())
    monkeypatch.setattr(ipopt, "_compile", recorded)
    problem = problem.replace(transcription=Collocation(intervals=10, tolerance=math.inf))
    assert solve(problem, solver=Ipopt(), starts=1).status is Status.SOLVED


def test_an_observer_that_solves_within_ipopt_is_told(problem):
    """Ipopt within Ipopt would crash the process."""
    with pytest.raises(InputError, match="solve afterwards"):
        solve(problem, observer=lambda iteration: solve(problem))
    assert solve(problem).status is Status.SOLVED


def test_an_observer_that_fails_is_heard(problem, capfd):
    def observe(iteration):
        raise ValueError("no more paper")

    with pytest.raises(ValueError, match="no more paper"):
        solve(problem, observer=observe)
    assert capfd.readouterr() == ("", "")


def test_a_linear_solver_that_is_not_installed(problem, capfd):
    gait = solve(problem, solver=Ipopt(linear_solver="ma27"))
    assert gait.status is Status.INVALID_OPTION
    assert "the linear solver" in gait.status.hint
    assert gait.solver.iterations == 0
    assert math.isnan(gait.solver.objective)
    # The gait is the starting point, not whatever the solver left behind.
    assert gait.solution.unknowns["angles"].values[:, 0] == pytest.approx([-0.1478, -0.1478], abs=1e-3)
    assert gait.step_length > 0.4
    assert summarise(gait)["solver"]["objective"] is None
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("transcription", "status"),
    [(MultipleShooting(intervals=8), Status.INVALID_NUMBER), (Collocation(intervals=8), Status.INFEASIBLE)],
)
def test_a_singular_robot_is_a_status_not_a_flood_of_warnings(reference_problem, capfd, transcription, status):
    """A leg whose mass sits in the hip has a massless swing leg, and no acceleration."""
    gait = solve(reference_problem(parameters={"leg_com": 1.6}, transcription=transcription))
    assert gait.status is status
    json.dumps(summarise(gait), allow_nan=False)
    assert capfd.readouterr() == ("", "")


def test_the_iteration_limit(problem):
    steps = []
    gait = solve(problem, solver=Ipopt(max_iterations=3), starts=1, observer=steps.append)
    assert gait.status is Status.ITERATION_LIMIT
    numbers = [step.number for step in steps]
    assert numbers[:5] == [0, 1, 2, 3, 0]  # the search for a feasible motion follows
    assert gait.solver.iterations == sum(number > 0 for number in numbers)
    assert gait.solver.violations
    assert gait.solver.constraint_violation == gait.solver.violations[0].size > 1e-6


def test_the_time_limit(problem):
    gait = solve(problem, solver=Ipopt(time_limit=1e-3))
    assert gait.status is Status.TIME_LIMIT
    assert gait.solver.iterations < 10


@pytest.mark.parametrize(
    ("option", "reason"),
    [
        ({"linear_solver": "mump"}, "no linear solver 'mump'. Did you mean 'mumps'"),
        ({"linear_solver": None}, "no linear solver None"),
        ({"tolerance": 0}, "Ipopt.tolerance must be greater than 0"),
        ({"tolerance": math.nan}, "Ipopt.tolerance must be a finite number"),
        ({"max_iterations": -1}, "Ipopt.max_iterations must be at least 0"),
        ({"max_iterations": 2.5}, "Ipopt.max_iterations must be a whole number"),
        ({"max_iterations": "many"}, "Ipopt.max_iterations must be a whole number, got 'many'"),
        ({"time_limit": 0}, "Ipopt.time_limit must be greater than 0"),
    ],
)
def test_options_that_cannot_be(option, reason):
    with pytest.raises(InputError, match=reason):
        Ipopt(**option)


def test_a_loose_tolerance_is_used(problem):
    loose, tight = (solve(problem, solver=Ipopt(tolerance=tolerance)) for tolerance in (1e-3, 1e-9))
    assert loose.status is Status.SOLVED
    assert loose.solver.objective != tight.solver.objective
    assert loose.solver.objective == pytest.approx(tight.solver.objective, rel=1e-2)


def test_an_interrupt_while_something_is_built_comes_when_it_is_built():
    done = []

    def build():
        with defer_interrupt():
            signal.raise_signal(signal.SIGINT)
            done.append("built")

    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            build()
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, former)
    assert done == ["built"]


@pytest.mark.parametrize(("unknowns", "expected"), [(2000, False), (10, True)])
def test_large_nlps_are_ordered_for_little_fill(problem, monkeypatch, unknowns, expected):
    """The ordering changes the time alone: the optimum is the same."""
    seen, build = [], Nlp.solver

    def record(self, name, plugin, settings):
        seen.append("ipopt.mumps_pivot_order" in settings)
        return build(self, name, plugin, settings)

    ipopt._compile.cache_clear()
    usual = solve(problem, starts=1)
    monkeypatch.setattr(Nlp, "solver", record)
    monkeypatch.setattr(ipopt, "LARGE", unknowns)
    ipopt._compile.cache_clear()
    gait = solve(problem, starts=1, solver=Ipopt())
    ipopt._compile.cache_clear()
    assert seen
    assert set(seen) == {expected}
    assert gait.solver.objective == pytest.approx(usual.solver.objective, rel=1e-7)


def test_directions_are_refined_where_rows_may_be_nearly_dependent(problem):
    """Without refinement, the infeasibility of an open problem is no longer concluded (test_open_impact)."""

    def options(stated, barrier, solver=None, relaxation=None):
        nlp = transcribe(structure(stated, stated.transcription, relaxation=relaxation)).nlp
        chosen = (solver or Ipopt())._options(nlp, barrier)
        return chosen.get("ipopt.fast_step_computation"), chosen.get("ipopt.mumps_scaling")

    assert options(problem, None) == ("yes", None)
    assert options(problem, 1e-6) == ("yes", 0)
    assert options(problem, 1e-6, Ipopt(permute=True)) == (None, None)
    assert options(problem.replace(sequence="slip+ stick | any"), 1e-6, relaxation=Scholtes()) == (None, None)
    assert options(problem.replace(stability=StabilityBound(radius=0.9)), 1e-6) == (None, None)
