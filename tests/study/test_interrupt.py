"""Ctrl-C during a study is never lost, wherever it strikes."""

import signal
import threading
import weakref

import pytest

from gaitopt.parallel.deferred_interrupt import DeferredInterrupt
from gaitopt.parallel.runner import run_tasks
from gaitopt.parallel.task_graph import Task
from tests.study import works


class Thing:
    """Something whose end calls back."""


@pytest.fixture(autouse=True)
def handled():
    """Have Python's own handler, also where the tests were started in the background."""
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, former)


def test_an_interrupt_where_python_would_forget_it_is_answered():
    with DeferredInterrupt() as interrupt:
        thing = Thing()
        reference = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))
        del thing
        assert reference() is None
        with pytest.raises(KeyboardInterrupt):
            interrupt.answer()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_the_second_one_is_not_held():
    with DeferredInterrupt():
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_study_ends_at_the_next_wait():
    running = run_tasks(works.slow_add, [Task(str(i), i) for i in range(50)], 0, workers=2)
    next(running)
    signal.raise_signal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        list(running)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_nothing_is_held_in_another_thread():
    done = []

    def work():
        with DeferredInterrupt() as interrupt:
            interrupt.answer()
        done.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done == [signal.default_int_handler]
