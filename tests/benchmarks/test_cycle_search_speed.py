"""Time of the search for gaits, as ratios measured in one run: ``pytest tests/benchmarks --benchmark-only -s``.

Target: at most twice the time of the plain search that gaitopt used before, which finds fewer gaits.  Measured ratios
are 0.17 to 1.79, the largest at frictions 0.13 and 0.17, where the plain search finds one of two gaits.  The plain
search applies Newton's method to 200 random states of the section, once for each period up to the longest.  Both use
the same engine, and all known gaits of a case must be among those that `find_cycles` returns.  The plain search counts
a gait again with multiples of its period.
"""

import math
import statistics

import numpy as np
import pytest

from gaitopt import compass_biped, find_cycles, passive, rimless_wheel
from gaitopt.simulation import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.step_limits import StepLimits
from gaitopt.stability.cycle_iteration import find_cycle, same_gait
from gaitopt.stability.section import Section
from gaitopt.stability.section_walk import natural_rate
from tests.benchmarks.conftest import timed

pytest.importorskip("heyoka")

ROUNDS, MOST, PLAIN_STARTS = 3, 2.0, 200
COMPASS, WHEEL = compass_biped(), rimless_wheel()
GOSWAMI = {"leg_mass": 5.0, "hip_mass": 10.0, "leg_length": 1.0, "leg_com": 0.5, "gravity": 9.81, "friction": math.inf}
GAIT_A, GAIT_B, GAIT_C = "stick | stick", "slip+ stick slip- | stick", "slip+ stick | slip+"
DOUBLED = "; ".join([GAIT_A, GAIT_A])


def compass(friction, *known, steps=1):
    return COMPASS, {"slope": math.radians(1), "friction": friction}, steps, {*known}


def wheel(friction, *known):
    return WHEEL, {"slope": math.radians(13), "friction": friction}, 1, {*known}


def goswami(degrees, steps, *known):
    return COMPASS, {**GOSWAMI, "slope": math.radians(degrees)}, steps, {*known}


CASES = {
    **{f"compass {p / 100}": compass(p / 100, GAIT_A if p >= 18 else GAIT_B, GAIT_C) for p in range(10, 31)},
    "compass 0.1445, 2 steps": compass(0.1445, GAIT_B, GAIT_C, "; ".join([GAIT_C, GAIT_C]), steps=2),
    "wheel 0.1": wheel(0.1, "slip+ | slip+"),
    "wheel 0.24": wheel(0.24, "slip+ | slip+", "slip+ stick slip+ | slip+"),
    "wheel 0.25": wheel(0.25, "slip+ | slip+", "slip+ stick slip+ | stick"),
    "wheel 0.3": wheel(0.3, "slip+ | slip+", "stick slip+ | stick"),
    "wheel 1.0": wheel(1.0, GAIT_A),
    "Goswami 3 deg": goswami(3, 1, GAIT_A),
    "Goswami 4.6 deg, 2 steps": goswami(4.6, 2, GAIT_A, DOUBLED),
    "Goswami 4.92 deg, 4 steps": goswami(4.92, 4, GAIT_A, DOUBLED, "; ".join(4 * [GAIT_A])),
    "Goswami 5.03 deg, 8 steps": goswami(5.03, 8, GAIT_A, DOUBLED, "; ".join(4 * [GAIT_A]), "; ".join(8 * [GAIT_A])),
}


def random_states(walker, section):
    """Yield random states from which a step is completed, as in the search of gaitopt before deflation."""
    rng, count = np.random.default_rng(0), len(walker.robot.angles)
    natural, height = natural_rate(walker.robot, walker.p)
    for i in range(PLAIN_STARTS):
        z = np.concatenate([-rng.uniform(0.02, 0.5, count - 1), np.zeros(count + 1)])
        size = 3 * natural * abs(section.embed(z)[section.dependent_entry])
        z[count - 1 :] = rng.uniform(-1, 1, count + 1) * size
        z[-1] = z[-1] * height if i % 2 and np.isfinite(walker.contact.friction) else 0.0
        if walker.walk_step(section.embed(z)).following is not None:
            yield z


def search_plainly(robot, parameters, steps):
    """Return the gaits to which Newton's method converges from random states, for each period."""
    p, law = robot.vector(robot.resolve(parameters)), passive(robot)
    limits = StepLimits(duration=20 / natural_rate(robot, p)[0])
    walker, gaits = Walker(robot, law, p, default_engine(law, robot), step_limits=limits), []
    for period in range(1, steps + 1):
        for z in random_states(walker, Section(robot, p, sliding=True)):
            gait = find_cycle(walker, z, period)
            if gait is not None and not any(same_gait(gait, other) for other in gaits):
                gaits.append(gait)
    return gaits


@pytest.mark.parametrize("case", CASES)
def test_cycle_search(benchmark, case):
    (robot, parameters, steps, known), times = CASES[case], {"plain": [], "systematic": []}
    gaits = {name: [] for name in times}

    def in_turn():
        for name, search in (
            ("plain", lambda: search_plainly(robot, parameters, steps)),
            ("systematic", lambda: find_cycles(robot, parameters, steps=steps)),
        ):
            seconds, _, gaits[name] = timed(search)
            times[name].append(seconds)

    benchmark.pedantic(in_turn, rounds=ROUNDS, warmup_rounds=1)
    assert known <= {gait.sequence for gait in gaits["systematic"]}
    median = {name: statistics.median(values) for name, values in times.items()}
    ratio = median["systematic"] / median["plain"]
    counts = {name: len(values) for name, values in gaits.items()}
    benchmark.extra_info.update(ratio=ratio, **{f"{name}_gaits": count for name, count in counts.items()})
    print(
        f"\n{case}: plain {median['plain']:.3f} s, {counts['plain']} gaits; systematic {median['systematic']:.3f} s, "
        f"{counts['systematic']} gaits; ratio {ratio:.2f}"
    )
    assert ratio < MOST
