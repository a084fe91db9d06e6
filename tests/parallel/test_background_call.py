"""Calls in another thread."""

import threading

import pytest

from gaitopt.parallel.background_call import BackgroundCall


def test_the_call_runs_in_another_thread():
    call = BackgroundCall(threading.current_thread)
    assert call.result() is not threading.current_thread()
    assert call.result() is call.result()


def test_an_error_is_raised_where_the_result_is_used():
    call = BackgroundCall(lambda: 1 // 0)
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            call.result()


def test_without_a_thread_the_function_is_called_immediately(monkeypatch):
    def refuse(thread):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", refuse)
    assert BackgroundCall(threading.current_thread).result() is threading.current_thread()
