"""Compass biped with motors on level ground: optimal sticking and slipping gaits at one speed and step length.

Both are computed by optimal control and replayed in open loop by the event-driven simulator.
"""

from drawing import STYLE, draw_by_mode, key_of_modes
from published import OPTIMA, OWN, check_optimum

from gaitopt import GaitProblem, Limits, Mode, MultipleShooting, compass_biped, solve, verify
from gaitopt.study import PublishedValue, Reproduction


def study(speed=0.633, step_length=0.4713, friction=0.14, torque_limit=6.0, intervals=80):  # [m/s], [m], [N m]
    """Return the study."""
    gaits, numbers = [], []
    for sequence, reference in OPTIMA.items():
        gait = verify(solve(_problem(sequence, speed, step_length, friction, torque_limit, intervals)).require())
        gaits.append(gait)
        numbers.append(check_optimum(f"{sequence}: cost of transport", gait.cost_of_transport, reference, 3e-4))
        error, source = gait.verification.state_error, f"{OWN}: within 3e-7"
        numbers.append(PublishedValue(f"{sequence}: error of the replayed state", error, 0.0, 3e-7, source))
    with STYLE.figure(4.8) as figure:
        rows = figure.subplots(3, len(gaits), sharex=True, sharey="row")
        for column, gait in zip(rows.T, gaits, strict=True):
            _draw(column, gait, friction)
            column[0].set_title(f"{gait.sequence}\ncost of transport {gait.cost_of_transport:.5f}")
            column[2].set_xlabel("time [s]")
        rows[0, 0].set_ylabel("ankle torque [N m]")
        rows[1, 0].set_ylabel("hip torque [N m]")
        rows[2, 0].set(ylabel="force ratio $f_t/f_n$", ylim=(-1.3 * friction, 1.8 * friction))
        figure.align_ylabels(rows[:, 0])
        key_of_modes(figure, (Mode.SLIP_FORWARD,))
    return Reproduction(figure, tuple(numbers))


def _problem(sequence, speed, step_length, friction, torque_limit, intervals):
    return GaitProblem(
        name="compass biped",
        robot=compass_biped(),
        sequence=sequence,
        friction=friction,
        speed=speed,
        step_length=step_length,
        limits=Limits(torque=torque_limit),
        objective="cost_of_transport",
        transcription=MultipleShooting(intervals=intervals),
    )


def _draw(column, gait, friction):
    """Plot torques and force ratio of a gait over time, by contact mode."""
    parts = gait.motion.segments
    time, modes = [part.time for part in parts], [part.mode for part in parts]
    for axes, actuator in zip(column, range(2), strict=False):
        draw_by_mode(axes, time, [part.torque[actuator] for part in parts], modes)
    draw_by_mode(column[2], time, [part.force[0] / part.force[1] for part in parts], modes)
    for side in (1, -1):
        column[2].axhline(side * friction, **STYLE.limit_line)
    above = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points"}
    column[2].annotate(rf"$\mu$ = {friction:g}", (0.02, friction), (0, 3), **above)


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
