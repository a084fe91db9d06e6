"""Robots, the example gait, and others made from it without solving anything, shared by all tests."""

import shutil
import signal
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import settings

from gaitopt import ContactSequence, compass_biped, load, rimless_wheel
from gaitopt.model.contacts.mode import Mode
from gaitopt.status import Status
from tests import dask

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # Started in the background of a shell: programs we start would ignore Ctrl-C like ourselves.
    signal.signal(signal.SIGINT, signal.default_int_handler)

# The same examples at every run, however slow the machine.
settings.register_profile("fixed", derandomize=True, deadline=None)
settings.load_profile("fixed")

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory):
    """Return the address of a Dask scheduler with two workers, processes of this machine.

    Its four processes take 6 % of a processor even while they are idle, so they end with the tests of the file.
    """
    with dask.scheduler(tmp_path_factory.mktemp("dask")) as (address, _), dask.workers(address, 2):
        yield address


@pytest.fixture(scope="session")
def compass():
    return compass_biped()


@pytest.fixture(scope="session")
def wheel():
    return rimless_wheel()


@pytest.fixture(scope="session")
def slip_gait():
    """Return the example: an optimised gait 'slip+ stick | slip+' on level ground at friction 0.14."""
    return load(ROOT / "docs" / "examples" / "compass_slip.h5")


@pytest.fixture(scope="session")
def write_old_file():
    """Return a function that writes the example as a file of version 2, which only names its robot."""

    def write(path, robot="compass_biped"):
        shutil.copy(ROOT / "tests" / "motion" / "compass_slip_version_2.h5", path)
        with h5py.File(path, "a") as file:
            file.attrs["robot"] = robot
        return path

    return write


@pytest.fixture(scope="session")
def rolling():
    """Return a problem of a biped with round feet, whose robot, slope and parameters other problems may share."""
    from gaitopt.cli.script import build_problem

    return build_problem(ROOT / "problems" / "round_feet_slip.py", [])


@pytest.fixture(scope="session")
def rolling_gait(rolling):
    """Return its gait 'slip+ stick | slip+', which slides by 27 mm while it rolls."""
    from gaitopt import solve, verify

    return verify(solve(rolling))


@pytest.fixture(scope="session")
def passive_rolling(rolling):
    """Return the walk of a passive walker with round feet, one of them on the ground at a time, on a slope of 0.01."""
    from gaitopt import WalkProblem

    lengths = {"leg_length": 1.2, "foot_radius": 0.2, "leg_com": 0.7}
    masses = {"leg_mass": 0.5, "leg_inertia": 0.02, "hip_mass": 1.0, "gravity": 1.0}
    return WalkProblem(robot=rolling.robot, parameters={**lengths, **masses, "slope": 0.01, "friction": np.inf})


@pytest.fixture
def rng():
    return np.random.default_rng(20150801)


@pytest.fixture(scope="session")
def slipping(slip_gait):
    """Return a gait with a short slip phase and a long sticking phase."""
    return slip_gait


@pytest.fixture(scope="session")
def sticking(slipping):
    """Return the example with its slip phase cut off, called sticking."""
    motion = replace(slipping.motion, segments=slipping.motion.segments[1:])
    return replace(slipping, sequence=ContactSequence.parse("stick | stick"), motion=motion)


@pytest.fixture(scope="session")
def slipping_both_ways(slipping):
    """Return the example with the end of its sticking phase called a backward slip."""
    first, last = slipping.motion.segments
    arrays = {name: value for name, value in vars(last).items() if isinstance(value, np.ndarray)}
    parts = [{name: value[..., cut] for name, value in arrays.items()} for cut in (slice(0, 76), slice(75, None))]
    middle, end = replace(last, **parts[0]), replace(last, mode=Mode.SLIP_BACKWARD, **parts[1])
    motion = replace(slipping.motion, segments=(first, middle, end))
    return replace(slipping, sequence=ContactSequence.parse("slip+ stick slip- | slip+"), motion=motion)


@pytest.fixture(scope="session")
def sloping(slipping):
    """Return the example with its ground called a slope."""
    motion = replace(slipping.motion, parameters={**slipping.motion.parameters, "slope": np.deg2rad(3)})
    return replace(slipping, motion=motion)


@pytest.fixture(scope="session")
def damped(slipping):
    """Return the example as if dampers had taken 0.25 J/s from it and its springs had stored 0.5 J/s."""
    segments = tuple(
        replace(part, damping_work=0.25 * (part.time - part.time[0]), elastic=1 + 0.5 * part.time)
        for part in slipping.motion.segments
    )
    return replace(slipping, motion=replace(slipping.motion, segments=segments))


@pytest.fixture(scope="session")
def infeasible(slipping):
    """Return the example called infeasible."""
    return replace(slipping, status=Status.INFEASIBLE)


@pytest.fixture(scope="session")
def not_a_number(slipping):
    """Return a failed gait whose last iterate is nan."""
    segments = tuple(
        replace(part, time=part.time * np.nan, points=part.points * np.nan) for part in slipping.motion.segments
    )
    motion = replace(slipping.motion, segments=segments)
    return replace(slipping, status=Status.INVALID_NUMBER, motion=motion)


@pytest.fixture(scope="session")
def hop_gait():
    """Return a verified hop of the monopod, 'foot stick > flight |', on a coarse grid."""
    from gaitopt import solve, verify
    from gaitopt.cli.script import call_script

    settings = ["stance_intervals=6", "flight_intervals=16", "clearance=0.02"]
    gait = verify(solve(call_script(ROOT / "problems" / "monopod.py", settings)))
    assert gait.verification.passed
    return gait
