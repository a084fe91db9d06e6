"""Gaits to draw: the example, and others made from it without solving anything."""

from dataclasses import replace

import numpy as np
import pytest

from gaitopt import Word, load
from gaitopt.model.modes import Mode
from gaitopt.status import Status


@pytest.fixture(scope="session")
def slipping():
    """Return a gait with a short slip phase and a long sticking phase."""
    return load("docs/examples/compass_slip.h5")


@pytest.fixture(scope="session")
def sticking(slipping):
    """Return the example with its slip phase cut off, called sticking."""
    motion = replace(slipping.motion, segments=slipping.motion.segments[1:])
    return replace(slipping, word=Word.parse("stick | stick"), motion=motion)


@pytest.fixture(scope="session")
def slipping_both_ways(slipping):
    """Return the example with the end of its sticking phase called a backward slip."""
    first, last = slipping.motion.segments
    names = ("time", "q", "v", "torque", "force", "power", "work", "friction_work", "kinetic", "potential", "points")
    parts = [{name: getattr(last, name)[..., cut] for name in names} for cut in (slice(0, 76), slice(75, None))]
    middle, end = replace(last, **parts[0]), replace(last, mode=Mode.SLIP_BACKWARD, **parts[1])
    motion = replace(slipping.motion, segments=(first, middle, end))
    return replace(slipping, word=Word.parse("slip+ stick slip- | slip+"), motion=motion)


@pytest.fixture(scope="session")
def sloping(slipping):
    """Return the example with its ground called a slope."""
    motion = replace(slipping.motion, parameters={**slipping.motion.parameters, "slope": np.deg2rad(3)})
    return replace(slipping, motion=motion)


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
