"""Ctrl-C during a study is never lost, wherever it strikes."""

import _imp
import contextlib
import signal
import sys
import threading
import time
import weakref
from importlib.machinery import ExtensionFileLoader

import casadi as ca
import pytest

from gaitopt import Execution, find_cycles, load, save
from gaitopt.interrupts import defer_interrupt, hold_interrupt, record_interrupts, stop_on_interrupt
from gaitopt.parallel.runner import run_tasks
from gaitopt.parallel.task_graph import Task
from gaitopt.stability import cycle_search
from tests.parallel import works


class Thing:
    """Something whose end calls back."""


@pytest.fixture(autouse=True)
def handled():
    """Have Python's own handler, also where the tests were started in the background."""
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, former)


def test_an_interrupt_where_python_would_forget_it_is_answered():
    with hold_interrupt() as interrupt:
        thing = Thing()
        reference = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))
        del thing
        assert reference() is None
        with pytest.raises(KeyboardInterrupt):
            interrupt.check()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_an_interrupt_in_a_callback_is_raised_again():
    """Python prints an exception in the callback of a weak reference and continues."""
    former = sys.unraisablehook

    @record_interrupts()
    def lose_interrupt_and_wait():
        thing = Thing()
        reference = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))
        del thing
        assert reference() is None
        time.sleep(20)

    with pytest.raises(KeyboardInterrupt):
        lose_interrupt_and_wait()
    assert sys.unraisablehook is former


class InterruptedConversion:
    """A number whose conversion by CasADi is interrupted."""

    def __DM__(self):
        signal.raise_signal(signal.SIGINT)
        return ca.DM(1)


@record_interrupts()
def convert_and_wait():
    ca.sin(InterruptedConversion())
    time.sleep(20)


def test_an_interrupt_in_a_conversion_by_casadi_is_raised_after_it():
    """The wrapper of CasADi clears the exception and continues."""
    with pytest.raises(KeyboardInterrupt):
        convert_and_wait()


@record_interrupts()
def import_compiled_module_and_wait(loader):
    with contextlib.suppress(KeyboardInterrupt):  # as modules written in Cython do
        loader.exec_module(None)
    time.sleep(20)


def test_an_interrupt_while_a_compiled_module_is_imported_is_raised_after_it(monkeypatch):
    monkeypatch.setattr(_imp, "exec_dynamic", lambda _: signal.raise_signal(signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        import_compiled_module_and_wait(ExtensionFileLoader("compiled", "compiled.so"))


def test_an_interrupt_while_the_handler_is_restored_is_not_lost(tmp_path, monkeypatch):
    """It comes after the last statement of the block in which interrupts are held."""
    restore, signals = signal.signal, [signal.SIGINT]

    def restore_late(number, handler):
        if handler is signal.default_int_handler and signals:
            signal.raise_signal(signals.pop())
        return restore(number, handler)

    gait = load("docs/examples/compass_slip.h5")
    monkeypatch.setattr(signal, "signal", restore_late)
    with pytest.raises(KeyboardInterrupt):
        save(gait, tmp_path / "gait.h5")


@pytest.mark.parametrize("block", [hold_interrupt, lambda: stop_on_interrupt(int)])
def test_an_interrupt_of_an_inner_block_is_recorded_around_it(block):
    with record_interrupts() as outer, record_interrupts() as inner:
        with block():
            signal.raise_signal(signal.SIGINT)
        assert outer.received
        assert inner.received
    with record_interrupts() as later:
        assert not later.received


def test_the_second_one_is_not_held():
    with hold_interrupt():
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_study_ends_at_the_next_wait():
    running = run_tasks(works.slow_add, [Task(str(i), i) for i in range(50)], 0, execution=Execution(workers=2))
    next(running)
    signal.raise_signal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        list(running)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_nothing_is_held_in_another_thread():
    done = []

    def work():
        with hold_interrupt() as interrupt:
            interrupt.check()
        done.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done == [signal.default_int_handler]


def lose_interrupt(shared, argument):
    """Raise a Ctrl-C and lose it, as CasADi's wrapper does; then complain of something else."""
    with contextlib.suppress(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
    if argument:
        raise TypeError("Implicit conversion of symbolic CasADi type to numeric matrix not supported.")


@pytest.mark.parametrize("fails", [False, True])
def test_an_interrupt_that_a_task_loses_is_raised_after_it(fails):
    with pytest.raises(KeyboardInterrupt):
        list(run_tasks(lose_interrupt, [Task("a", fails), Task("b")]))
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@defer_interrupt()
def interrupted(done, error=None):
    signal.raise_signal(signal.SIGINT)
    done.append(1)
    if error is not None:
        raise error


@pytest.mark.parametrize("error", [None, TypeError])
def test_a_deferred_interrupt_is_raised_at_the_end_of_the_block_also_after_an_error(error):
    done = []
    with pytest.raises(KeyboardInterrupt):
        interrupted(done, error)
    assert done == [1]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_contexts_may_be_nested():
    asked = []
    with stop_on_interrupt(lambda: asked.append("stop")):
        with defer_interrupt():
            signal.raise_signal(signal.SIGINT)
            assert asked == []
        assert asked == ["stop"]
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_recorded_interrupts_are_raised_all_the_same():
    with record_interrupts() as interrupt:
        assert not interrupt.received
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        assert interrupt.received


def test_a_search_for_gaits_is_interrupted_between_starts(wheel, monkeypatch):
    """CasADi would lose a Ctrl-C in the middle of a step."""
    walked, done = [], cycle_search.find_cycle

    def find_cycle(*arguments, **options):
        signal.raise_signal(signal.SIGINT)
        walked.append(done(*arguments, **options))

    monkeypatch.setattr(cycle_search, "find_cycle", find_cycle)
    with pytest.raises(KeyboardInterrupt):
        find_cycles(wheel, {"slope": 0.23}, starts=20)
    assert len(walked) == 1


def test_an_ignored_interrupt_stays_ignored():
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with defer_interrupt(), hold_interrupt() as interrupt, record_interrupts():
        signal.raise_signal(signal.SIGINT)
        interrupt.check()
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
