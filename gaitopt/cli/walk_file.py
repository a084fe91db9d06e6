"""Simulated walks as files: trajectories, a figure or an animation."""

from pathlib import Path

from gaitopt.motion.view_motion import AnyMotion

FIGURES, ANIMATIONS = (".png", ".pdf", ".svg"), (".gif", ".mp4")
"""Suffixes of pictures; any other file is a CSV table."""


def write_walk(motion: AnyMotion, path: Path, title: str, section: tuple[str, ...] = ()) -> Path:
    """Write a walk in the format of the suffix: a figure, an animation, or trajectories as CSV.

    `section` are the events that end the steps of a robot with several contacts.

    Raises
    ------
    InputError
        If the motion has no samples.
    ArchiveError
        If the file is not writable.
    """
    suffix = path.suffix.lower()
    if suffix in FIGURES:
        from gaitopt.plot.gait_figure import plot_motion
        from gaitopt.plot.saving import save_figure

        return save_figure(plot_motion(motion, title=title.replace("_", " ")), path)
    if suffix in ANIMATIONS:
        from gaitopt.plot.animation import animate

        return animate(motion, path, steps=1)
    from gaitopt.export.csv_file import write_csv

    return write_csv(motion, path, section=section)
