"""The frames of an animation as pictures."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from gaitopt.motion.animation_frames import AnimationFrame, AnimationFrames
from gaitopt.motion.planar_gait import AnyGait
from gaitopt.motion.view_motion import view_motion
from gaitopt.plot.insets import EnlargedFoot, ForceDiagram, Header, name_legs
from gaitopt.plot.scene import Scene

if TYPE_CHECKING:
    from matplotlib.artist import Artist

Picture = NDArray[np.uint8]

WIDTH, HEIGHT, DOTS_PER_INCH = 9.6, 5.44, 100
"""Size of a frame in inches; in pixels both are multiples of 16, the blocks films are coded in."""


class Part(Protocol):
    """A part of the picture: its moving elements are drawn again in every frame, all others only once."""

    moving: list["Artist"]

    def show(self, frame: AnimationFrame) -> None:
        """Move everything to its position in a frame."""


def draw_pictures(gait: AnyGait | None, film: AnimationFrames, *, title: str = "") -> Iterator[Picture]:
    """Yield the picture of each frame, an array of shape (544, 960, 4) that is valid until the next one is requested.

    Parameters
    ----------
    gait : Gait, PlanarGait or None
        None for a simulated motion.
    film : AnimationFrames
        Frames of the gait's motion.
    title : str
        Written below the walker.

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> next(draw_pictures(gait, AnimationFrames(gait.motion, steps=1, rate=30, slow=2.0))).shape
    (544, 960, 4)
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, HEIGHT), dpi=DOTS_PER_INCH)
    canvas = FigureCanvasAgg(figure)
    scene = Scene(figure.add_axes((0.0, 0.02, 0.67, 0.86), label="walker"), gait, film)
    slips = any(part.slipping for part in view_motion(film.motion).segments)
    place = (0.735, 0.52, 0.24, 0.3) if slips else (0.735, 0.32, 0.24, 0.4)
    forces = ForceDiagram(figure.add_axes(place, label="force"), film)
    name_legs(figure, film.motion)
    parts: list[Part] = [scene, forces, Header(figure, gait, film, title=title)]
    if slips:
        parts.append(EnlargedFoot(figure.add_axes((0.735, 0.11, 0.24, 0.24), label="foot"), film, film, scene.scale))
    for part in parts:
        part.show(film.frame(0))  # the view of the still background depends on it
    _animate_moving(parts)
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)
    for number in range(len(film)):
        frame = film.frame(number)
        canvas.restore_region(still)
        for part in parts:
            part.show(frame)
            for artist in sorted(part.moving, key=lambda artist: artist.get_zorder()):
                artist.draw(canvas.get_renderer())
        yield np.asarray(canvas.buffer_rgba())


def _animate_moving(parts: Sequence[Part]) -> None:
    """Keep what moves out of the still background."""
    for part in parts:
        for artist in part.moving:
            artist.set_animated(True)
