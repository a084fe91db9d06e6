"""Impacts solved in several concurrent threads do not share memory."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from gaitopt import rimless_wheel
from gaitopt.model import solve_impact


def test_impacts_in_threads_equal_those_in_line():
    wheel = rimless_wheel()
    p = wheel.vector(wheel.resolve({"friction": 0.2}))
    q = np.array([0, 0, np.pi / 10])
    rates = np.linspace(0.5, 3, 400)

    def lost(rate):
        return solve_impact(wheel, q, np.array([0, 0, rate]), p).energy_lost

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(lost, rates)) == [lost(rate) for rate in rates]
