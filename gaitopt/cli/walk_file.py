"""Simulated walks as files: trajectories, a figure or an animation."""

from pathlib import Path
from typing import TYPE_CHECKING

from gaitopt.dataclass import dataclass
from gaitopt.motion.view_motion import AnyMotion

if TYPE_CHECKING:
    from gaitopt.model.planar.planar_robot import PlanarRobot

FIGURES, ANIMATIONS = (".png", ".pdf", ".svg"), (".gif", ".mp4")
"""Suffixes of pictures; any other file is a CSV table."""


@dataclass(frozen=True)
class WalkFile:
    """The file of a simulated walk.

    Attributes
    ----------
    path : Path or None
        None if no file is written.
    width, font_size : float
        Width of a figure [inch] and size of its axis labels [point]; not used for other files.
    """

    path: Path | None
    width: float
    font_size: float

    def write(
        self, motion: AnyMotion, title: str, section: tuple[str, ...] = (), robot: "PlanarRobot | None" = None
    ) -> Path | None:
        """Write a walk in the format of the suffix: a figure, an animation, or trajectories as CSV.

        An animation has the first line of the title only.

        `section` are the events that end the steps of a robot with several contacts, and `robot` is such a robot.

        Raises
        ------
        InputError
            If the motion has no samples.
        ArchiveError
            If the file is not writable.
        """
        if self.path is None:
            return None
        suffix = self.path.suffix.lower()
        if suffix in FIGURES:
            from gaitopt.plot.gait_figure import plot_motion
            from gaitopt.plot.saving import save_figure
            from gaitopt.plot.style import FigureStyle

            style = FigureStyle(width=self.width, font_size=self.font_size)
            return save_figure(plot_motion(motion, title=title, style=style), self.path)
        if suffix in ANIMATIONS:
            from gaitopt.plot.animation import animate

            return animate(motion, self.path, steps=1, title=title.partition("\n")[0])  # beside its legend
        from gaitopt.export.csv_file import write_csv

        return write_csv(motion, self.path, section=section, robot=robot)
