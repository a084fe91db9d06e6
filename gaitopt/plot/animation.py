"""Animations of a gait, as GIF or MP4."""

import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryFile

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import ArchiveError, InputError
from gaitopt.motion.animation_frames import AnimationFrames
from gaitopt.motion.atomic import check_suffix, write_atomically
from gaitopt.motion.gait import Gait
from gaitopt.motion.link_roles import is_drawable
from gaitopt.motion.motion import Motion
from gaitopt.motion.motion_view import MotionView
from gaitopt.motion.planar_gait import AnyGait, PlanarGait, check_any_gait
from gaitopt.motion.planar_motion import PlanarMotion
from gaitopt.motion.view_motion import AnyMotion, view_motion
from gaitopt.plot.insets import HasMotion, choose_foot
from gaitopt.plot.stage import Picture, draw_pictures
from gaitopt.plot.style import FigureStyle

FrameObserver = Callable[[int, int], object]

_KINDS = {".gif": "image", ".mp4": "film"}
_COLOURS = 128


@check_arguments
def animate(
    gait: AnyGait | AnyMotion | HasMotion,
    path: str | Path,
    *,
    steps: int = 3,
    fps: int = 30,
    slow: float = 2.0,
    title: str | None = None,
    observer: FrameObserver | None = None,
) -> Path:
    """Write an animation of a gait: the walker, its contact force in the friction cone, and the slides of its feet.

    The step repeats, the legs swapping roles.  Slides are drawn to scale with their length written beside them, and
    again enlarged, with a scale.  A slip phase is slowed further where it would be too short to be
    seen; every frame states the slow-down.

    Parameters
    ----------
    gait : Gait, PlanarGait, a motion, or a periodic gait or walk that has one
    path : str or Path
        Ends in ``.gif`` or ``.mp4``.
    steps : int
        Number of repetitions of the step.
    fps : int
        Frames per second; a GIF keeps time in hundredths of a second, so 30 becomes 33.3, and 50 is the maximum.
    slow : float
        Seconds on the screen for a second of motion.
    title : str, optional
        Below the walker; by default the name of the robot, if `gait` states it.
    observer : callable, optional
        Receives the number of frames done and of all frames, after each frame.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the suffix is another one, `steps`, `fps` or `slow` is not positive, or the gait contains nan.
    ArchiveError
        If the file is not writable; an older file of that name is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> from gaitopt import load, animate
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     animate(gait, f"{folder}/gait.gif", steps=1, fps=5, slow=1.0).name
    'gait.gif'
    """
    from matplotlib import rc_context

    known = gait if isinstance(gait, Gait | PlanarGait) else None
    motion = gait if isinstance(gait, Motion | PlanarMotion | MotionView) else _motion_of(gait)
    path = Path(path)
    suffix = check_suffix(path, _KINDS)
    _check(motion, steps, fps, slow)
    # A GIF holds a frame for whole hundredths of a second, and viewers ignore fewer than two.
    rate = 100 / max(2, round(100 / fps)) if suffix == ".gif" else float(fps)
    choose_foot(view_motion(motion))  # raises an error for a flight
    film = AnimationFrames(motion, steps=steps, rate=rate, slow=slow)
    with write_atomically(path) as temporary, rc_context(FigureStyle().settings):
        name = _name_robot(gait) if title is None else title
        pictures = _report_frames(draw_pictures(known, film, title=name), len(film), observer)
        if suffix == ".gif":
            _write_gif(pictures, rate, temporary)
        else:
            _write_mp4(pictures, rate, temporary)
    return path


def _motion_of(gait: HasMotion) -> AnyMotion:
    if not isinstance(getattr(gait, "motion", None), Motion | PlanarMotion):
        check_any_gait(gait)
    return gait.motion


def _name_robot(gait: object) -> str:
    """Return the name of the robot of a gait in words; empty for a motion, which does not contain it."""
    name = getattr(gait, "robot_name", None)
    if name is None:
        robot = getattr(gait, "robot", None) or getattr(getattr(gait, "problem", None), "robot", None)
        name = getattr(robot, "name", robot)
    return name.replace("_", " ") if isinstance(name, str) else ""


def _check(motion: AnyMotion, steps: int, fps: int, slow: float) -> None:
    for name, value in (("steps", steps), ("fps", fps), ("slow", slow)):
        if not value > 0 or not np.isfinite(value):
            raise InputError(f"{name} of an animation must be finite and greater than 0, got {value}.")
    if not is_drawable(motion):
        raise InputError("The motion is not finite or has no duration; an animation needs finite positions.")


def _report_frames(pictures: Iterator[Picture], total: int, observer: FrameObserver | None) -> Iterator[Picture]:
    """Yield pictures, and notify the observer after each."""
    for number, picture in enumerate(pictures):
        yield picture
        if observer is not None:
            observer(number + 1, total)


def _write_gif(pictures: Iterator[Picture], rate: float, path: Path) -> None:
    """Write pictures one by one, so that a long animation need not fit in memory."""
    from PIL import Image

    images = (
        Image.fromarray(picture[:, :, :3]).quantize(_COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
        for picture in pictures
    )
    first = next(images)
    # Disposal 1, drawing over the former frame, lets Pillow store only the changes.
    settings = {"duration": round(1000 / rate), "loop": 0, "disposal": 1}
    with path.open("wb") as file:
        first.save(file, "GIF", save_all=True, append_images=images, **settings)


def _write_mp4(pictures: Iterator[Picture], rate: float, path: Path) -> None:
    """Write pictures with the ffmpeg of imageio-ffmpeg, in H.264 and the colour format that all players support."""
    from imageio_ffmpeg import get_ffmpeg_exe

    first = next(pictures)
    height, width, _ = first.shape
    source = ["-f", "rawvideo", "-pix_fmt", "rgba", "-s", f"{width}x{height}", "-r", f"{rate:g}", "-i", "-"]
    target = ["-c:v", "libx264", "-crf", "20", "-pix_fmt", "yuv420p", "-movflags", "+faststart", str(path)]
    # Messages go to a file: a pipe that is not read would fill up and stop ffmpeg.
    with TemporaryFile() as complaints:
        command = [get_ffmpeg_exe(), "-y", "-v", "error", *source, *target]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=complaints) as ffmpeg:
            if ffmpeg.stdin is None:
                raise ArchiveError("The animation was not written: ffmpeg does not accept frames.")
            try:
                ffmpeg.stdin.write(first.tobytes())
                for picture in pictures:
                    ffmpeg.stdin.write(picture.tobytes())
            except BrokenPipeError:
                pass  # ffmpeg has stopped; its exit status and message state why
            except BaseException:
                ffmpeg.kill()
                raise
        if ffmpeg.returncode != 0:
            complaints.seek(0)
            said = complaints.read().decode(errors="replace").strip().splitlines() or ["no message"]
            raise ArchiveError(f"Cannot write the animation: ffmpeg stopped with {said[-1]!r}.")
