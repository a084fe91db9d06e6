"""The compass biped with motors on level ground, and the line style of each contact sequence."""

from published import OPTIMA, check_optimum

from gaitopt import GaitProblem, Limits, compass_biped

SPEED, STEP, FRICTION, TORQUE = 0.633, 0.4713, 0.14, 6.0
"""[m/s], [m], Coulomb coefficient, [N m]."""

SEQUENCE_STYLE = {
    "stick | stick": {"color": "#0072B2", "linestyle": "-", "marker": "o"},
    "slip+ stick | slip+": {"color": "#D55E00", "linestyle": (0, (5, 1.5)), "marker": "s"},
    "stick slip- | stick": {"color": "#009E73", "linestyle": (0, (5, 1.5, 1, 1.5)), "marker": "^"},
    "slip+ stick slip- | slip+": {"color": "#AA4499", "linestyle": (0, (1.5, 1)), "marker": "D"},
}
"""Okabe and Ito's colours; dashes and markers distinguish the sequences in grey print."""


def standard_numbers(costs):
    """Yield costs of transport by contact sequence, at the values above, with independent reference values (0.1 %)."""
    for sequence, reference in OPTIMA.items():
        if sequence in costs:
            yield check_optimum(f"{sequence}: cost of transport of the standard gait", costs[sequence], reference)


def at_minimum_duration(table):
    """Return the points of a sweep at which a phase has the minimum duration allowed by the limits."""
    return table.shortest_phase.values < 1.01 * Limits().shortest_phase


def walker(speed=SPEED, step_length=STEP, friction=FRICTION, torque=TORQUE, **changes):
    """Return the problem that the studies vary."""
    return GaitProblem(
        name="compass biped",
        robot=compass_biped(),
        sequence="stick | stick",
        friction=friction,
        speed=speed,
        step_length=step_length,
        limits=Limits(torque=torque),
        **changes,
    )
