"""A problem that is solved in a twentieth of a second."""

import contextlib

import pytest

from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped


def quick_problem(**changes):
    return GaitProblem(
        robot=compass_biped(),
        sequence="stick | stick",
        friction=0.14,
        speed=0.633,
        step_length=0.4713,
        limits=Limits(torque=6),
        objective="torque_squared",
        transcription=MultipleShooting(intervals=10),
    ).replace(**changes)


@pytest.fixture(scope="session")
def problem():
    return quick_problem()


@pytest.fixture
def full_disk():
    """Return a context in which no file grows beyond some bytes, as on a full disk."""
    resource = pytest.importorskip("resource")
    former = resource.getrlimit(resource.RLIMIT_FSIZE)

    @contextlib.contextmanager
    def limited(size):
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, former[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, former)

    return limited
