"""Rimless wheel: ratio of tangential to normal contact force over a step of the gait without slip (Type A).

The maximum of its modulus is the critical friction of the gait; the impulse ratio at touchdown is smaller in modulus.
"""

import numpy as np
from drawing import STYLE
from published import CLOSED_FORM, check_value
from rimless_closed_forms import force, gait_speed, velocity_ratio
from rimless_setup import HALF, INERTIA_RATIO, SLOPE, SPOKES, gait, speed_of, walk

from gaitopt.study import PublishedValue, Reproduction


def study():
    """Return the study."""
    cycle = gait("A", np.inf)
    need, slope = cycle.critical_friction, np.deg2rad(SLOPE)
    numbers = (
        check_value("Type A: theta_rate after impact", speed_of(cycle), "0.876031", "rad/tau_c"),
        check_value("Type A: multiplier", cycle.multipliers[0].real, "0.734042"),
        _exact("theta_rate after impact", speed_of(cycle), gait_speed(SPOKES, INERTIA_RATIO, slope), "rad/tau_c"),
        _exact("multiplier", cycle.multipliers[0].real, velocity_ratio(SPOKES, INERTIA_RATIO) ** 2, "1"),
        check_value("Type A: critical friction", need.friction, "0.914"),
        PublishedValue(
            "Type A: theta at the critical friction", need.state[2], HALF, 1e-6, "Gamus & Or 2015: +pi/10", "rad"
        ),
        check_value("Type A: impulse ratio at touchdown", cycle.impact_ratio, "-0.2374"),
    )
    return Reproduction(_draw(cycle, slope), numbers)


def _exact(name, value, closed_form, unit):
    return PublishedValue(f"Type A: {name}, closed form", value, closed_form, 1e-10, CLOSED_FORM, unit)


def _draw(cycle, slope):
    """Draw the force ratio over the angle: simulated, and by the closed form."""
    motion = walk(speed_of(cycle)).motion
    theta = np.linspace(-HALF, HALF, 181)
    f_t, f_n = force(theta, speed_of(cycle), SPOKES, INERTIA_RATIO, slope)
    critical = cycle.critical_friction
    with STYLE.figure(3.2) as figure:
        axes = figure.subplots()
        axes.plot(np.rad2deg(theta), f_t / f_n, color="#0072B2", label="closed form")
        simulated = motion.channel("force")[0] / motion.channel("force")[1]
        marks = {"fillstyle": "none", "markersize": 4.5, "color": "#0072B2", "label": "simulated"}
        axes.plot(np.rad2deg(motion.channel("q")[2]), simulated, "o", **marks)
        axes.axhline(
            -critical.friction, label=rf"critical friction $\mu$ = {critical.friction:.3f}", **STYLE.limit_line
        )
        end = (float(np.rad2deg(HALF)), cycle.impact_ratio)
        axes.plot(
            *end, "D", color="black", markersize=5, label="touchdown impulse $\\Lambda_t/\\Lambda_n$", linestyle="none"
        )
        axes.annotate(
            f"{end[1]:.4f}".replace("-", "\N{MINUS SIGN}"),
            end,
            (-8, 0),
            textcoords="offset points",
            ha="right",
            va="center",
        )
        axes.set(xlabel=r"angle $\theta$ [deg]", ylabel=r"force ratio $f_t/f_n$", xlim=(-19, 19), ylim=(-1.0, 0.0))
        axes.legend(loc="lower left", bbox_to_anchor=(0.02, 0.12))
    return figure


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
