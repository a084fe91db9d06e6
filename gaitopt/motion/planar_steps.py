"""number_steps: the step of each segment of a walk of a robot with several contacts."""

from collections.abc import Sequence

from gaitopt.motion.planar_motion import PlanarMotion


def number_steps(motion: PlanarMotion, section: Sequence[str]) -> list[int]:
    """Return the number of the step of each segment, from 0.

    Parameters
    ----------
    motion : PlanarMotion
    section : sequence of str
        Events that end the steps in turn; without any, the motion is one step.

    Examples
    --------
    >>> from gaitopt.model.robots.vertical_hopper import vertical_hopper
    >>> from gaitopt.simulation import simulate_planar
    >>> motion = simulate_planar(vertical_hopper(), [0.7, 0.2], [0, 0], {}, duration=0.5).motion
    >>> [event.names[0] for event in motion.events]
    ['sole closes', 'sole extends', 'full length closes']
    >>> number_steps(motion, ["sole closes"])
    [0, 1, 1, 1]
    """
    steps, step = [], 0
    for k in range(len(motion.segments)):
        steps.append(step)
        if section and k < len(motion.events) and motion.events[k].includes(section[step % len(section)]):
            step += 1
    return steps
