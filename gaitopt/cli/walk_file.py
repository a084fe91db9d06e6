"""Simulated walks as files: trajectories, a figure or an animation."""

from pathlib import Path

from gaitopt.motion.atomic import check_suffix
from gaitopt.motion.view_motion import AnyMotion

FIGURES, ANIMATIONS = (".png", ".pdf", ".svg"), (".gif", ".mp4")

FORMATS = {".csv": "table"} | dict.fromkeys(FIGURES, "figure") | dict.fromkeys(ANIMATIONS, "animation")
"""Accepted suffixes and what they contain."""


def write_walk(motion: AnyMotion, path: Path, title: str, section: tuple[str, ...] = ()) -> Path:
    """Write a walk in the format of the suffix: a figure, an animation, or trajectories as CSV.

    `section` are the events that end the steps of a robot with several contacts.

    Raises
    ------
    InputError
        If the motion has no samples, or the suffix is that of no format.
    ArchiveError
        If the file is not writable.
    """
    suffix = check_suffix(path, FORMATS)
    if suffix in FIGURES:
        from gaitopt.plot.gait_figure import plot_motion
        from gaitopt.plot.saving import save_figure

        return save_figure(plot_motion(motion, title=title.replace("_", " ")), path)
    if suffix in ANIMATIONS:
        from gaitopt.plot.animation import animate

        return animate(motion, path, steps=1)
    from gaitopt.export.csv_file import write_csv

    return write_csv(motion, path, section=section)
